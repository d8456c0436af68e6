// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/material.h"
#include "translate/color/color_space.h"
#include "translate/context/context.h"
#include "translate/materials/materials.h"

#include <optional>
#include <string>
#include <string_view>

namespace velatura::translate::materials {

/// Where a connection leads, through NodeGraphs and material interfaces: a shader's output, or an
/// attribute with a value.
struct ShaderSource {
    Prim shader;         ///< invalid: the value of `value` counts
    std::string output;  ///< "rgb", "r", "result", …
    Attribute value;
};

/// Follows the first connection of an attribute to its end; an attribute without connections is its
/// own end. An end without a value leaves the last value on the way. Warns about cycles and targets
/// that are not there.
ShaderSource shader_source(Context& ctx, const Attribute& attribute);
/// The same without a word.
ShaderSource shader_source(const usd::stage::Stage& stage, const Attribute& attribute);

/// Whether the input has a value or a connection. name: without "inputs:".
bool has_input(Prim shader, std::string_view name);

/// Reads inputs of one shader as scene inputs, translating textures and noting primvars on the way.
struct InputReader {
    Context& ctx;
    Prim shader;
    MaterialEntry& entry;

    scene::Input number(std::string_view name, float fallback);
    scene::Input color(std::string_view name, const Rgb& fallback);
    /// Three numbers that are no color.
    scene::Input vector(std::string_view name, const Rgb& fallback);
    /// Value of an input that cannot be textured here; a warning when it is.
    double constant_number(std::string_view name, double fallback);
    std::string constant_text(std::string_view name, std::string_view fallback);

  private:
    scene::Input read(std::string_view name,
                      const scene::Input& fallback,
                      int width,
                      color::Meaning meaning);
};

/// Material of a VelaturaHair shader.
scene::Material read_hair(Context& ctx, Prim shader, MaterialEntry& entry);

/// Texture of a UsdUVTexture shader, one per shader prim and meaning of its texels.
scene::TextureId read_texture(Context& ctx,
                              Prim shader,
                              MaterialEntry& entry,
                              color::Meaning meaning);

/// What a UsdUVTexture says of its file: all but the coordinates.
scene::Texture read_texture_file(Context& ctx,
                                 Prim shader,
                                 MaterialEntry& entry,
                                 color::Meaning meaning);

/// A wrap mode by its name in USD or MaterialX; nothing: unknown.
std::optional<scene::Wrap> named_wrap(std::string_view name);

/// Whether the reader says what to give where the primvar is missing.
bool has_fallback(Prim reader);

/// Name that a UsdPrimvarReader reads; empty with a warning when it has none.
std::string primvar_name(Context& ctx, Prim reader);

/// Names a prim that its material would displace if it were a mesh.
void warn_if_displaced(Context& ctx, Prim prim, const MaterialEntry& material);

}  // namespace velatura::translate::materials
