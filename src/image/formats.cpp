// SPDX-License-Identifier: Apache-2.0
#include "image/formats.h"

#include "base/asset_roots.h"
#include "base/atomic_file.h"
#include "image/picture_library.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::image {

namespace {

/// IEC 61966-2-1.
float linear_from_srgb(float v) {
    return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}

bool is_srgb(const PictureFacts& facts, SourceColorSpace space) {
    if (space != SourceColorSpace::Auto) return space == SourceColorSpace::Srgb;
    if (facts.is_floating_point) return false;
    const std::string& stated = facts.color_space;
    return stated.empty() || stated == "sRGB" || stated == "Rec709";
}

/// A file that is missing or may not be read needs no library to say so.
Result<std::unique_ptr<Picture>> open_picture(const std::string& path) {
    const Result<std::string> admitted = admit_asset(path);
    if (!admitted) return admitted.error();
    const Result<const PictureLibrary*> library = picture_library();
    if (!library) return library.error();
    return (*library)->open(*admitted);
}

}  // namespace

Result<RgbImage> read_rgb_image(const std::string& path,
                                SourceColorSpace space,
                                const ReadLimits& limits,
                                size_t* not_finite) {
    const Result<std::unique_ptr<Picture>> opened = open_picture(path);
    if (!opened) {
        return Error{"image-open",
                     fmt::format("cannot open the image {}: {}", path, opened.error().message)};
    }
    Picture& picture = **opened;
    const PictureFacts& facts = picture.facts();
    if (facts.width <= 0 || facts.height <= 0 || facts.channels <= 0) {
        return Error{"image-open", fmt::format("cannot open the image {}: it has no pixels", path)};
    }
    if (facts.width > limits.max_side || facts.height > limits.max_side ||
        size_t(facts.width) * size_t(facts.height) > limits.max_pixels) {
        return Error{
            "image-too-large",
            fmt::format("the image {} has {}×{} pixels, the limit is {} a side and {} together",
                        path, facts.width, facts.height, limits.max_side, limits.max_pixels)};
    }
    const int channels = facts.channels >= 3 ? 3 : 1;
    std::vector<float> stored(size_t(facts.width) * size_t(facts.height) * size_t(channels));
    if (const Result<void> read = picture.read(channels, stored); !read) {
        return Error{"image-read",
                     fmt::format("cannot read the image {}: {}", path, read.error().message)};
    }

    RgbImage image;
    image.width = facts.width;
    image.height = facts.height;
    image.pixels.resize(3 * size_t(facts.width) * size_t(facts.height));
    const bool decode = is_srgb(facts, space);
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
                                 const std::vector<float>& rgb,
                                 float pixel_aspect) {
    std::vector<uint8_t> bytes(rgb.size());
    std::transform(rgb.begin(), rgb.end(), bytes.begin(), display_byte);
    const auto error = [&path](const std::string& why) {
        return Error{"io-write", fmt::format("cannot write {}: {}", path, why)};
    };
    const Result<const PictureLibrary*> library = picture_library();
    if (!library) return error(library.error().message);
    return write_atomically(path, [&](const std::string& temporary) -> Result<void> {
        const Result<void> written =
            (*library)->write(temporary, width, height, bytes, pixel_aspect);
        if (!written) return error(written.error().message);
        return {};
    });
}

}  // namespace velatura::image
