// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
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

/// Limits on what a picture may ask of the machine.
struct ReadLimits {
    int max_side = 32768;
    size_t max_pixels = size_t(1) << 28;
};

/// Reads an EXR, HDR, PNG, JPEG, TIFF … picture as RGB; grey is copied to the three channels, alpha
/// is dropped. Values that are not finite become 0 and are counted in `not_finite` when it is
/// given. Opens the picture library. Errors: "image-open" (missing, not an image, no library),
/// "image-too-large", "image-read".
Result<RgbImage> read_rgb_image(const std::string& path,
                                SourceColorSpace space = SourceColorSpace::Auto,
                                const ReadLimits& limits = {},
                                size_t* not_finite = nullptr);

/// A display-referred value as a picture of 8 bits has it: clamped to [0, 1] and rounded; NaN is 0.
inline uint8_t display_byte(float v) {
    const float clamped = v > 0.0f ? std::min(v, 1.0f) : 0.0f;
    return uint8_t(std::lround(clamped * 255.0f));
}

/// Writes display-referred RGB (display_byte), [height][width][3], as .png or .jpg, under a
/// temporary name and renamed. `pixel_aspect` is the width of a pixel in its heights. Opens the
/// picture library. Errors: "io-write".
Result<void> write_display_image(const std::string& path,
                                 int width,
                                 int height,
                                 const std::vector<float>& rgb,
                                 float pixel_aspect = 1.0f);

}  // namespace velatura::image
