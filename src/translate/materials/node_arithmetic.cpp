// SPDX-License-Identifier: Apache-2.0
// Nodes of MaterialX that compute: numbers, vectors, channels, colors, choices. Ref: MaterialX
// Specification 1.38 and 1.39, "Standard Library Nodes", and stdlib_ng.mtlx for what these are made
// of.
#include "translate/materials/node_graph.h"
#include "translate/materials/pattern_builder.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::translate::materials {

namespace {

using scene::PatternOp;
using scene::PatternValue;
using Node = const GraphNode&;

/// Weights that MaterialX's luminance has unless told otherwise (ACEScg).
constexpr float luma_weights[3] = {0.2722287f, 0.6740818f, 0.0536895f};

template <PatternOp op>
Port unary(Node n) {
    return n.builder().apply(op, n.width(), {n.in("in", 0.0f)});
}

/// Second operand 0 or 1, as the library has it.
template <PatternOp op, int second>
Port binary(Node n) {
    return n.builder().apply(op, n.width(), {n.in("in1", 0.0f), n.in("in2", float(second))});
}

Port arc_tangent(Node n) {
    const bool is_new = n.graph.is_authored(n.prim, "iny") || n.graph.is_authored(n.prim, "inx");
    return n.builder().apply(
        PatternOp::ArcTangent, n.width(),
        {n.in(is_new ? "iny" : "in1", 0.0f), n.in(is_new ? "inx" : "in2", 1.0f)});
}

Port logarithm(Node n) {
    return n.builder().apply(PatternOp::Logarithm, n.width(), {n.in("in", 1.0f)});
}

Port pass(Node n) {
    return n.in("in", 0.0f);
}

Port invert(Node n) {
    return n.builder().subtract(n.in("amount", 1.0f), n.in("in", 0.0f));
}

Port clamp(Node n) {
    return n.builder().clamp(n.in("in", 0.0f), n.in("low", 0.0f), n.in("high", 1.0f));
}

Port smoothstep(Node n) {
    return n.builder().apply(PatternOp::Smoothstep, n.width(),
                             {n.in("in", 0.0f), n.in("low", 0.0f), n.in("high", 1.0f)});
}

Port share_of(Node n) {
    PatternBuilder& b = n.builder();
    const Port low = n.in("inlow", 0.0f);
    return b.divide(b.subtract(n.in("in", 0.0f), low), b.subtract(n.in("inhigh", 1.0f), low));
}

Port mapped_out(Node n, Port share) {
    PatternBuilder& b = n.builder();
    const Port low = n.in("outlow", 0.0f);
    return b.add(low, b.multiply(share, b.subtract(n.in("outhigh", 1.0f), low)));
}

Port remap(Node n) {
    return mapped_out(n, share_of(n));
}

Port range(Node n) {
    PatternBuilder& b = n.builder();
    const Port gamma = b.divide(b.constant(1.0f), n.in("gamma", 1.0f));
    const Port out = mapped_out(n, b.apply(PatternOp::Power, n.width(), {share_of(n), gamma}));
    if (n.graph.constant_number(n.prim, "doclamp", 0.0) == 0.0) return out;
    return b.clamp(out, n.in("outlow", 0.0f), n.in("outhigh", 1.0f));
}

Port contrast(Node n) {
    PatternBuilder& b = n.builder();
    const Port pivot = n.in("pivot", 0.5f);
    return b.add(b.multiply(b.subtract(n.in("in", 0.0f), pivot), n.in("amount", 1.0f)), pivot);
}

Port mix(Node n) {
    return n.builder().mix(n.in("bg", 0.0f), n.in("fg", 0.0f), n.in("mix", 0.0f));
}

/// The vector that goes in, of whatever width.
Port vector_in(Node n, std::string_view name) {
    return n.graph.any_input(n.prim, name, n.builder().constant(PatternValue(0.0f), 3));
}

Port length_of(PatternBuilder& b, Port v) {
    return b.apply(PatternOp::SquareRoot, 1, {b.dot(v, v)});
}

Port magnitude(Node n) {
    return length_of(n.builder(), vector_in(n, "in"));
}

Port distance(Node n) {
    PatternBuilder& b = n.builder();
    return length_of(b, b.subtract(vector_in(n, "in1"), vector_in(n, "in2")));
}

Port normalize(Node n) {
    const Port v = n.in("in", 0.0f);
    return n.builder().divide(v, length_of(n.builder(), v));
}

Port dot_product(Node n) {
    return n.builder().dot(vector_in(n, "in1"), vector_in(n, "in2"));
}

Port cross_product(Node n) {
    return n.builder().apply(PatternOp::Cross, 3, {n.in("in1", 0.0f), n.in("in2", 0.0f)});
}

Port luminance_of(Node n, Port color) {
    PatternBuilder& b = n.builder();
    const Port weights = n.in(
        "lumacoeffs", b.constant({luma_weights[0], luma_weights[1], luma_weights[2], 0.0f}, 3));
    return b.dot({color.step, 3}, weights);
}

/// Keeps alpha.
Port gray(Node n, Port color) {
    PatternBuilder& b = n.builder();
    const Port l = luminance_of(n, color);
    if (color.width < 4) return {l.step, 3};
    return b.apply(PatternOp::Combine, 4, {l, l, l, b.channel(color, 3)});
}

Port luminance(Node n) {
    return gray(n, vector_in(n, "in"));
}

Port saturate(Node n) {
    const Port in = n.in("in", 0.0f);
    return n.builder().mix(gray(n, in), in, n.in("amount", 1.0f));
}

Port to_hsv(Node n) {
    return n.builder().apply(PatternOp::HsvFromRgb, n.width(), {n.in("in", 0.0f)});
}

Port from_hsv(Node n) {
    return n.builder().apply(PatternOp::RgbFromHsv, n.width(), {n.in("in", 0.0f)});
}

Port hsv_adjust(Node n) {
    PatternBuilder& b = n.builder();
    const Port hsv = to_hsv(n);
    const Port amount = n.in("amount", b.constant({0.0f, 1.0f, 1.0f, 0.0f}, 3));
    const Port part[3] = {b.add(b.channel(hsv, 0), b.channel(amount, 0)),
                          b.multiply(b.channel(hsv, 1), b.channel(amount, 1)),
                          b.multiply(b.channel(hsv, 2), b.channel(amount, 2))};
    const Port alpha = n.width() == 4 ? b.channel(hsv, 3) : b.constant(0.0f);
    const Port turned = b.apply(PatternOp::Combine, n.width(), {part[0], part[1], part[2], alpha});
    return b.apply(PatternOp::RgbFromHsv, n.width(), {turned});
}

Port extract(Node n) {
    const int index = int(n.graph.constant_number(n.prim, "index", 0.0));
    return n.builder().channel(vector_in(n, "in"), uint32_t(std::clamp(index, 0, 3)));
}

uint32_t channel_of(char letter) {
    switch (letter) {
        case 'g':
        case 'y':
            return 1;
        case 'b':
        case 'z':
            return 2;
        case 'a':
        case 'w':
            return 3;
        case '0':
            return 4;
        case '1':
            return 5;
        default:
            return 0;
    }
}

Port separate(Node n) {
    return n.builder().channel(vector_in(n, "in"),
                               n.output.empty() ? 0 : channel_of(n.output.back()));
}

Port swizzle(Node n) {
    const std::string channels = n.graph.constant_text(n.prim, "channels", "");
    const Port in = vector_in(n, "in");
    uint32_t from[4] = {4, 4, 4, 4};
    for (size_t i = 0; i < std::min<size_t>(channels.size(), 4); ++i)
        from[i] = channel_of(channels[i]);
    if (int(channels.size()) != n.width())
        n.graph.ctx.warn(
            "bad-swizzle", n.prim,
            fmt::format("channels \"{}\" do not fit {} channels", channels, n.width()));
    if (n.width() == 1) return n.builder().channel(in, from[0]);
    return n.builder().swizzle(in, n.width(), from[0], from[1], from[2], from[3]);
}

Port convert(Node n) {
    const Port in = vector_in(n, "in");
    const int width = n.width();
    // A number fills all channels; a fourth one that is not there is 1
    if (in.width == width || in.width == 1) return {in.step, uint8_t(width)};
    if (width == 1) return n.builder().channel(in, 0);
    const auto from = [&](int i) { return i < in.width ? uint32_t(i) : 4u; };
    return n.builder().swizzle(in, width, from(0), from(1), from(2), in.width < 4 ? 5u : 3u);
}

Port combine(Node n) {
    PatternBuilder& b = n.builder();
    Port parts[4] = {b.constant(0.0f), b.constant(0.0f), b.constant(0.0f), b.constant(0.0f)};
    int filled = 0;
    for (const char* name : {"in1", "in2", "in3", "in4"}) {
        // A color or a pair fills as many channels as it has
        const Port in = n.graph.any_input(n.prim, name, b.constant(0.0f));
        for (int c = 0; c < in.width && filled < 4; ++c)
            parts[filled++] = b.channel(in, uint32_t(c));
        if (filled >= n.width()) break;
    }
    return b.apply(PatternOp::Combine, n.width(), {parts[0], parts[1], parts[2], parts[3]});
}

template <PatternOp op>
Port compare(Node n) {
    PatternBuilder& b = n.builder();
    return b.apply(op, n.width(),
                   {n.in("value1", b.constant(1.0f)), n.in("value2", b.constant(0.0f)),
                    n.in("in1", 0.0f), n.in("in2", 0.0f)});
}

Port choose(Node n) {
    PatternBuilder& b = n.builder();
    const Port positive =
        b.apply(PatternOp::Maximum, 1, {n.in("which", b.constant(0.0f)), b.constant(0.0f)});
    const Port which = b.apply(PatternOp::Floor, 1, {positive});
    // The last one that is reached wins: from the end to the front
    Port out = b.constant(PatternValue(0.0f), n.width());
    for (int i = 9; i >= 0; --i) {
        const std::string name = fmt::format("in{}", i + 1);
        if (i >= 5 && !n.graph.is_authored(n.prim, name)) continue;
        out = b.apply(PatternOp::IfEqual, n.width(),
                      {which, b.constant(float(i)), n.in(name, 0.0f), out});
    }
    return out;
}

/// bg, and what comes of it and fg, by the share `mix`.
Port blended(Node n, Port result) {
    return n.builder().mix(n.in("bg", 0.0f), result, n.in("mix", n.builder().constant(1.0f)));
}

Port plus(Node n) {
    return blended(n, n.builder().add(n.in("bg", 0.0f), n.in("fg", 0.0f)));
}

Port minus(Node n) {
    return blended(n, n.builder().subtract(n.in("bg", 0.0f), n.in("fg", 0.0f)));
}

Port difference(Node n) {
    const Port d = n.builder().subtract(n.in("bg", 0.0f), n.in("fg", 0.0f));
    return blended(n, n.builder().apply(PatternOp::Absolute, n.width(), {d}));
}

Port screen(Node n) {
    PatternBuilder& b = n.builder();
    return blended(n, b.invert(b.multiply(b.invert(n.in("fg", 0.0f)), b.invert(n.in("bg", 0.0f)))));
}

constexpr NodeCategory categories[] = {
    // Arithmetic
    {"add", binary<PatternOp::Add, 0>},
    {"subtract", binary<PatternOp::Subtract, 0>},
    {"multiply", binary<PatternOp::Multiply, 1>},
    {"divide", binary<PatternOp::Divide, 1>},
    {"modulo", binary<PatternOp::Modulo, 1>},
    {"power", binary<PatternOp::Power, 1>},
    {"min", binary<PatternOp::Minimum, 0>},
    {"max", binary<PatternOp::Maximum, 0>},
    {"absval", unary<PatternOp::Absolute>},
    {"sign", unary<PatternOp::Sign>},
    {"floor", unary<PatternOp::Floor>},
    {"ceil", unary<PatternOp::Ceiling>},
    {"round", unary<PatternOp::Round>},
    {"sqrt", unary<PatternOp::SquareRoot>},
    {"exp", unary<PatternOp::Exponential>},
    {"ln", logarithm},
    {"sin", unary<PatternOp::Sine>},
    {"cos", unary<PatternOp::Cosine>},
    {"tan", unary<PatternOp::Tangent>},
    {"asin", unary<PatternOp::ArcSine>},
    {"acos", unary<PatternOp::ArcCosine>},
    {"atan2", arc_tangent},
    {"invert", invert},
    {"clamp", clamp},
    {"smoothstep", smoothstep},
    {"remap", remap},
    {"range", range},
    {"contrast", contrast},
    {"mix", mix},
    {"dot", pass},
    // Vectors and channels
    {"normalize", normalize},
    {"magnitude", magnitude},
    {"distance", distance},
    {"dotproduct", dot_product},
    {"crossproduct", cross_product},
    {"extract", extract},
    {"separate2", separate},
    {"separate3", separate},
    {"separate4", separate},
    {"combine2", combine},
    {"combine3", combine},
    {"combine4", combine},
    {"swizzle", swizzle},
    {"convert", convert},
    // Color
    {"luminance", luminance},
    {"saturate", saturate},
    {"rgbtohsv", to_hsv},
    {"hsvtorgb", from_hsv},
    {"hsvadjust", hsv_adjust},
    {"plus", plus},
    {"minus", minus},
    {"difference", difference},
    {"screen", screen},
    // Choices
    {"ifgreater", compare<PatternOp::IfGreater>},
    {"ifgreatereq", compare<PatternOp::IfGreaterOrEqual>},
    {"ifequal", compare<PatternOp::IfEqual>},
    {"switch", choose},
};

}  // namespace

std::span<const NodeCategory> computing_nodes() {
    return categories;
}

}  // namespace velatura::translate::materials
