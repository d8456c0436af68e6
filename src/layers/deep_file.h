// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/image.h"
#include "image/window.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::layers {

/// What a pixel shows at a depth, or between two; light premultiplied, without what lies before it.
struct DeepSample {
    float z = 0, z_back = 0;  ///< along the camera's view direction, scene units; equal: a surface
    float a = 0;
    float r = 0, g = 0, b = 0;

    bool operator==(const DeepSample&) const = default;
};

/// A deep image: pixel after pixel, row 0 = top, each pixel's samples from front to back.
struct DeepImage {
    image::Window data, display;
    float pixel_aspect_ratio = 1.0f;
    image::Attributes attributes;
    std::vector<uint32_t> counts;  ///< [height][width]
    std::vector<DeepSample> samples;
};

/// Writes deep scanlines with channels Z ZBack A R G B, all float, ZIPS, under a temporary name;
/// reads them back, compares, and renames. Errors: "io-write", "verify-failed".
Result<void> write_deep_file(const std::string& path, const DeepImage& image);

/// Reads what write_deep_file() wrote: a single part. A missing ZBack is Z. Errors: "io-open" (no
/// file of deep scanlines, or without Z A R G B as floats), "io-read".
Result<DeepImage> read_deep_file(const std::string& path);

/// Whether a file holds a deep image; false where it cannot be read.
bool is_deep_file(const std::string& path);

}  // namespace velatura::layers
