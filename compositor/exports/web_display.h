// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/display.h"
#include "image/primaries.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::compositor::exports {

/// A display transform as a page computes it (web/display.js): a matrix and the curve of sRGB where
/// the transform is that, the numbers as they are where it is nothing, else a table.
struct WebDisplay {
    enum class Kind : uint8_t { Raw, Srgb, Lut };
    Kind kind = Kind::Raw;
    image::ColorMatrix matrix = {1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< of Srgb
    /// Of Lut, [blue][green][red][3]: lut_size values along log2(1 + lut_scale · x) from 0 to
    /// lut_max, tetrahedra between them. The code k is −0.5 + 2 k / lut_codes.
    std::vector<uint16_t> lut = {};

    /// In place, [pixels][3]: the numbers of the page.
    void apply(std::vector<float>& rgb) const;
    /// For people.
    std::string text() const;
};

inline constexpr int lut_size = 81, lut_codes = 32767;
inline constexpr float lut_scale = 256, lut_max = 4096;

WebDisplay web_display(const image::DisplayTransform& transform);

}  // namespace velatura::compositor::exports
