// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "import/context.h"

#include <assimp/material.h>

#include <array>
#include <string>
#include <unordered_map>

namespace velatura::import {

/// One of a material's textures.
struct TextureSlot {
    aiTextureType type = aiTextureType_NONE;
    unsigned index = 0;
};

/// How a texture is read; counts where a slot is used first.
struct TextureUse {
    std::array<float, 4> scale = {1, 1, 1, 1};
    std::array<float, 4> bias = {0, 0, 0, 0};
    const char* color_space = "auto";
};

/// Writes a Material with a UsdPreviewSurface and its textures, one shader for each slot.
class SurfaceAuthor {
  public:
    SurfaceAuthor(Context& ctx, const aiMaterial& material, bool has_vertex_colors);

    Path prim() const { return prim_; }

    const Context& context() const { return ctx_; }

    Format format() const { return ctx_.format; }

    bool has_vertex_colors() const { return has_vertex_colors_; }

    bool has_texture(const TextureSlot& slot) const;

    void constant(const char* input, float value);
    void constant(const char* input, int value);
    void constant(const char* input, const Vec3& value);
    void token(const char* input, const char* value);
    /// Connects an input to an output ("rgb", "r", …) of the slot's texture; takes the place of a
    /// constant.
    void texture(const char* input,
                 const char* type,
                 const char* output,
                 const TextureSlot& slot,
                 const TextureUse& use);
    /// Connects an input to the mesh's displayColor or displayOpacity.
    void vertex_color(const char* input, const Vec3& fallback);
    void vertex_opacity(const char* input, float fallback);
    /// Says that a feature is left out.
    void warn(const std::string& what);

  private:
    Path texture_shader(const TextureSlot& slot, const TextureUse& use);
    Path coordinates(const TextureSlot& slot);
    Path define_shader(const char* name, const char* id);
    void connect(const char* input, const char* type, Path source);
    void author(const char* input, const char* type, Value value);

    Context& ctx_;
    const aiMaterial& material_;
    bool has_vertex_colors_;
    Path prim_, shader_;
    std::unordered_map<std::string, Path> textures_, readers_;
};

}  // namespace velatura::import
