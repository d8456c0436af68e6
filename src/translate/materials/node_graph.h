// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/color/color_space.h"
#include "translate/context/context.h"
#include "translate/materials/materials.h"
#include "translate/materials/pattern_builder.h"
#include "translate/materials/shader_inputs.h"

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::translate::materials {

/// Name of a MaterialX node definition, taken apart: "ND_multiply_color3FA" is the category
/// "multiply" with the types {"color3FA"}.
struct NodeName {
    std::string category;
    std::vector<std::string> types;
};

/// categories: those that are known, for a category may have '_' in its name.
NodeName parse_node_name(std::string_view id);

/// Channels of a MaterialX type, which may have something behind it ("color3FA"); 0 for shaders and
/// other types without numbers.
int width_of_type(std::string_view type);

/// Turns the node graphs of one material into patterns. What a node cannot be made of costs a
/// warning at its prim and gives the default of the input that reads it.
class NodeGraphReader {
  public:
    NodeGraphReader(Context& context, MaterialEntry& material_entry);

    Context& ctx;
    MaterialEntry& entry;
    PatternBuilder builder;

    /// What an input reads, of its default's width or one number.
    Port input(Prim node, std::string_view name, Port otherwise);
    /// The same, of whatever width.
    Port any_input(Prim node, std::string_view name, Port otherwise);
    /// As input(), of numbers that are no color, whatever the types of what they are made of.
    Port numbers(Prim node, std::string_view name, Port otherwise);

    /// What images hold that are read now: numbers below an input that is no color.
    color::Meaning meaning() const {
        return reads_numbers_ ? color::Meaning::Number : color::Meaning::Color;
    }

    /// An input that cannot vary; a warning when it does.
    double constant_number(Prim node, std::string_view name, double otherwise);
    std::string constant_text(Prim node, std::string_view name, std::string_view otherwise);
    /// The shader that an input is connected to; invalid when it is to none.
    Prim connected_shader(Prim node, std::string_view name);
    bool is_authored(Prim node, std::string_view name);

    /// st, or the n-th further texture coordinates (st1, …).
    Port texture_coordinates(int index);
    Port primvar(const std::string& name, Port fallback, bool is_needed);
    Port object_position();
    Port world_position();
    /// The vector of a normalmap node, in tangent space: decoded and scaled.
    Port normal_map(Prim node);

    /// How a pattern becomes an input of the scene; a warning when it is too large.
    scene::Input finish(Prim surface, Port p, const Rgb& varying_value);

    std::string id_of(Prim shader);

  private:
    Port read_input(const Attribute& attribute, Port otherwise);
    Port output_of(const ShaderSource& source, Port otherwise);

    std::map<std::string, Port> made_;  // by path of the output
    std::vector<std::string> open_;     // outputs being made, against cycles
    bool reads_numbers_ = false;
};

/// A node on its way into a pattern.
struct GraphNode {
    NodeGraphReader& graph;
    Prim prim;
    NodeName name;
    std::string output;

    PatternBuilder& builder() const { return graph.builder; }

    /// Channels of the result: those of the type in the name.
    int width() const { return name.types.empty() ? 0 : width_of_type(name.types.back()); }

    /// An input of the node's width, or one number.
    Port in(std::string_view input, float otherwise) const;

    /// An input of a width of its own.
    Port in(std::string_view input, Port otherwise) const {
        return graph.input(prim, input, otherwise);
    }
};

/// Makes a node of a category.
using NodeMaker = Port (*)(const GraphNode&);

struct NodeCategory {
    std::string_view name;
    NodeMaker make;
};

/// Those that compute with what goes in alone (node_arithmetic.cpp).
std::span<const NodeCategory> computing_nodes();
/// The maker of a category of pattern nodes; null for those that are not supported.
NodeMaker find_node_maker(std::string_view category);
/// All of them, for the table of docs/reference/materialx.md.
std::vector<std::string_view> node_categories();

// Makers of node_images.cpp
Port make_image(const GraphNode& node);
Port make_tiled_image(const GraphNode& node);
Port make_uv_texture(const GraphNode& node);

}  // namespace velatura::translate::materials
