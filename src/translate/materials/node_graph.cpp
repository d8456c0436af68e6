// SPDX-License-Identifier: Apache-2.0
#include "translate/materials/node_graph.h"

#include "translate/color/color_space.h"
#include "translate/context/values.h"
#include "translate/materials/materials.h"
#include "translate/materials/pattern_builder.h"
#include "translate/materials/shader_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace velatura::translate::materials {

namespace {

std::vector<std::string> split(std::string_view text) {
    std::vector<std::string> parts;
    while (true) {
        const size_t at = text.find('_');
        parts.emplace_back(text.substr(0, at));
        if (at == std::string_view::npos) return parts;
        text.remove_prefix(at + 1);
    }
}

Attribute input_attribute(Prim node, std::string_view name) {
    return node.attribute("inputs:" + std::string(name));
}

}  // namespace

NodeName parse_node_name(std::string_view id) {
    if (id.starts_with("ND_")) id.remove_prefix(3);
    // The longest category that the name begins with
    NodeName name;
    for (const std::string_view category : node_categories()) {
        const bool fits = id.starts_with(category) &&
                          (id.size() == category.size() || id[category.size()] == '_');
        if (fits && category.size() > name.category.size()) name.category = category;
    }
    if (name.category.empty()) {
        name.category = id.substr(0, id.find('_'));
    }
    if (id.size() > name.category.size()) name.types = split(id.substr(name.category.size() + 1));
    return name;
}

int width_of_type(std::string_view type) {
    for (const char* number : {"float", "integer", "boolean", "int"}) {
        if (type.starts_with(number) && !(type.size() > 5 && type[5] >= '2' && type[5] <= '4'))
            return 1;
    }
    for (const char* tuple : {"color", "vector", "float"}) {
        const size_t length = std::string_view(tuple).size();
        if (!type.starts_with(tuple)) continue;
        if (type.size() == length) return 3;
        const int width = type[length] - '0';
        return width >= 2 && width <= 4 ? width : 0;
    }
    return type == "normal" || type == "point" ? 3 : 0;
}

NodeGraphReader::NodeGraphReader(Context& context, MaterialEntry& material_entry)
    : ctx(context), entry(material_entry), builder(context.scene) {}

std::string NodeGraphReader::id_of(Prim shader) {
    return read_text(shader.attribute("info:id"), "", ctx.time);
}

Port NodeGraphReader::any_input(Prim node, std::string_view name, Port otherwise) {
    const Attribute attribute = input_attribute(node, name);
    if (!attribute.is_valid()) return otherwise;
    const bool outer = std::exchange(reads_numbers_, reads_numbers_ || !color::is_color(attribute));
    const Port p = read_input(attribute, otherwise);
    reads_numbers_ = outer;
    return p;
}

Port NodeGraphReader::read_input(const Attribute& attribute, Port otherwise) {
    const ShaderSource source = shader_source(ctx, attribute);
    if (source.shader) return output_of(source, otherwise);
    std::vector<float> rows;
    int width = 0;
    if (!color::read_color_rows(ctx, source.value, rows, width, meaning()) || rows.empty() ||
        width > 4)
        return otherwise;
    scene::PatternValue value(0.0f);
    for (int i = 0; i < width; ++i) value[i] = rows[size_t(i)];
    return builder.constant(value, width);
}

Port NodeGraphReader::input(Prim node, std::string_view name, Port otherwise) {
    const Port p = any_input(node, name, otherwise);
    if (p.width == otherwise.width || p.width == 1) return p;
    ctx.warn("wrong-type", input_attribute(node, name),
             fmt::format("input {} has {} channels, expected {}; it keeps its default", name,
                         p.width, otherwise.width));
    return otherwise;
}

Port NodeGraphReader::numbers(Prim node, std::string_view name, Port otherwise) {
    const bool outer = std::exchange(reads_numbers_, true);
    const Port p = input(node, name, otherwise);
    reads_numbers_ = outer;
    return p;
}

Port NodeGraphReader::output_of(const ShaderSource& source, Port otherwise) {
    constexpr size_t deepest = 128;
    std::string path = source.shader.path_string() + "." + source.output;
    // In linear Rec.709 colors and numbers are read alike
    if (reads_numbers_ && !ctx.state<color::WorkingSpace>().is_rec709()) path += " (numbers)";
    if (const auto it = made_.find(path); it != made_.end()) return it->second;
    if (open_.size() >= deepest || std::find(open_.begin(), open_.end(), path) != open_.end()) {
        ctx.warn("connection-cycle", source.shader,
                 fmt::format("the node graph of <{}> has a cycle, or is deeper than {} nodes", path,
                             deepest));
        return otherwise;
    }
    const std::string id = id_of(source.shader);
    GraphNode node{*this, source.shader, parse_node_name(id), source.output};
    const NodeMaker make = find_node_maker(node.name.category);
    if (make == nullptr) {
        ctx.warn("unsupported-shader", source.shader,
                 fmt::format(
                     "shader node {} is not supported; inputs connected to it keep their defaults",
                     id.empty() ? "without info:id" : id));
        return otherwise;
    }
    open_.push_back(path);
    const Port made = make(node);
    open_.pop_back();
    made_.emplace(path, made);
    return made;
}

