// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/texture.h"
#include "translate/color/named_color_space.h"
#include "translate/context/context.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::translate::color {

/// The door of colors: what a scene says in whatever space becomes numbers of the working space,
/// which is linear Rec.709 unless another is asked for, here and nowhere else. The space of an
/// attribute is the one of its own `colorSpace` metadata, else that of the nearest prim with
/// ColorSpaceAPI, which may name one that a ColorSpaceDefinitionAPI defines. Ref: UsdColorSpaceAPI.

/// What numbers are to the renderer. Numbers that are no colors, such as a roughness, a radius or a
/// normal, do not depend on the working space.
enum class Meaning : uint8_t {
    ByType,  ///< a color where the type of the attribute or its metadata says so
    Color,
    Number
};

/// Whether the type of the attribute says that it holds colors.
bool is_color(const Attribute& attribute);

/// Hears what is wrong with the space of an attribute: a code and a message.
using ColorWarning =
    std::function<void(std::string code, const Attribute& where, std::string message)>;

/// Space that the numbers of an attribute are in; nothing: linear Rec.709, no one says otherwise.
std::optional<ColorSpace> color_space_of(const Attribute& attribute,
                                         const ColorWarning& warn_color);

/// As read_rows, of colors.
bool read_color_rows(Context& ctx,
                     const Attribute& attribute,
                     std::vector<float>& rows,
                     int& width,
                     Meaning meaning = Meaning::ByType);
/// As read_vector of width 3, of a color.
std::optional<Vec3d> read_color(Context& ctx,
                                const Attribute& attribute,
                                Meaning meaning = Meaning::Color);
/// The same of light, which is clipped with a warning where the working space would need less than
/// none.
std::optional<Vec3d> read_light_color(Context& ctx, const Attribute& attribute);

/// How the texels of a file are decoded by a space that `prim` names for them; nothing: unknown.
std::optional<scene::TexelColors> texel_colors_of(Context& ctx,
                                                  Prim prim,
                                                  std::string_view space,
                                                  Meaning meaning);
/// The same by what is authored on the attributes that hold the file's name, the nearest first, and
/// the prims above the nearest; nothing: no space is named.
std::optional<scene::TexelColors> texel_colors_of(Context& ctx,
                                                  const std::vector<Attribute>& files,
                                                  Meaning meaning);
/// Of a file of which nothing is said: linear Rec.709 under its curve, if it holds colors.
scene::TexelColors unmarked_texels(Context& ctx, scene::SourceColorSpace curve, Meaning meaning);

/// A color of the renderer's own, in linear Rec.709, as one of the working space.
Vec3d from_rec709(Context& ctx, const Vec3d& color);
/// blackbody_rgb() in the working space.
Vec3d blackbody_color(Context& ctx, double kelvin);

/// Says that a configuration of colors is not read, if the stage names one.
void note_color_configuration(Context& ctx);

}  // namespace velatura::translate::color
