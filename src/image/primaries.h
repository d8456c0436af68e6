// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"

#include <array>
#include <optional>
#include <span>
#include <string_view>

namespace velatura::image {

/// Rows; applied to columns R, G, B.
using ColorMatrix = std::array<double, 9>;

ColorMatrix product(const ColorMatrix& a, const ColorMatrix& b);
/// None where it has none.
std::optional<ColorMatrix> inverse(const ColorMatrix& m);

/// Linear RGB of those primaries → ACES2065-1, the white adapted to that of ACES (Bradford).
/// Returns: none for numbers that are no primaries (collinear, no white, not finite).
/// Ref: SMPTE RP 177 (RGB to XYZ); Lindbloom, "Chromatic Adaptation" (Bradford).
std::optional<ColorMatrix> aces_from_rgb(const Chromaticities& primaries);

/// A linear color space that files and OpenColorIO configs name.
struct StandardSpace {
    std::string_view label;  ///< for people
    Chromaticities primaries;
    /// What it is called, in any case: the colorInteropID first, then names and aliases of the ACES
    /// configs (1.0 to 1.3, CG and studio), of Blender's and of Maya's.
    std::span<const std::string_view> names;
};

/// Rec.709, ACEScg, ACES2065-1, P3-D65, Rec.2020, Adobe RGB, CIE XYZ (D65).
std::span<const StandardSpace> standard_spaces();

/// Null where no known space is called so.
const StandardSpace* standard_space(std::string_view name);

/// The known space whose primaries and white are those to 0.002; null: none.
const StandardSpace* standard_space(const Chromaticities& primaries);

const StandardSpace& linear_rec709();

}  // namespace velatura::image
