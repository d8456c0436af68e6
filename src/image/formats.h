// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::image {

/// Scene-linear RGB, [height][width][3], row 0 = top.
struct RgbImage {
    int width = 0, height = 0;
    std::vector<float> pixels;
};

/// How stored numbers become linear light.
enum class SourceColorSpace : uint8_t {
    Auto,  ///< sRGB for 8-bit and 16-bit integer files without another statement, linear for float
           ///< files
    Raw,   ///< as stored
    Srgb,  ///< sRGB transfer curve
};

/// Limits on what an image may ask of the machine.
struct ReadLimits {
    int max_side = 32768;
    size_t max_pixels = size_t(1) << 28;
};

/// Reads an EXR, HDR, PNG, JPEG, TIFF … image as RGB; gray is copied to the three channels, alpha
/// is dropped. Values that are not finite become 0 and are counted in `not_finite` when it is
/// given. Opens the image library. Errors: "image-open" (missing, not an image, no library),
/// "image-too-large", "image-read".
Result<RgbImage> read_rgb_image(const std::string& path,
                                SourceColorSpace space = SourceColorSpace::Auto,
                                const ReadLimits& limits = {},
                                size_t* not_finite = nullptr);

/// A display-referred value as an image of 8 bits has it: clamped to [0, 1] and rounded; NaN is 0.
inline uint8_t display_byte(float v) {
    const float clamped = v > 0.0f ? std::min(v, 1.0f) : 0.0f;
    return uint8_t(std::lround(double(clamped) * 255));
}

/// A format of display images.
struct DisplayFormat {
    std::string_view extension;  ///< in small letters, with its dot
    std::array<int, 4> bits;     ///< per channel, what it can store, the usual first; 0: no more
    bool has_alpha;
};

inline constexpr std::array<DisplayFormat, 6> display_formats = {{
    {".png", {8, 16}, true},
    {".jpg", {8}, false},
    {".jpeg", {8}, false},
    {".tif", {8, 16}, true},
    {".tiff", {8, 16}, true},
    {".dpx", {10, 8, 12, 16}, false},
}};

/// By the end of a file's name, in capitals or not; nullptr: none of them.
const DisplayFormat* display_format(const std::string& path);

/// A display-referred image.
struct DisplayImage {
    int width = 0, height = 0;
    int channels = 3;           ///< 4: with alpha, which RGB is not multiplied by
    std::vector<float> values;  ///< [height][width][channels], 0 … 1; row 0 = top
    float pixel_aspect = 1;     ///< width of a pixel in its heights
};

struct DisplayStorage {
    int bits = 0;  ///< per channel; 0: the format's usual
    /// Adds noise of one step, the same in each run, before values are rounded: their mean over
    /// pixels stays, and no bands show in soft gradients. Whole steps stay as they are.
    bool has_dither = false;
};

/// Writes an image in the format that the name ends in, under a temporary name and renamed. Values
/// are clamped to [0, 1] and rounded; NaN is 0. Opens the image library. Errors: "io-write".
Result<void> write_display_image(const std::string& path,
                                 const DisplayImage& image,
                                 const DisplayStorage& storage = {});

/// RGB, [height][width][3], at the format's usual bits.
Result<void> write_display_image(const std::string& path,
                                 int width,
                                 int height,
                                 const std::vector<float>& rgb);

}  // namespace velatura::image
