// SPDX-License-Identifier: Apache-2.0
#include "image/formats.h"

#include "base/atomic_file.h"
#include "image/asset_image.h"

#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::image {

namespace {

/// IEC 61966-2-1.
float linear_from_srgb(float v) {
    return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}

bool is_srgb(const OIIO::ImageSpec& spec, SourceColorSpace space) {
    if (space != SourceColorSpace::Auto) return space == SourceColorSpace::Srgb;
    if (spec.format.is_floating_point()) return false;
    const std::string stated = spec.get_string_attribute("oiio:ColorSpace");
    return stated.empty() || stated == "sRGB" || stated == "Rec709";
}

}  // namespace

Result<RgbImage> read_rgb_image(const std::string& path,
                                SourceColorSpace space,
                                const ReadLimits& limits,
                                size_t* not_finite) {
    const Result<AssetImage> opened = open_asset_image(path);
    if (!opened) {
        return Error{"image-open",
                     fmt::format("cannot open the image {}: {}", path, opened.error().message)};
    }
    const AssetImage& input = *opened;
    const OIIO::ImageSpec spec = input->spec();
    if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0) {
        return Error{"image-open", fmt::format("cannot open the image {}: it has no pixels", path)};
    }
    if (spec.width > limits.max_side || spec.height > limits.max_side ||
        size_t(spec.width) * size_t(spec.height) > limits.max_pixels) {
        return Error{
            "image-too-large",
            fmt::format("the image {} has {}×{} pixels, the limit is {} a side and {} together",
                        path, spec.width, spec.height, limits.max_side, limits.max_pixels)};
    }
    const int channels = spec.nchannels >= 3 ? 3 : 1;
    std::vector<float> stored(size_t(spec.width) * size_t(spec.height) * size_t(channels));
    if (!input->read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, stored.data())) {
        return Error{"image-read",
                     fmt::format("cannot read the image {}: {}", path, input->geterror())};
    }

    RgbImage image;
    image.width = spec.width;
    image.height = spec.height;
    image.pixels.resize(3 * size_t(spec.width) * size_t(spec.height));
    const bool decode = is_srgb(spec, space);
    size_t faults = 0;
    for (size_t i = 0; i < image.pixels.size(); ++i) {
        float v = stored[channels == 3 ? i : i / 3];
        if (!std::isfinite(v)) {
            v = 0.0f;
            ++faults;
        }
        image.pixels[i] = decode ? linear_from_srgb(v) : v;
    }
    if (not_finite) *not_finite = faults;
    return image;
}

Result<void> write_display_image(const std::string& path,
                                 int width,
                                 int height,
                                 const std::vector<float>& rgb) {
    std::vector<uint8_t> bytes(rgb.size());
    std::transform(rgb.begin(), rgb.end(), bytes.begin(), [](float v) {
        // Written so that NaN becomes 0
        const float clamped = v > 0.0f ? std::min(v, 1.0f) : 0.0f;
        return uint8_t(std::lround(clamped * 255.0f));
    });
    return write_atomically(path, [&](const std::string& temporary) -> Result<void> {
        const auto error = [&path](const std::string& why) {
            return Error{"io-write", fmt::format("cannot write {}: {}", path, why)};
        };
        const auto output = OIIO::ImageOutput::create(temporary);
        if (!output) return error(OIIO::geterror());
        OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::UINT8);
        spec.attribute("oiio:ColorSpace", "sRGB");
        spec.attribute("Compression", "jpeg:95");
        if (!output->open(temporary, spec)) return error(output->geterror());
        if (!output->write_image(OIIO::TypeDesc::UINT8, bytes.data()))
            return error(output->geterror());
        if (!output->close()) return error(output->geterror());
        return {};
    });
}

}  // namespace velatura::image
