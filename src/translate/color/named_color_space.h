// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/color_decoding.h"

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace velatura::translate::color {

struct ColorSpace {
    scene::ColorDecoding decoding;
    bool is_srgb = false;  ///< the curve is that of sRGB
};

/// A space by one of its names: those of the Color Interop Forum, of OpenUSD and MaterialX, and
/// what configurations of OpenColorIO call the same. Null: the name is unknown.
const ColorSpace* named_color_space(std::string_view name);

/// Small letters and digits alone: "ACES - ACEScg" and "aces_acescg" are one.
std::string bare_color_space_name(std::string_view name);

/// Where red, green, blue and white lie in the chromaticity diagram.
struct Primaries {
    std::array<double, 2> red, green, blue, white;
};

/// ColorDecoding::to_rec709 of numbers in these primaries; nothing when they span no space.
std::optional<std::array<double, 9>> rec709_from(const Primaries& p);

}  // namespace velatura::translate::color
