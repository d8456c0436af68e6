// SPDX-License-Identifier: Apache-2.0
// Nodes that read pictures, and the colours in them.
#include "translate/node_graph.h"
#include "translate/values.h"

#include <fmt/format.h>

#include <optional>

namespace velatura::translate {

namespace {

using scene::PatternOp;
using scene::PatternValue;

/// What has to be done to numbers in a colour space to have linear Rec.709.
struct ColorSpace {
    std::string_view name;
    enum class Curve : uint8_t { None, Srgb, Power } curve = Curve::None;
    float exponent = 1;
    enum class Primaries : uint8_t {
        Rec709,
        Ap1,
        DisplayP3,
        AdobeRgb
    } primaries = Primaries::Rec709;
};

using Curve = ColorSpace::Curve;
using Primaries = ColorSpace::Primaries;

/// Ref: MaterialX Specification 1.38 and 1.39, "Color Spaces and Color Management Systems".
constexpr ColorSpace color_spaces[] = {
    {"", Curve::None},
    {"none", Curve::None},
    {"raw", Curve::None},
    {"Raw", Curve::None},
    {"data", Curve::None},
    {"identity", Curve::None},
    {"lin_rec709", Curve::None},
    {"lin_rec709_scene", Curve::None},
    {"lin_srgb", Curve::None},
    {"srgb_texture", Curve::Srgb},
    {"sRGB", Curve::Srgb},
    {"srgb_rec709_scene", Curve::Srgb},
    {"gamma18", Curve::Power, 1.8f},
    {"gamma22", Curve::Power, 2.2f},
    {"gamma24", Curve::Power, 2.4f},
    {"rec709_display", Curve::Power, 2.4f},
    {"g18_rec709", Curve::Power, 1.8f},
    {"g22_rec709", Curve::Power, 2.2f},
    {"acescg", Curve::None, 1, Primaries::Ap1},
    {"lin_ap1", Curve::None, 1, Primaries::Ap1},
    {"g22_ap1", Curve::Power, 2.2f, Primaries::Ap1},
    {"lin_displayp3", Curve::None, 1, Primaries::DisplayP3},
    {"srgb_displayp3", Curve::Srgb, 1, Primaries::DisplayP3},
    {"lin_adobergb", Curve::None, 1, Primaries::AdobeRgb},
    {"adobergb", Curve::Power, 563.0f / 256.0f, Primaries::AdobeRgb},
};

/// Rows that give linear Rec.709 from the other primaries; Bradford from the white of ACES. From
/// the chromaticities of SMPTE ST 2065-1 / S-2014-004, SMPTE EG 432-1 and Adobe RGB (1998).
constexpr float to_rec709[3][3][3] = {
    {{1.70505099f, -0.62179212f, -0.08325887f},
     {-0.13025642f, 1.14080474f, -0.01054832f},
     {-0.02400336f, -0.12896898f, 1.15297233f}},
    {{1.22494018f, -0.22494018f, 0.0f},
     {-0.04205695f, 1.04205695f, 0.0f},
     {-0.01963755f, -0.07863605f, 1.09827360f}},
    {{1.39835574f, -0.39835574f, 0.0f}, {0.0f, 1.0f, 0.0f}, {0.0f, -0.04293288f, 1.04293288f}}};

const ColorSpace* find_space(std::string_view name) {
    for (const ColorSpace& space : color_spaces) {
        if (space.name == name) return &space;
    }
    return nullptr;
}

Port in_rec709(NodeGraphReader& graph, Port color, Primaries primaries) {
    if (primaries == Primaries::Rec709) return color;
    PatternBuilder& b = graph.builder;
    const auto& m = to_rec709[int(primaries) - 1];
    Port rows[3];
    for (int i = 0; i < 3; ++i)
        rows[i] = b.dot({color.step, 3}, b.constant({m[i][0], m[i][1], m[i][2], 0.0f}, 3));
    const Port alpha = color.width == 4 ? b.channel(color, 3) : b.constant(0.0f);
    return b.apply(PatternOp::Combine, color.width, {rows[0], rows[1], rows[2], alpha});
}

/// The colours without the curve; alpha has none.
Port decoded(NodeGraphReader& graph, Port color, const ColorSpace& space) {
    if (space.curve == Curve::None) return color;
    PatternBuilder& b = graph.builder;
    const Port linear =
        space.curve == Curve::Srgb
            ? b.apply(PatternOp::DecodeSrgb, color.width, {color})
            : b.apply(PatternOp::Power, color.width, {color, b.constant(space.exponent)});
    if (color.width < 4) return linear;
    return b.apply(
        PatternOp::Combine, 4,
        {b.channel(linear, 0), b.channel(linear, 1), b.channel(linear, 2), b.channel(color, 3)});
}

const ColorSpace& known_space(NodeGraphReader& graph, Prim prim, std::string_view name) {
    if (const ColorSpace* space = find_space(name)) return *space;
    graph.ctx.warn("unknown-color-space", prim,
                   fmt::format("colour space {} is unknown, the numbers stay as they are", name));
    return color_spaces[0];
}

scene::Wrap address_mode(const GraphNode& node, const char* name) {
    const std::string text = node.graph.constant_text(node.prim, name, "periodic");
    if (text == "constant") return scene::Wrap::Black;
    if (text == "clamp") return scene::Wrap::Clamp;
    if (text == "mirror") return scene::Wrap::Mirror;
    if (text != "periodic")
        node.graph.ctx.warn("unknown-wrap-mode", node.prim,
                            fmt::format("{} {} is unknown, periodic is used", name, text));
    return scene::Wrap::Repeat;
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
                     fmt::format("inputs:{} is not supported and is left out", name));
    }
    const bool has_border =
        texture.wrap_s == scene::Wrap::Black || texture.wrap_t == scene::Wrap::Black;
    const auto& d = texture.fallback;
    if (has_border && (d[0] != 0.0f || d[1] != 0.0f || d[2] != 0.0f))
        ctx.warn(
            "unsupported-input", node.prim,
            "beyond its borders the picture is black, inputs:default is for missing files only");
}

