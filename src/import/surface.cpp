// SPDX-License-Identifier: Apache-2.0
#include "import/surface.h"

#include <fmt/format.h>

#include <cmath>

namespace velatura::import {

namespace {

namespace layer = usd::layer;

const char* wrap_name(int mode) {
    switch (mode) {
        case aiTextureMapMode_Clamp:
            return "clamp";
        case aiTextureMapMode_Mirror:
            return "mirror";
        case aiTextureMapMode_Decal:
            return "black";
        default:
            return "repeat";
    }
}

/// UsdTransform2d of a texture: scale, then rotation against the clock, then translation.
struct CoordinateTransform {
    Vec2 scale = Vec2(1.0f), translation = Vec2(0.0f);
    float rotation_deg = 0.0f;

    bool is_identity() const {
        return scale == Vec2(1.0f) && translation == Vec2(0.0f) && rotation_deg == 0.0f;
    }
};

/// Assimp keeps KHR_texture_transform about the middle of the image; this undoes its arithmetic and
/// turns the v axis upwards. Ref: KHR_texture_transform; Assimp 5.2, glTF2Importer.
CoordinateTransform gltf_transform(const aiUVTransform& t) {
    const double angle = -double(t.mRotation), c = std::cos(angle), s = std::sin(angle);
    const double sx = double(t.mScaling.x), sy = double(t.mScaling.y);
    const double ox = double(t.mTranslation.x) - 0.5 * sx * (1 - c + s);
    const double oy = 0.5 * sy * (s + c - 1) + 1 - sy - double(t.mTranslation.y);
    CoordinateTransform out;
    out.scale = Vec2(float(sx), float(sy));
    out.rotation_deg = float(angle * 180 / pi_d);
    out.translation = Vec2(float(ox + s * sy), float(1 - oy - c * sy));
    // What stands for nothing must not leave a rounding error
    for (float* v : {&out.translation.x, &out.translation.y})
        if (std::abs(*v) < 1e-6f) *v = 0.0f;
    return out;
}

}  // namespace

SurfaceAuthor::SurfaceAuthor(Context& ctx, const aiMaterial& material, bool has_vertex_colors)
    : ctx_(ctx), material_(material), has_vertex_colors_(has_vertex_colors) {
    prim_ = ctx.author.define(ctx.materials_scope, material.GetName().C_Str(), "Material");
    shader_ = define_shader("Surface", "UsdPreviewSurface");
    const Path output = ctx.author.declare(shader_, "outputs:surface", "token");
    ctx.author.connect(prim_, "outputs:surface", "token", output);
}

bool SurfaceAuthor::has_texture(const TextureSlot& slot) const {
    return material_.GetTextureCount(slot.type) > slot.index;
}

Path SurfaceAuthor::define_shader(const char* name, const char* id) {
    const Path shader = ctx_.author.define(prim_, name, "Shader");
    ctx_.author.uniform_token(shader, "info:id", id);
    return shader;
}

void SurfaceAuthor::author(const char* input, const char* type, Value value) {
    ctx_.author.attribute(shader_, std::string("inputs:") + input, type, std::move(value));
}

void SurfaceAuthor::constant(const char* input, float value) {
    author(input, "float", Value(value));
}

void SurfaceAuthor::constant(const char* input, int value) {
    author(input, "int", Value(value));
}

void SurfaceAuthor::constant(const char* input, const Vec3& value) {
    author(input, "color3f", Value(layer::Vec3f(value)));
}

void SurfaceAuthor::token(const char* input, const char* value) {
    author(input, "token", Value(layer::Token(value)));
}

void SurfaceAuthor::connect(const char* input, const char* type, Path source) {
    ctx_.author.connect(shader_, std::string("inputs:") + input, type, source);
}

void SurfaceAuthor::texture(const char* input,
                            const char* type,
                            const char* output,
                            const TextureSlot& slot,
                            const TextureUse& use) {
    const Path shader = texture_shader(slot, use);
    if (shader.is_empty()) return;
    const bool is_color = std::string_view(output) == "rgb";
    connect(input, type,
            ctx_.author.declare(shader, std::string("outputs:") + output,
                                is_color ? "float3" : "float"));
}

Path SurfaceAuthor::texture_shader(const TextureSlot& slot, const TextureUse& use) {
    const std::string key = fmt::format("{} {}", int(slot.type), slot.index);
    const auto found = textures_.find(key);
    if (found != textures_.end()) return found->second;
    aiString name;
    material_.GetTexture(slot.type, slot.index, &name);
    const std::string asset = texture_asset(ctx_, name.C_Str(), material_.GetName().C_Str());
    if (asset.empty()) return textures_[key] = Path();
    const Path shader = define_shader("Texture", "UsdUVTexture");
    LayerAuthor& author = ctx_.author;
    author.attribute(shader, "inputs:file", "asset", Value(layer::AssetPath{asset}));
    author.token(shader, "inputs:sourceColorSpace", use.color_space);
    int wrap_s = aiTextureMapMode_Wrap, wrap_t = aiTextureMapMode_Wrap;
    material_.Get(AI_MATKEY_MAPPINGMODE_U(slot.type, slot.index), wrap_s);
    material_.Get(AI_MATKEY_MAPPINGMODE_V(slot.type, slot.index), wrap_t);
    author.token(shader, "inputs:wrapS", wrap_name(wrap_s));
    author.token(shader, "inputs:wrapT", wrap_name(wrap_t));
    const auto four = [](const std::array<float, 4>& v) {
        return Value(layer::Vec4f(v[0], v[1], v[2], v[3]));
    };
    if (use.scale != std::array<float, 4>{1, 1, 1, 1})
        author.attribute(shader, "inputs:scale", "float4", four(use.scale));
    if (use.bias != std::array<float, 4>{0, 0, 0, 0})
        author.attribute(shader, "inputs:bias", "float4", four(use.bias));
    author.connect(shader, "inputs:st", "float2", coordinates(slot));
    return textures_[key] = shader;
}

Path SurfaceAuthor::coordinates(const TextureSlot& slot) {
    int set = 0;
    material_.Get(AI_MATKEY_UVWSRC(slot.type, slot.index), set);
    const std::string primvar = set > 0 ? fmt::format("st{}", set) : "st";
    LayerAuthor& author = ctx_.author;
    Path& reader = readers_[primvar];
    if (reader.is_empty()) {
        const Path shader = define_shader("Coordinates", "UsdPrimvarReader_float2");
        author.attribute(shader, "inputs:varname", "string", Value(primvar));
        reader = author.declare(shader, "outputs:result", "float2");
    }
    aiUVTransform uv;
    if (material_.Get(AI_MATKEY_UVTRANSFORM(slot.type, slot.index), uv) != aiReturn_SUCCESS)
        return reader;
    CoordinateTransform transform;
    if (ctx_.format == Format::Gltf) {
        transform = gltf_transform(uv);
    } else {
        transform.scale = Vec2(float(uv.mScaling.x), float(uv.mScaling.y));
        transform.translation = Vec2(float(uv.mTranslation.x), float(uv.mTranslation.y));
        if (uv.mRotation != 0) warn("the rotation of a texture");
    }
    if (transform.is_identity()) return reader;
    const Path shader = define_shader("Transform", "UsdTransform2d");
    author.connect(shader, "inputs:in", "float2", reader);
    author.attribute(shader, "inputs:scale", "float2", Value(layer::Vec2f(transform.scale)));
    author.attribute(shader, "inputs:rotation", "float", Value(transform.rotation_deg));
    author.attribute(shader, "inputs:translation", "float2",
                     Value(layer::Vec2f(transform.translation)));
    return author.declare(shader, "outputs:result", "float2");
}

void SurfaceAuthor::vertex_color(const char* input, const Vec3& fallback) {
    const Path shader = define_shader("VertexColor", "UsdPrimvarReader_float3");
    ctx_.author.attribute(shader, "inputs:varname", "string", Value(std::string("displayColor")));
    ctx_.author.attribute(shader, "inputs:fallback", "float3", Value(layer::Vec3f(fallback)));
    connect(input, "color3f", ctx_.author.declare(shader, "outputs:result", "float3"));
}

void SurfaceAuthor::vertex_opacity(const char* input, float fallback) {
    const Path shader = define_shader("VertexOpacity", "UsdPrimvarReader_float");
    ctx_.author.attribute(shader, "inputs:varname", "string", Value(std::string("displayOpacity")));
    ctx_.author.attribute(shader, "inputs:fallback", "float", Value(fallback));
    connect(input, "float", ctx_.author.declare(shader, "outputs:result", "float"));
}

void SurfaceAuthor::warn(const std::string& what) {
    ctx_.warn("import-material",
              fmt::format("material \"{}\": {} is not imported", material_.GetName().C_Str(), what),
              prim_.to_string());
}

}  // namespace velatura::import
