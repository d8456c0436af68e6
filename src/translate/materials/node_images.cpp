// SPDX-License-Identifier: Apache-2.0
// Nodes that read images, and the colors in them.
#include "translate/color/color_space.h"
#include "translate/context/values.h"
#include "translate/materials/node_graph.h"
#include "translate/materials/pattern_builder.h"
#include "translate/materials/shader_inputs.h"

#include <fmt/format.h>

#include <optional>

namespace velatura::translate::materials {

namespace {

using scene::PatternOp;
using scene::PatternValue;

scene::Wrap address_mode(const GraphNode& node, const char* name) {
    const std::string text = node.graph.constant_text(node.prim, name, "periodic");
    if (const auto wrap = named_wrap(text)) return *wrap;
    node.graph.ctx.warn("unknown-wrap-mode", node.prim,
                        fmt::format("{} {} is unknown, periodic is used", name, text));
    return scene::Wrap::Repeat;
}

/// MaterialX has what an image without a file gives also around one that is there.
void warn_border(const GraphNode& node, const scene::Texture& texture) {
    const bool has_border =
        texture.wrap_s == scene::Wrap::Black || texture.wrap_t == scene::Wrap::Black;
    const auto& d = texture.fallback;
    if (has_border && (d[0] != 0.0f || d[1] != 0.0f || d[2] != 0.0f))
        node.graph.ctx.warn("unsupported-input", node.prim,
                            "the image is black beyond its borders; the default value is used for "
                            "missing files only");
}

void warn_features(const GraphNode& node, const scene::Texture& texture) {
    Context& ctx = node.graph.ctx;
    const std::string filter = node.graph.constant_text(node.prim, "filtertype", "linear");
    if (filter != "linear")
        ctx.warn("unsupported-filter", node.prim,
                 fmt::format("filtertype {} is not supported, linear is used", filter));
    for (const char* name : {"layer", "framerange"}) {
        if (!node.graph.constant_text(node.prim, name, "").empty())
            ctx.warn("unsupported-input", node.prim,
                     fmt::format("inputs:{} is not supported; it is ignored", name));
    }
    warn_border(node, texture);
}

/// The name of the file; gives the space of its texels, if one is named.
std::optional<scene::TexelColors> read_file(const GraphNode& node,
                                            color::Meaning meaning,
                                            scene::Texture& texture) {
    Context& ctx = node.graph.ctx;
    texture.provenance = ctx.provenance(node.prim);
    const Attribute own = node.prim.attribute("inputs:file");
    const ShaderSource source = shader_source(ctx, own);
    if (!source.shader && source.value.is_valid()) {
        texture.authored = read_text(source.value, "", ctx.time);
        texture.file = source.value.resolved_asset_path(ctx.time);
    }
    // The node's own mark is nearer than that of the interface which hands the file in
    return color::texel_colors_of(ctx, {own, source.value}, meaning);
}

/// The file of an image node and how it is read, but for the coordinates.
scene::Texture image_file(const GraphNode& node) {
    Context& ctx = node.graph.ctx;
    scene::Texture texture;
    // Without a mark the numbers are taken as they are; only colors have a space at all
    const bool is_color = !node.name.types.empty() && node.name.types[0].starts_with("color");
    const color::Meaning meaning = is_color ? node.graph.meaning() : color::Meaning::Number;
    const auto colors = read_file(node, meaning, texture);
    if (texture.authored.empty())
        ctx.warn("no-texture-file", node.prim, "image has no file; its default is used");
    texture.colors = color::unmarked_texels(ctx, scene::SourceColorSpace::Raw, meaning);
    if (is_color && colors) texture.colors = *colors;
    texture.wrap_s = address_mode(node, "uaddressmode");
    texture.wrap_t = address_mode(node, "vaddressmode");
    const Port otherwise = node.in("default", 0.0f);
    if (const PatternValue* v = node.builder().constant_value(otherwise)) {
        texture.fallback = {v->x, v->y, v->z, otherwise.width == 4 ? v->w : 1.0f};
    } else {
        ctx.warn("unsupported-connection", node.prim,
                 "inputs:default must be a constant here; its connection is ignored");
    }
    return texture;
}

/// The same of a UsdUVTexture of MaterialX, whose defaults are not those of USD. Ref:
/// ND_UsdUVTexture in usd_preview_surface.mtlx.
scene::Texture uv_texture_file(const GraphNode& node) {
    Context& ctx = node.graph.ctx;
    scene::Texture texture =
        read_texture_file(ctx, node.prim, node.graph.entry, node.graph.meaning());
    if (!node.graph.is_authored(node.prim, "wrapS")) texture.wrap_s = scene::Wrap::Repeat;
    if (!node.graph.is_authored(node.prim, "wrapT")) texture.wrap_t = scene::Wrap::Repeat;
    // Its image has no guess at a space: what names none is taken as it is
    if (!node.graph.is_authored(node.prim, "sourceColorSpace") &&
        texture.colors.curve == scene::SourceColorSpace::Auto)
        texture.colors.curve = scene::SourceColorSpace::Raw;
    return texture;
}

/// Puts the texture where the coordinates say. Returns: its RGBA.
Port placed(const GraphNode& node, scene::Texture texture, Port coordinates) {
    PatternBuilder& b = node.builder();
    std::vector<scene::Texture>& textures = node.graph.ctx.scene.textures;
    const scene::TextureId id = scene::TextureId(textures.size());
    const auto affine = b.affine(coordinates);
    const PatternValue* at = b.constant_value(coordinates);
    if (affine) {
        const Map2& m = affine->map;
        texture.st = affine->st;
        texture.st_constant = affine->fallback;
        texture.st_matrix = {float(m.a), float(m.b), float(m.c), float(m.d)};
        texture.st_offset = Vec2(float(m.x), float(m.y));
    } else if (at != nullptr) {
        texture.st_constant = Vec2(at->x, at->y);
    }
    textures.push_back(std::move(texture));
    return affine || at != nullptr ? b.texture(id) : b.texture_at(id, coordinates);
}

/// As many channels of a texel as the node has.
Port channels_of(const GraphNode& node, Port texel) {
    if (node.width() == 1) return node.builder().channel(texel, 0);
    return {texel.step, uint8_t(node.width())};
}

Port image_at(const GraphNode& node, Port coordinates) {
    const scene::Texture texture = image_file(node);
    warn_features(node, texture);
    return channels_of(node, placed(node, texture, coordinates));
}

/// What an input of texture coordinates reads; UV0 where it is not authored.
Port coordinates_of(const GraphNode& node, const char* name = "texcoord") {
    if (!node.graph.is_authored(node.prim, name)) return node.graph.texture_coordinates(0);
    return node.in(name, node.builder().constant(PatternValue(0.0f), 2));
}

}  // namespace

Port make_image(const GraphNode& node) {
    return image_at(node, coordinates_of(node));
}

Port make_tiled_image(const GraphNode& node) {
    PatternBuilder& b = node.builder();
    const auto pair = [&](const char* name, float v) {
        return node.in(name, b.constant(PatternValue(v), 2));
    };
    const Port tiled = b.subtract(b.multiply(coordinates_of(node), pair("uvtiling", 1.0f)),
                                  pair("uvoffset", 0.0f));
    return image_at(node, b.multiply(b.divide(tiled, pair("realworldimagesize", 1.0f)),
                                     pair("realworldtilesize", 1.0f)));
}

Port make_uv_texture(const GraphNode& node) {
    PatternBuilder& b = node.builder();
    // Without the prefix it is USD's node of that name, with USD's defaults
    const bool is_materialx = node.graph.id_of(node.prim).starts_with("ND_");
    scene::Texture texture =
        is_materialx
            ? uv_texture_file(node)
            : read_texture_file(node.graph.ctx, node.prim, node.graph.entry, node.graph.meaning());
    if (is_materialx) warn_border(node, texture);
    const Port st = is_materialx ? coordinates_of(node, "st")
                                 : node.in("st", b.constant(PatternValue(0.0f), 2));
    const Port texel = placed(node, std::move(texture), st);
    if (node.output == "r") return b.channel(texel, 0);
    if (node.output == "g") return b.channel(texel, 1);
    if (node.output == "b") return b.channel(texel, 2);
    if (node.output == "a") return b.channel(texel, 3);
    return {texel.step, uint8_t(node.output == "rgba" ? 4 : 3)};
}

}  // namespace velatura::translate::materials