/// The file of an image node and how it is read, but for the coordinates.
scene::Texture image_file(const GraphNode& node, const ColorSpace*& space) {
    Context& ctx = node.graph.ctx;
    scene::Texture texture;
    texture.provenance = ctx.provenance(node.prim);
    const Attribute own = node.prim.attribute("inputs:file");
    const ShaderSource source = shader_source(ctx, own);
    std::string space_name;
    if (!source.shader && source.value.is_valid()) {
        texture.authored = read_text(source.value, "", ctx.time);
        texture.file = source.value.resolved_asset_path(ctx.time);
        // The node's own mark is nearer than that of the interface which hands the file in
        for (const Attribute& attribute : {source.value, own}) {
            const auto mark = attribute.metadata("colorSpace");
            const auto* token = mark ? mark->get_if<usd::layer::Token>() : nullptr;
            if (token != nullptr) space_name = token->str();
        }
    }
    if (texture.authored.empty())
        ctx.warn("no-texture-file", node.prim, "image without a file gives its default");
    // Without a mark the numbers are taken as they are; only colours have a space at all
    const bool is_color = !node.name.types.empty() && node.name.types[0].starts_with("color");
    space = &known_space(node.graph, node.prim, is_color ? space_name : "");
    texture.source_color_space =
        space->curve == Curve::Srgb ? scene::SourceColorSpace::Srgb : scene::SourceColorSpace::Raw;
    texture.wrap_s = address_mode(node, "uaddressmode");
    texture.wrap_t = address_mode(node, "vaddressmode");
    const Port otherwise = node.in("default", 0.0f);
    if (const PatternValue* v = node.builder().constant_value(otherwise)) {
        texture.fallback = {v->x, v->y, v->z, otherwise.width == 4 ? v->w : 1.0f};
    } else {
        ctx.warn("unsupported-connection", node.prim,
                 "inputs:default must be a value here, its connection is left out");
    }
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
    const ColorSpace* space = nullptr;
    const scene::Texture texture = image_file(node, space);
    warn_features(node, texture);
    const Port color = channels_of(node, placed(node, texture, coordinates));
    // The texture decodes sRGB before it filters; other curves come after
    const Port linear = space->curve == Curve::Power ? decoded(node.graph, color, *space) : color;
    return in_rec709(node.graph, linear, space->primaries);
}

Port coordinates_of(const GraphNode& node) {
    if (!node.graph.is_authored(node.prim, "texcoord")) return node.graph.texture_coordinates(0);
    return node.in("texcoord", node.builder().constant(PatternValue(0.0f), 2));
}

}  // namespace

Port to_working_space(NodeGraphReader& graph, Prim prim, Port color, std::string_view name) {
    if (color.width < 3) return color;
    const ColorSpace& space = known_space(graph, prim, name);
    return in_rec709(graph, decoded(graph, color, space), space.primaries);
}

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
    scene::Texture texture = read_texture_file(node.graph.ctx, node.prim);
    const Port st = node.in("st", b.constant(PatternValue(0.0f), 2));
    const Port texel = placed(node, std::move(texture), st);
    if (node.output == "r") return b.channel(texel, 0);
    if (node.output == "g") return b.channel(texel, 1);
    if (node.output == "b") return b.channel(texel, 2);
    if (node.output == "a") return b.channel(texel, 3);
    return {texel.step, uint8_t(node.output == "rgba" ? 4 : 3)};
}

}  // namespace velatura::translate
