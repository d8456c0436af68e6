// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "usd/layer/layer.h"
#include "usd/layer/path.h"
#include "usd/layer/value.h"
#include "usd/materialx/document.h"
#include "usd/materialx/node_names.h"

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace velatura::usd::materialx {

/// What nodes see around them: the nodes beside them, and the interface of their graph.
struct NodeScope {
    layer::Path prim;  ///< holds the nodes
    const std::vector<XmlElement>* nodes = nullptr;
    bool is_document = false;  ///< the nodes of the document: inputs may name its graphs
    std::string color_space = {}, file_prefix = {};  ///< inherited
    /// Where connections to the nodes lead instead; of materials, which see a copy of the graphs.
    layer::Path seen_as = {};
};

/// Writes node graphs of a document into a layer. Warnings: "mtlx-…", at the element.
class GraphAuthor {
  public:
    GraphAuthor(layer::Layer& layer, const Document& document, Diagnostics& diagnostics);

    layer::Path define_prim(layer::Path parent,
                            std::string_view name,
                            std::string_view type,
                            SourceLoc loc);
    /// An attribute without a value; as it is when it is there already.
    layer::Path declare(layer::Path prim,
                        const std::string& name,
                        std::string_view type,
                        SourceLoc loc);
    void connect(layer::Path attribute, layer::Path source, SourceLoc loc);
    void set(layer::Path attribute, layer::Value value, SourceLoc loc);

    /// All nodes and graphs of the document, below `root`.
    void author_document(layer::Path root);

    /// A node below scope.prim, with its inputs or without. Returns: its prim; empty where a limit
    /// is reached.
    layer::Path author_node(const XmlElement& node,
                            const NodeScope& scope,
                            bool with_inputs = true);

    /// An input of a node: its value goes to `holder`, its connections come to `reader`.
    void author_input(const XmlElement& input,
                      const XmlElement& node,
                      layer::Path holder,
                      layer::Path reader,
                      const NodeScope& scope);

    /// What the node is called and what goes in.
    NodeSignature signature(const XmlElement& node) const;

    /// The first output of a node.
    std::string output_name(const XmlElement& node) const;

    /// The node of the document of that name; null when there is none.
    const XmlElement* find(std::string_view name) const;
    const XmlElement* find_graph(std::string_view name) const;
    /// Whether a graph reads nothing that stands outside of it.
    static bool is_self_contained(const XmlElement& graph);

    void warn(const XmlElement& element, std::string code, std::string message);

  private:
    struct Custom {
        const XmlElement* definition = nullptr;
        const XmlElement* graph = nullptr;
    };

    void author_graph(const XmlElement& graph, layer::Path prim, const NodeScope& outside);
    void author_contents(const XmlElement& graph, layer::Path prim, const NodeScope& outside);
    layer::Path author_custom(const XmlElement& node,
                              const Custom& custom,
                              const NodeScope& scope,
                              bool with_inputs);
    void author_inputs(const XmlElement& node, layer::Path prim, const NodeScope& scope);
    std::optional<Custom> custom_of(const XmlElement& node) const;
    std::vector<NodeOutput> outputs_of(const XmlElement& node) const;
    /// outputs_followed: of the document, on the way to the port.
    layer::Path source_of(const XmlElement& port,
                          const NodeScope& scope,
                          size_t outputs_followed = 0);
    void author_value(const XmlElement& input,
                      const XmlElement& node,
                      layer::Path attribute,
                      const NodeScope& scope);
    std::string file_path(const XmlElement& input, const std::string& prefix, std::string value);

    layer::Layer& layer_;
    const Document& document_;
    Diagnostics& diagnostics_;
    /// A node among others; the first of that name.
    const XmlElement* node_in(const std::vector<XmlElement>& nodes, std::string_view name) const;

    using NodeIndex = std::unordered_map<std::string_view, const XmlElement*>;

    mutable std::unordered_map<const std::vector<XmlElement>*, NodeIndex> indices_;  ///< on demand
    std::map<std::string, const XmlElement*, std::less<>> definitions_;
    std::map<std::string, const XmlElement*, std::less<>>
        definitions_by_node_;  ///< also "node type"
    std::map<std::string, const XmlElement*, std::less<>> graphs_, graphs_by_definition_;
    std::map<std::string, const XmlElement*, std::less<>> outputs_;  ///< of the document
    size_t custom_depth_ = 0;
    bool is_too_large_ = false;
};

/// Elements of a document or graph that are nodes.
bool is_node(const XmlElement& element);

}  // namespace velatura::usd::materialx
