// SPDX-License-Identifier: Apache-2.0
#include "translate/color/color_space.h"
#include "translate/context/values.h"
#include "translate/materials/materials.h"
#include "translate/materials/pattern_builder.h"
#include "translate/materials/shader_inputs.h"

#include <fmt/format.h>

#include <map>
#include <utility>

namespace velatura::translate::materials {

namespace {

/// State of this module: Scene::textures, by the path of their shader.
struct KnownTextures {
    std::map<std::pair<std::string, color::Meaning>, scene::TextureId> by_shader;
    std::unordered_set<scene::TextureId> need_coordinates;  ///< whose `st` has no fallback
};

Attribute input_value(Context& ctx, Prim shader, const std::string& name) {
    const Attribute attribute = shader.attribute("inputs:" + name);
    const ShaderSource source = shader_source(ctx, attribute);
    if (!source.shader) return source.value;
    ctx.warn("unsupported-connection", attribute,
             fmt::format("{} must be a constant here; its connection is ignored", name));
    return Attribute();
}

std::string input_text(Context& ctx, Prim shader, const char* name, const char* fallback) {
    const Attribute attribute = input_value(ctx, shader, name);
    return attribute.is_valid() ? read_text(attribute, fallback, ctx.time) : fallback;
}

void input_floats(Context& ctx, Prim shader, const char* name, std::array<float, 4>& out) {
    const Attribute attribute = input_value(ctx, shader, name);
    if (!attribute.is_valid()) return;
    std::vector<float> rows;
    int width = 0;
    if (!read_rows(attribute.value(ctx.time), rows, width)) return;
    for (size_t i = 0; i < rows.size() && i < 4; ++i) out[i] = rows[i];
}

scene::Wrap wrap_mode(Context& ctx, Prim shader, const char* name) {
    const std::string text = input_text(ctx, shader, name, "useMetadata");
    if (const auto wrap = named_wrap(text)) return *wrap;
    ctx.warn("unknown-wrap-mode", shader.attribute(std::string("inputs:") + name),
             fmt::format("{} {} is unknown, useMetadata is used", name, text));
    return scene::Wrap::UseMetadata;
}

/// What sourceColorSpace names, else what is said of the file, else auto.
scene::TexelColors texture_colors(Context& ctx, Prim shader, color::Meaning meaning) {
    const std::string text = input_text(ctx, shader, "sourceColorSpace", "auto");
    if (text != "auto") {
        if (const auto named = color::texel_colors_of(ctx, shader, text, meaning)) return *named;
        ctx.warn("unknown-color-space", shader.attribute("inputs:sourceColorSpace"),
                 fmt::format("source color space {} is unknown, auto is used", text));
    }
    const Attribute own = shader.attribute("inputs:file");
    return color::texel_colors_of(ctx, {own, shader_source(ctx, own).value}, meaning)
        .value_or(color::unmarked_texels(ctx, scene::SourceColorSpace::Auto, meaning));
}

/// The fallback of a color, which UsdUVTexture holds as four floats.
void convert_fallback(Context& ctx, color::Meaning meaning, std::array<float, 4>& fallback) {
    if (meaning == color::Meaning::Number || ctx.state<color::WorkingSpace>().is_rec709()) return;
    const Vec3d rgb = color::from_rec709(
        ctx, Vec3d(double(fallback[0]), double(fallback[1]), double(fallback[2])));
    for (size_t c = 0; c < 3; ++c) fallback[c] = float(rgb[int(c)]);
}

/// The fallback, and the primvar of a reader that it is connected to.
void read_fallback(Context& ctx, Prim shader, MaterialEntry& entry, scene::Texture& texture) {
    const Attribute attribute = shader.attribute("inputs:fallback");
    const ShaderSource source = shader_source(ctx, attribute);
    if (!source.shader) return input_floats(ctx, shader, "fallback", texture.fallback);
    const std::string id = read_text(source.shader.attribute("info:id"), "", ctx.time);
    if (id.find("UsdPrimvarReader_") == std::string::npos) {
        ctx.warn("unsupported-connection", attribute,
                 fmt::format("fallback comes from a node of type {}, expected a primvar reader; "
                             "its connection is ignored",
                             id.empty() ? "unknown" : id));
        return;
    }
    input_floats(ctx, source.shader, "fallback", texture.fallback);
    const std::string name = primvar_name(ctx, source.shader);
    if (name.empty()) return;
    texture.fallback_primvar = scene::intern_primvar(ctx.scene, name);
    entry.primvars.push_back(name);
}

/// Scale, then counter-clockwise rotation, then translation.
Map2 read_transform_2d(Context& ctx, Prim shader) {
    const auto vec2 = [&](const char* name, double fallback) {
        std::array<double, 2> out = {fallback, fallback};
        const Attribute attribute = input_value(ctx, shader, name);
        if (!attribute.is_valid()) return out;
        if (const auto v = read_vector(attribute, 2, ctx.time)) out = {(*v)[0], (*v)[1]};
        return out;
    };
    const std::array<double, 2> scale = vec2("scale", 1.0), offset = vec2("translation", 0.0);
    const Attribute rotation = input_value(ctx, shader, "rotation");
    const double degrees = rotation.is_valid() ? read_number(rotation, 0.0, ctx.time) : 0.0;
    const Map2 turn = rotation_map(degrees);
    return {scale[0] * turn.a, scale[0] * turn.b, scale[1] * turn.c,
            scale[1] * turn.d, offset[0],         offset[1]};
}

/// Where the texture is looked up: follows `inputs:st` through UsdTransform2d nodes to a primvar or
/// a constant.
void read_coordinates(
    Context& ctx, Prim shader, MaterialEntry& entry, scene::TextureId id, scene::Texture& texture) {
    Map2 map;
    Attribute attribute = shader.attribute("inputs:st");
    if (!attribute.has_authored_connections() && !attribute.has_authored_value())
        ctx.note("no-texture-coordinates", shader,
                 "inputs:st is not connected, the texture is read at (0, 0)");
    constexpr int deepest = 64;
    for (int depth = 0; depth < deepest; ++depth) {
        const ShaderSource source = shader_source(ctx, attribute);
        if (!source.shader) {
            if (const auto st = read_vector(source.value, 2, ctx.time))
                texture.st_constant = Vec2(float((*st)[0]), float((*st)[1]));
            break;
        }
        const std::string node = read_text(source.shader.attribute("info:id"), "", ctx.time);
        if (node == "UsdTransform2d") {
            map = read_transform_2d(ctx, source.shader).then(map);
            attribute = source.shader.attribute("inputs:in");
            continue;
        }
        if (node == "UsdPrimvarReader_float2") {
            const Attribute fallback = input_value(ctx, source.shader, "fallback");
            if (const auto st = read_vector(fallback, 2, ctx.time))
                texture.st_constant = Vec2(float((*st)[0]), float((*st)[1]));
            const std::string name = primvar_name(ctx, source.shader);
            if (name.empty()) break;
            texture.st = scene::intern_primvar(ctx.scene, name);
            entry.primvars.push_back(name);
            if (!has_fallback(source.shader))
                ctx.state<KnownTextures>().need_coordinates.insert(id);
            break;
        }
        ctx.warn("unsupported-shader", source.shader,
                 fmt::format("shader node {} is not supported for texture coordinates, the texture "
                             "is read at (0, 0)",
                             node.empty() ? "without info:id" : node));
        break;
    }
    texture.st_matrix = {float(map.a), float(map.b), float(map.c), float(map.d)};
    texture.st_offset = Vec2(float(map.x), float(map.y));
}

}  // namespace

scene::TextureId read_texture(Context& ctx,
                              Prim shader,
                              MaterialEntry& entry,
                              color::Meaning meaning) {
    // In linear Rec.709 a color and three numbers are read alike
    if (ctx.state<color::WorkingSpace>().is_rec709()) meaning = color::Meaning::Number;
    const auto [it, is_new] = ctx.state<KnownTextures>().by_shader.try_emplace(
        {shader.path_string(), meaning}, scene::TextureId(ctx.scene.textures.size()));
    const scene::TextureId id = it->second;
    if (!is_new) {
        // Another material that shares the node reads the same primvar
        const scene::PrimvarId otherwise = ctx.scene.textures[id].fallback_primvar;
        if (otherwise != scene::none) entry.primvars.push_back(ctx.scene.primvar_names[otherwise]);
        const scene::PrimvarId st = ctx.scene.textures[id].st;
        if (st == scene::none) return id;
        entry.primvars.push_back(ctx.scene.primvar_names[st]);
        if (ctx.state<KnownTextures>().need_coordinates.contains(id))
            entry.needed.push_back(entry.primvars.back());
        return id;
    }
    scene::Texture texture = read_texture_file(ctx, shader, entry, meaning);
    read_coordinates(ctx, shader, entry, id, texture);
    if (ctx.state<KnownTextures>().need_coordinates.contains(id))
        entry.needed.push_back(ctx.scene.primvar_names[texture.st]);
    ctx.scene.textures.push_back(std::move(texture));
    return id;
}

scene::Texture read_texture_file(Context& ctx,
                                 Prim shader,
                                 MaterialEntry& entry,
                                 color::Meaning meaning) {
    scene::Texture texture;
    texture.provenance = ctx.provenance(shader);
    const Attribute file = input_value(ctx, shader, "file");
    if (file.is_valid()) {
        texture.authored = read_text(file, "", ctx.time);
        texture.file = file.resolved_asset_path(ctx.time);
    }
    if (texture.authored.empty())
        ctx.warn("no-texture-file", shader, "texture has no file; its fallback is used");
    texture.wrap_s = wrap_mode(ctx, shader, "wrapS");
    texture.wrap_t = wrap_mode(ctx, shader, "wrapT");
    texture.colors = texture_colors(ctx, shader, meaning);
    input_floats(ctx, shader, "scale", texture.scale);
    input_floats(ctx, shader, "bias", texture.bias);
    read_fallback(ctx, shader, entry, texture);
    convert_fallback(ctx, meaning, texture.fallback);
    return texture;
}

std::optional<scene::Wrap> named_wrap(std::string_view name) {
    // Those of USD, then what MaterialX calls the same
    if (name == "useMetadata") return scene::Wrap::UseMetadata;
    if (name == "black" || name == "constant") return scene::Wrap::Black;
    if (name == "clamp") return scene::Wrap::Clamp;
    if (name == "repeat" || name == "periodic") return scene::Wrap::Repeat;
    if (name == "mirror") return scene::Wrap::Mirror;
    return std::nullopt;
}

}  // namespace velatura::translate::materials
