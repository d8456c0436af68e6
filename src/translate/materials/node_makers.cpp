// SPDX-License-Identifier: Apache-2.0
// Nodes of MaterialX that read a surface or make a pattern of a place on it. Ref: MaterialX
// Specification 1.38 and 1.39, "Standard Library Nodes", and stdlib_ng.mtlx for what these are made
// of.
#include "translate/materials/node_graph.h"
#include "translate/materials/pattern_builder.h"

#include <fmt/format.h>

namespace velatura::translate::materials {

namespace {

using scene::PatternOp;
using scene::PatternValue;
using Node = const GraphNode&;

Port constant(Node n) {
    return n.in("value", 0.0f);
}

Port rotate2d(Node n) {
    return n.builder().apply(PatternOp::Rotate2, 2,
                             {n.in("in", 0.0f), n.in("amount", n.builder().constant(0.0f))});
}

Port rotate3d(Node n) {
    PatternBuilder& b = n.builder();
    const Port up = b.constant({0.0f, 1.0f, 0.0f, 0.0f}, 3);
    return b.apply(PatternOp::Rotate3, 3,
                   {n.in("in", 0.0f), n.in("amount", b.constant(0.0f)), n.in("axis", up)});
}

Port texture_coordinates(Node n) {
    return n.graph.texture_coordinates(int(n.graph.constant_number(n.prim, "index", 0.0)));
}

/// The texture coordinates that a node reads unless it is told others.
Port coordinates_in(Node n) {
    if (n.graph.is_authored(n.prim, "texcoord"))
        return n.in("texcoord", n.builder().constant(PatternValue(0.0f), 2));
    return n.graph.texture_coordinates(0);
}

Port geometric_value(Node n) {
    const std::string name = n.graph.constant_text(n.prim, "geomprop", "");
    const Port fallback = n.in("default", 0.0f);
    if (!name.empty()) return n.graph.primvar(name, fallback, false);
    n.graph.ctx.warn("no-varname", n.prim, "geompropvalue has no geomprop; its default is used");
    return fallback;
}

Port geometric_color(Node n) {
    return n.graph.primvar(std::string(scene::display_color_primvar),
                           n.builder().constant(PatternValue(0.0f), n.width()), false);
}

Port primvar_reader(Node n) {
    const std::string name = n.graph.constant_text(n.prim, "varname", "");
    const Port fallback = n.in("fallback", 0.0f);
    if (!name.empty())
        return n.graph.primvar(name, fallback, !n.graph.is_authored(n.prim, "fallback"));
    n.graph.ctx.warn("no-varname", n.prim, "primvar reader has no varname; its fallback is used");
    return fallback;
}

/// UsdTransform2d: scale, then counter-clockwise rotation, then translation.
Port transform2d(Node n) {
    PatternBuilder& b = n.builder();
    const auto pair = [&](float v) { return b.constant(PatternValue(v), 2); };
    const Port scaled = b.multiply(n.in("in", pair(0.0f)), n.in("scale", pair(1.0f)));
    const Port angle = b.subtract(b.constant(0.0f), n.in("rotation", b.constant(0.0f)));
    const Port turned =
        b.is_constant(angle, 0.0f) ? scaled : b.apply(PatternOp::Rotate2, 2, {scaled, angle});
    return b.add(turned, n.in("translation", pair(0.0f)));
}

Port place2d(Node n) {
    PatternBuilder& b = n.builder();
    const auto pair = [&](float v) { return b.constant(PatternValue(v), 2); };
    const Port pivot = n.in("pivot", pair(0.0f)), offset = n.in("offset", pair(0.0f));
    const Port scale = n.in("scale", pair(1.0f)), angle = n.in("rotate", b.constant(0.0f));
    const auto turned = [&](Port p) {
        return b.is_constant(angle, 0.0f) ? p : b.apply(PatternOp::Rotate2, 2, {p, angle});
    };
    Port p = b.subtract(coordinates_in(n), pivot);
    if (n.graph.constant_number(n.prim, "operationorder", 0.0) == 0.0) {
        p = b.subtract(turned(b.divide(p, scale)), offset);
    } else {
        p = b.divide(turned(b.subtract(p, offset)), scale);
    }
    return b.add(p, pivot);
}

Port position(Node n) {
    const std::string space = n.graph.constant_text(n.prim, "space", "object");
    return space == "world" ? n.graph.world_position() : n.graph.object_position();
}

Port normal(Node n) {
    const std::string space = n.graph.constant_text(n.prim, "space", "object");
    if (space != "world")
        n.graph.ctx.warn(
            "unsupported-space", n.prim,
            fmt::format("normal in {} space is not supported, world space is used", space));
    return n.graph.builder.normal();
}

Port ramp_share(Node n, uint32_t axis) {
    PatternBuilder& b = n.builder();
    return b.clamp(b.channel(coordinates_in(n), axis), b.constant(0.0f), b.constant(1.0f));
}

Port ramp_lr(Node n) {
    return n.builder().mix(n.in("valuel", 0.0f), n.in("valuer", 0.0f), ramp_share(n, 0));
}

Port ramp_tb(Node n) {
    return n.builder().mix(n.in("valueb", 0.0f), n.in("valuet", 0.0f), ramp_share(n, 1));
}

Port ramp4(Node n) {
    PatternBuilder& b = n.builder();
    const Port s = ramp_share(n, 0), t = ramp_share(n, 1);
    const Port top = b.mix(n.in("valuetl", 0.0f), n.in("valuetr", 0.0f), s);
    return b.mix(b.mix(n.in("valuebl", 0.0f), n.in("valuebr", 0.0f), s), top, t);
}

Port split_at(Node n, uint32_t axis, Port low, Port high) {
    PatternBuilder& b = n.builder();
    return b.apply(
        PatternOp::IfGreaterOrEqual, n.width(),
        {b.channel(coordinates_in(n), axis), n.in("center", b.constant(0.5f)), high, low});
}

Port split_lr(Node n) {
    return split_at(n, 0, n.in("valuel", 0.0f), n.in("valuer", 0.0f));
}

Port split_tb(Node n) {
    return split_at(n, 1, n.in("valueb", 0.0f), n.in("valuet", 0.0f));
}

/// Where noise is read: texture coordinates or the position in the object.
Port noise_place(Node n, bool is_flat) {
    if (is_flat) return coordinates_in(n);
    if (n.graph.is_authored(n.prim, "position"))
        return n.in("position", n.builder().constant(PatternValue(0.0f), 3));
    return n.graph.object_position();
}

/// As many numbers of noise as the node has channels; the fourth is read elsewhere, of fractals the
/// second of two as well.
Port noise_of(Node n, PatternOp op, Port place, Port* more, bool is_flat) {
    PatternBuilder& b = n.builder();
    const auto read = [&](Port p, int width, uint32_t data) {
        if (op == PatternOp::Fractal3)
            return b.apply(op, width, {p, more[0], more[1], more[2]}, data);
        return b.apply(op, width, {p}, data);
    };
    const int width = n.width();
    if (width == 1) return read(place, 1, 0);
    const bool is_fractal = op == PatternOp::Fractal3;
    const auto elsewhere = [&] {
        const PatternValue offset = is_fractal ? PatternValue(19.0f, 193.0f, 17.0f, 0.0f)
                                    : is_flat  ? PatternValue(19.0f, 73.0f, 0.0f, 0.0f)
                                               : PatternValue(19.0f, 73.0f, 29.0f, 0.0f);
        return read(b.add(place, b.constant(offset, is_flat ? 2 : 3)), 1, 0);
    };
    const Port zero = b.constant(0.0f);
    if (is_fractal && width == 2)
        return b.apply(PatternOp::Combine, 2, {read(place, 1, 0), elsewhere(), zero, zero});
    const Port three = read(place, 3, 1);
    if (width < 4) return {three.step, uint8_t(width)};
    return b.apply(PatternOp::Combine, 4,
                   {b.channel(three, 0), b.channel(three, 1), b.channel(three, 2), elsewhere()});
}

template <PatternOp op, bool is_flat>
Port noise(Node n) {
    PatternBuilder& b = n.builder();
    const Port raw = noise_of(n, op, noise_place(n, is_flat), nullptr, is_flat);
    return b.add(b.multiply(raw, n.in("amplitude", 1.0f)), n.in("pivot", b.constant(0.0f)));
}

template <PatternOp op, bool is_flat>
Port cell_noise(Node n) {
    return n.builder().apply(op, n.width(), {noise_place(n, is_flat)}, n.width() > 1 ? 1 : 0);
}

Port fractal3d(Node n) {
    PatternBuilder& b = n.builder();
    Port more[3] = {n.in("octaves", b.constant(3.0f)), n.in("lacunarity", b.constant(2.0f)),
                    n.in("diminish", b.constant(0.5f))};
    const Port raw = noise_of(n, PatternOp::Fractal3, noise_place(n, false), more, false);
    return b.multiply(raw, n.in("amplitude", 1.0f));
}

constexpr NodeCategory categories[] = {
    // Sources
    {"constant", constant},
    {"image", make_image},
    {"tiledimage", make_tiled_image},
    {"UsdUVTexture", make_uv_texture},
    {"texcoord", texture_coordinates},
    {"geompropvalue", geometric_value},
    {"geomcolor", geometric_color},
    {"UsdPrimvarReader", primvar_reader},
    {"position", position},
    {"normal", normal},
    // Procedural
    {"ramplr", ramp_lr},
    {"ramptb", ramp_tb},
    {"ramp4", ramp4},
    {"splitlr", split_lr},
    {"splittb", split_tb},
    {"noise2d", noise<PatternOp::Noise2, true>},
    {"noise3d", noise<PatternOp::Noise3, false>},
    {"fractal3d", fractal3d},
    {"cellnoise2d", cell_noise<PatternOp::CellNoise2, true>},
    {"cellnoise3d", cell_noise<PatternOp::CellNoise3, false>},
    // Coordinates
    {"place2d", place2d},
    {"UsdTransform2d", transform2d},
    {"rotate2d", rotate2d},
    {"rotate3d", rotate3d},
};

}  // namespace

NodeMaker find_node_maker(std::string_view category) {
    for (const auto table : {std::span<const NodeCategory>(categories), computing_nodes()}) {
        for (const NodeCategory& known : table) {
            if (known.name == category) return known.make;
        }
    }
    return nullptr;
}

std::vector<std::string_view> node_categories() {
    std::vector<std::string_view> names;
    for (const auto table : {std::span<const NodeCategory>(categories), computing_nodes()}) {
        for (const NodeCategory& known : table) names.push_back(known.name);
    }
    return names;
}

}  // namespace velatura::translate::materials
