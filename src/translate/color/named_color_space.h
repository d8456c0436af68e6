// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/color_decoding.h"

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace velatura::translate::color {

/// Row by row, of column vectors.
using ColorMatrix = std::array<double, 9>;

/// XYZ (white D65) of linear Rec.709.
const ColorMatrix& d65_from_rec709();

struct ColorSpace {
    scene::ColorDecoding decoding;  ///< into linear Rec.709
    bool is_srgb = false;           ///< the curve is that of sRGB
    bool is_data = false;           ///< numbers that no working space changes: `raw`, `data`
    /// XYZ of what the numbers are without their curve, adapted to D65.
    ColorMatrix d65_from_rgb = d65_from_rec709();
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

/// A linear space of these primaries; nothing when they span none.
std::optional<ColorSpace> linear_space_of(const Primaries& p);

/// The linear RGB space that a scene is rendered in; linear Rec.709 unless another is asked for.
class WorkingSpace {
  public:
    WorkingSpace() = default;

    /// By a name of named_color_space(). Nothing: unknown, not linear, or without red, green and
    /// blue.
    static std::optional<WorkingSpace> named(std::string_view name);
    /// Names to choose from, for messages.
    static std::string choices();

    std::string_view id() const { return id_; }  ///< that of the Color Interop Forum

    std::string_view label() const { return label_; }

    bool is_rec709() const { return id_ == rec709_id; }

    /// What makes numbers of a space numbers of this one: the identity for its own.
    scene::ColorDecoding from(const ColorSpace& space) const;

    Vec3d from_rec709(const Vec3d& color) const { return from(ColorSpace())(color); }

  private:
    static constexpr std::string_view rec709_id = "lin_rec709_scene";
    std::string_view id_ = rec709_id, label_ = "linear Rec.709";
    ColorMatrix d65_from_rgb_ = d65_from_rec709();
};

}  // namespace velatura::translate::color