double NodeGraphReader::constant_number(Prim node, std::string_view name, double otherwise) {
    const ShaderSource source = shader_source(ctx, input_attribute(node, name));
    if (!source.shader) return read_number(source.value, otherwise, ctx.time);
    const bool outer = std::exchange(reads_numbers_, true);
    const Port p = output_of(source, builder.constant(float(otherwise)));
    reads_numbers_ = outer;
    if (const scene::PatternValue* v = builder.constant_value(p)) return double(v->x);
    ctx.warn("unsupported-connection", input_attribute(node, name),
             fmt::format("{} cannot vary over the surface, {} is used", name, otherwise));
    return otherwise;
}

std::string NodeGraphReader::constant_text(Prim node,
                                           std::string_view name,
                                           std::string_view otherwise) {
    const ShaderSource source = shader_source(ctx, input_attribute(node, name));
    if (!source.shader) return read_text(source.value, otherwise, ctx.time);
    ctx.warn("unsupported-connection", input_attribute(node, name),
             fmt::format("{} must be a constant here; its connection is ignored", name));
    return std::string(otherwise);
}

Prim NodeGraphReader::connected_shader(Prim node, std::string_view name) {
    const Attribute attribute = input_attribute(node, name);
    return attribute.is_valid() ? shader_source(ctx, attribute).shader : Prim();
}

bool NodeGraphReader::is_authored(Prim node, std::string_view name) {
    const Attribute attribute = input_attribute(node, name);
    if (!attribute.is_valid()) return false;
    const ShaderSource source = shader_source(ctx, attribute);
    return source.shader || source.value.has_authored_value();
}

Port NodeGraphReader::primvar(const std::string& name, Port fallback, bool is_needed) {
    entry.primvars.push_back(name);
    if (is_needed) entry.needed.push_back(name);
    return builder.primvar(scene::intern_primvar(ctx.scene, name), fallback);
}

Port NodeGraphReader::texture_coordinates(int index) {
    const std::string name = index > 0 ? fmt::format("st{}", index) : "st";
    return primvar(name, builder.constant(scene::PatternValue(0.0f), 2), true);
}

Port NodeGraphReader::object_position() {
    const Port p = builder.swizzle(builder.position(true), 4, 0, 1, 2, 5);
    Port rows[3];
    for (int i = 0; i < 3; ++i) {
        scene::PatternValue same(0.0f);
        same[i] = 1.0f;
        rows[i] = builder.dot(p, primvar(std::string(scene::object_space_primvars[size_t(i)]),
                                         builder.constant(same, 4), false));
    }
    return builder.apply(scene::PatternOp::Combine, 3,
                         {rows[0], rows[1], rows[2], builder.constant(0.0f)});
}

Port NodeGraphReader::world_position() {
    const Vec3 o(float(ctx.origin.x), float(ctx.origin.y), float(ctx.origin.z));
    return builder.add(builder.position(false), builder.constant({o.x, o.y, o.z, 0.0f}, 3));
}

Port NodeGraphReader::normal_map(Prim node) {
    const Port half = builder.constant({0.5f, 0.5f, 1.0f, 0.0f}, 3);
    const Port in = input(node, "in", half);
    const Port scale = any_input(node, "scale", builder.constant(1.0f));
    // An image that is read by nothing else decodes on its own, as UsdUVTexture does
    if (const auto id = builder.whole_texture(in); id && builder.constant_value(scale)) {
        const scene::PatternValue& s = *builder.constant_value(scale);
        scene::Texture decoded = ctx.scene.textures[*id];
        const float by[3] = {s.x, s.y, 1.0f};
        bool is_plain = true;
        for (size_t c = 0; c < 3; ++c) {
            is_plain = is_plain && decoded.scale[c] == 1.0f && decoded.bias[c] == 0.0f;
            decoded.scale[c] = 2.0f * by[c];
            decoded.bias[c] = -by[c];
        }
        // An image that is not there turns nothing
        decoded.fallback = {0, 0, 1, 1};
        if (is_plain) {
            ctx.scene.textures.push_back(decoded);
            return {builder.texture(scene::TextureId(ctx.scene.textures.size() - 1)).step, 3};
        }
    }
    const Port decoded =
        builder.subtract(builder.multiply(in, builder.constant(2.0f)), builder.constant(1.0f));
    const Port by =
        builder.apply(scene::PatternOp::Combine, 3,
                      {builder.channel(scale, 0), builder.channel(scale, scale.width == 1 ? 0 : 1),
                       builder.constant(1.0f), builder.constant(0.0f)});
    return builder.multiply(decoded, by);
}

scene::Input NodeGraphReader::finish(Prim surface, Port p, const Rgb& varying_value) {
    if (const auto input = builder.input(p, varying_value)) return *input;
    ctx.warn("pattern-too-large", surface,
             fmt::format("a node graph has more than {} nodes; its input keeps its default",
                         scene::max_pattern_steps));
    return scene::Input(varying_value);
}

Port GraphNode::in(std::string_view input, float otherwise) const {
    return graph.input(prim, input,
                       builder().constant(scene::PatternValue(otherwise), std::max(width(), 1)));
}

}  // namespace velatura::translate::materials
