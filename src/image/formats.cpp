// SPDX-License-Identifier: Apache-2.0
#include "image/formats.h"

#include "base/asset_roots.h"
#include "base/atomic_file.h"
#include "base/hash.h"
#include "image/image_library.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

namespace velatura::image {

namespace {

/// IEC 61966-2-1.
float linear_from_srgb(float v) {
    return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}

bool is_srgb(const ImageInfo& facts, SourceColorSpace space) {
    if (space != SourceColorSpace::Auto) return space == SourceColorSpace::Srgb;
    if (facts.is_floating_point) return false;
    const std::string& stated = facts.color_space;
    return stated.empty() || stated == "sRGB" || stated == "Rec709";
}

/// A file that is missing or may not be read needs no library to say so.
Result<std::unique_ptr<ImageFile>> open_image(const std::string& path) {
    const Result<std::string> admitted = admit_asset(path);
    if (!admitted) return admitted.error();
    const Result<const ImageLibrary*> library = image_library();
    if (!library) return library.error();
    return (*library)->open(*admitted);
}

/// In [0, 1).
double unit_noise(size_t i) {
    return double(mix64(i) >> 11) * 0x1p-53;
}

std::vector<uint16_t> stored_values(const std::vector<float>& values, int bits, bool has_dither) {
    const double max = double((1 << bits) - 1);
    std::vector<uint16_t> stored(values.size());
    for (size_t i = 0; i < values.size(); ++i) {
        const float clamped = values[i] > 0.0f ? std::min(values[i], 1.0f) : 0.0f;
        const double steps = double(clamped) * max;
        // The mean of floor(x + u) over u in [0, 1) is x
        stored[i] = uint16_t(has_dither ? std::floor(steps + unit_noise(i)) : std::round(steps));
    }
    return stored;
}

}  // namespace

Result<RgbImage> read_rgb_image(const std::string& path,
                                SourceColorSpace space,
                                const ReadLimits& limits,
                                size_t* not_finite) {
    const Result<std::unique_ptr<ImageFile>> opened = open_image(path);
    if (!opened) {
        return Error{"image-open",
                     fmt::format("cannot open the image {}: {}", path, opened.error().message)};
    }
    ImageFile& file = **opened;
    const ImageInfo& facts = file.facts();
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
    if (const Result<void> read = file.read(channels, stored); !read) {
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

const DisplayFormat* display_format(const std::string& path) {
    std::string lower = path;
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    const auto* const at =
        std::find_if(display_formats.begin(), display_formats.end(),
                     [&](const DisplayFormat& f) { return lower.ends_with(f.extension); });
    return at == display_formats.end() ? nullptr : at;
}

Result<void> write_display_image(const std::string& path,
                                 const DisplayImage& file,
                                 const DisplayStorage& storage) {
    const auto error = [&path](const std::string& why) {
        return Error{"io-write", fmt::format("cannot write {}: {}", path, why)};
    };
    const DisplayFormat* const format = display_format(path);
    if (!format) return error("its name ends in no known format");
    const int bits = storage.bits == 0 ? format->bits[0] : storage.bits;
    const std::vector<uint16_t> stored = stored_values(file.values, bits, storage.has_dither);
    const Result<const ImageLibrary*> library = image_library();
    if (!library) return error(library.error().message);
    return write_atomically(path, [&](const std::string& temporary) -> Result<void> {
        const Result<void> written = (*library)->write(
            temporary, {file.width, file.height, file.channels, bits, stored, file.pixel_aspect});
        if (!written) return error(written.error().message);
        return {};
    });
}

Result<void> write_display_image(const std::string& path,
                                 int width,
                                 int height,
                                 const std::vector<float>& rgb) {
    return write_display_image(path, {width, height, 3, rgb});
}

}  // namespace velatura::image
