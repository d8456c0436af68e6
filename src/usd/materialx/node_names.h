// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::usd::materialx {

/// What identifies a node of a document: its element and the types of its inputs.
struct NodeSignature {
    std::string_view category;  ///< "multiply"
    std::string_view type;      ///< "color3"; of the outputs "multioutput"
    std::map<std::string_view, std::string_view> inputs;  ///< type by name
    bool is_before_139 = true;                            ///< version of the document
};

/// Name of the node definition of the standard library that a node means ("ND_multiply_color3FA"):
/// what `info:id` of its shader says. Names are put together as the library does, whether it has
/// such a node or not. Ref: MaterialX 1.38 and 1.39, stdlib_defs.mtlx.
std::string node_definition(const NodeSignature& node);

/// An output of a node: name and MaterialX type.
struct NodeOutput {
    std::string name;
    std::string type;
};

/// Outputs of a node of the standard library.
std::vector<NodeOutput> node_outputs(const NodeSignature& node);

/// An input of a surface shader.
struct InterfaceInput {
    std::string_view name;
    std::string_view type;
};

/// The inputs that a material of this surface shader offers; none for those that are not known.
/// Ref: MaterialX 1.39: standard_surface.mtlx, open_pbr_surface.mtlx, usd_preview_surface.mtlx.
const std::vector<InterfaceInput>& surface_inputs(std::string_view category);

}  // namespace velatura::usd::materialx
