// SPDX-License-Identifier: Apache-2.0
#include "usd/materialx/graph_author.h"

#include "base/asset_bytes.h"
#include "base/package_path.h"
#include "usd/layer/fields.h"
#include "usd/materialx/values.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

namespace velatura::usd::materialx {

using layer::fields;
using layer::Path;
using layer::Token;
using layer::Value;

namespace {

constexpr size_t deepest_custom_node = 16;
constexpr size_t max_outputs_in_a_row = 16;
constexpr size_t max_specs = 1u << 19;

const std::set<std::string_view>& no_nodes() {
    static const std::set<std::string_view> names = {
        "input",          "output",      "token",       "nodegraph",    "nodedef",
        "implementation", "typedef",     "unittypedef", "unitdef",      "geomprop",
        "geompropdef",    "look",        "lookgroup",   "material",     "materialassign",
        "collection",     "propertyset", "variantset",  "geominfo",     "xi:include",
        "targetdef",      "backdrop",    "parameter",   "attributedef", "propertyassign",
        "visibility"};
    return names;
}

/// The active color space of an element that stands in a context.
std::string inherited(const XmlElement& element, std::string_view name, const std::string& outer) {
    const std::string_view own = element.attribute(name);
    return own.empty() ? outer : std::string(own);
}

}  // namespace

bool is_node(const XmlElement& element) {
    return !no_nodes().contains(element.name);
}

GraphAuthor::GraphAuthor(layer::Layer& layer, const Document& document, Diagnostics& diagnostics)
    : layer_(layer), document_(document), diagnostics_(diagnostics) {
    for (const XmlElement& e : document.elements) {
        const std::string name(e.attribute("name"));
        if (e.name == "output") outputs_.emplace(name, &e);
        if (e.name == "nodedef") {
            definitions_.emplace(name, &e);
            const std::string node(e.attribute("node"));
            definitions_by_node_.emplace(node, &e);
            for (const XmlElement& output : e.children) {
                if (output.name == "output")
                    definitions_by_node_.emplace(node + " " + std::string(output.attribute("type")),
                                                 &e);
            }
        }
        if (e.name != "nodegraph") continue;
        graphs_.emplace(name, &e);
        if (!e.attribute("nodedef").empty())
            graphs_by_definition_.emplace(e.attribute("nodedef"), &e);
    }
    for (const XmlElement& e : document.elements) {
        if (e.name != "implementation") continue;
        if (const XmlElement* graph = find_graph(e.attribute("nodegraph")))
            graphs_by_definition_.emplace(e.attribute("nodedef"), graph);
    }
}

void GraphAuthor::warn(const XmlElement& element, std::string code, std::string message) {
    diagnostics_.warn(std::move(code), element.loc, "", std::move(message));
}

const XmlElement* GraphAuthor::node_in(const std::vector<XmlElement>& nodes,
                                       std::string_view name) const {
    const auto [it, is_new] = indices_.try_emplace(&nodes);
    NodeIndex& index = it->second;
    if (is_new) {
        for (const XmlElement& e : nodes) {
            if (is_node(e)) index.try_emplace(e.attribute("name"), &e);
        }
    }
    const auto found = index.find(name);
    return found == index.end() ? nullptr : found->second;
}

const XmlElement* GraphAuthor::find(std::string_view name) const {
    return node_in(document_.elements, name);
}

const XmlElement* GraphAuthor::find_graph(std::string_view name) const {
    const auto it = graphs_.find(name);
    return it == graphs_.end() ? nullptr : it->second;
}

bool GraphAuthor::is_self_contained(const XmlElement& graph) {
    return std::none_of(graph.children.begin(), graph.children.end(), [](const XmlElement& e) {
        return e.name == "input" &&
               !(e.attribute("nodename").empty() && e.attribute("nodegraph").empty());
    });
}

Path GraphAuthor::define_prim(Path parent,
                              std::string_view name,
                              std::string_view type,
                              SourceLoc loc) {
    const Path path = parent.append_child(usd_name(name));
    layer::Spec& spec = layer_.create_spec(path, layer::SpecKind::Prim, loc);
    spec.set_field(fields().specifier, Value(layer::Specifier::Def), loc);
    if (!type.empty()) spec.set_field(fields().type_name, Value(Token(type)), loc);
    return path;
}

Path GraphAuthor::declare(Path prim,
                          const std::string& name,
                          std::string_view type,
                          SourceLoc loc) {
    const Path path = prim.append_property(name);
    if (layer_.has_spec(path)) return path;
    layer::Spec& spec = layer_.create_spec(path, layer::SpecKind::Attribute, loc);
    spec.set_field(fields().type_name, Value(Token(type)), loc);
    return path;
}

void GraphAuthor::connect(Path attribute, Path source, SourceLoc loc) {
    layer_.spec(attribute)->set_field(fields().connection_paths,
                                      Value(layer::PathListOp::make_explicit({source})), loc);
}

void GraphAuthor::set(Path attribute, Value value, SourceLoc loc) {
    layer_.spec(attribute)->set_field(fields().default_value, std::move(value), loc);
}

NodeSignature GraphAuthor::signature(const XmlElement& node) const {
    NodeSignature s{node.name, node.attribute("type"), {}, document_.is_before_139};
    for (const XmlElement& input : node.children) {
        if (input.name == "input") s.inputs[input.attribute("name")] = input.attribute("type");
    }
    return s;
}

/// The definition and the graph that a node of the document's own kind stands for.
std::optional<GraphAuthor::Custom> GraphAuthor::custom_of(const XmlElement& node) const {
    const std::string_view named = node.attribute("nodedef");
    const auto& table = named.empty() ? definitions_by_node_ : definitions_;
    auto it = table.find(named.empty() ? std::string_view(node.name) : named);
    if (it == table.end()) return std::nullopt;
    const XmlElement* definition = it->second;
    if (named.empty()) {
        // Several definitions of one node differ in the type of what comes out
        const auto typed =
            definitions_by_node_.find(node.name + " " + std::string(node.attribute("type")));
        if (typed != definitions_by_node_.end()) definition = typed->second;
    }
    const auto graph = graphs_by_definition_.find(definition->attribute("name"));
    return Custom{definition, graph == graphs_by_definition_.end() ? nullptr : graph->second};
}

std::vector<NodeOutput> GraphAuthor::outputs_of(const XmlElement& node) const {
    const auto custom = custom_of(node);
    std::vector<NodeOutput> outputs;
    if (node.name == "nodegraph" || custom) {
        const XmlElement& source = custom ? *custom->definition : node;
        for (const XmlElement& e : source.children) {
            if (e.name == "output")
                outputs.push_back(
                    {std::string(e.attribute("name")), std::string(e.attribute("type"))});
        }
        if (!outputs.empty()) return outputs;
    }
    return node_outputs(signature(node));
}

/// The output that a port is connected to; empty when it is to none, with a warning where it says
/// that it is.
Path GraphAuthor::source_of(const XmlElement& port,
                            const NodeScope& scope,
                            size_t outputs_followed) {
    const std::string_view node_name = port.attribute("nodename");
    const std::string_view graph_name = port.attribute("nodegraph");
    const std::string_view output = port.attribute("output");
    const Path place = scope.seen_as.is_empty() ? scope.prim : scope.seen_as;
    const XmlElement* target = nullptr;
    if (!graph_name.empty()) {
        target = find_graph(graph_name);
        if (target == nullptr || !scope.is_document) {
            warn(port, "mtlx-missing",
                 fmt::format("nodegraph \"{}\" not found; {} keeps its value", graph_name,
                             port.attribute("name")));
            return Path();
        }
    } else if (!node_name.empty()) {
        target = node_in(*scope.nodes, node_name);
        if (target == nullptr) {
            warn(port, "mtlx-missing",
                 fmt::format("node \"{}\" not found; {} keeps its value", node_name,
                             port.attribute("name")));
            return Path();
        }
    } else if (!output.empty() && scope.is_document) {
        // An output of the document stands for the node that it names
        const auto named = outputs_.find(output);
        if (named == outputs_.end()) {
            warn(port, "mtlx-missing", fmt::format("the document has no output \"{}\"", output));
            return Path();
        }
        if (outputs_followed < max_outputs_in_a_row)
            return source_of(*named->second, scope, outputs_followed + 1);
        warn(port, "mtlx-cycle",
             fmt::format("outputs are chained more than {} times; is there a cycle?",
                         max_outputs_in_a_row));
        return Path();
    } else {
        return Path();
    }
    const std::vector<NodeOutput> outputs = outputs_of(*target);
    const auto named = std::find_if(outputs.begin(), outputs.end(),
                                    [&](const NodeOutput& o) { return o.name == output; });
    if (!output.empty() && named == outputs.end() && outputs.size() > 1) {
        warn(port, "mtlx-missing",
             fmt::format("\"{}\" has no output \"{}\", its first one is used",
                         target->attribute("name"), output));
    }
    const NodeOutput& chosen = named == outputs.end() ? outputs.front() : *named;
    return place.append_child(usd_name(target->attribute("name")))
        .append_property("outputs:" + usd_name(chosen.name));
}

/// The file of an input: below `prefix`, or as it stands where only that exists.
std::string GraphAuthor::file_path(const XmlElement& input,
                                   const std::string& prefix,
                                   std::string value) {
    if (prefix.empty() || value.empty() || value.front() == '/') return value;
    const auto exists = [&](const std::string& name) {
        std::vector<std::string> parts = split_package_path(document_.file);
        parts.back() =
            (std::filesystem::path(parts.back()).parent_path() / name).lexically_normal().string();
        return asset_exists(join_package_path(parts));
    };
    const std::string prefixed = prefix + value;
    if (exists(prefixed) || !exists(value)) return prefixed;
    diagnostics_.note(
        "mtlx-fileprefix", input.loc, "",
        fmt::format("\"{}\" is not below the fileprefix \"{}\" but beside the document", value,
                    prefix));
    return value;
}

void GraphAuthor::author_value(const XmlElement& input,
                               const XmlElement& node,
                               Path attribute,
                               const NodeScope& scope) {
    const std::string_view type = input.attribute("type"), name = input.attribute("name");
    for (const char* unread : {"channels", "member", "valuecurve", "unit"}) {
        if (input.attribute(unread).empty()) continue;
        warn(input, "mtlx-unsupported",
             fmt::format("{} of input {} is not supported; it is ignored", unread, name));
    }
    // UsdUVTexture has colors and numbers: only a mark of its own says which its file holds
    const bool is_uv_texture = node.name == "UsdUVTexture";
    const std::string space =
        is_uv_texture
            ? std::string(input.attribute("colorspace"))
            : inherited(input, "colorspace", inherited(node, "colorspace", scope.color_space));
    const bool is_color = type == "color3" || type == "color4";
    const bool is_image =
        type == "filename" && (is_uv_texture || node.attribute("type").starts_with("color"));
    // A file keeps the mark when an interface hands it in: only the image knows what it holds
    const bool is_handed_in = type == "filename" && !input.attribute("interfacename").empty();
    if (!space.empty() && (is_color || is_image || is_handed_in))
        layer_.spec(attribute)->set_field(fields().color_space, Value(Token(space)), input.loc);
    const bool has_value = std::any_of(input.attributes.begin(), input.attributes.end(),
                                       [](const auto& a) { return a.first == "value"; });
    if (!has_value) return;
    std::string text(input.attribute("value"));
    if (type == "filename") {
        const std::string prefix =
            inherited(input, "fileprefix", inherited(node, "fileprefix", scope.file_prefix));
        text = file_path(input, prefix, std::move(text));
    }
    if (auto value = parse_value(type, text)) {
        set(attribute, *std::move(value), input.loc);
    } else {
        warn(input, "mtlx-value",
             fmt::format("\"{}\" is not a value of type {}, input {} keeps its default", text, type,
                         name));
    }
}

void GraphAuthor::author_input(const XmlElement& input,
                               const XmlElement& node,
                               Path holder,
                               Path reader,
                               const NodeScope& scope) {
    const std::string name = "inputs:" + usd_name(input.attribute("name"));
    const std::string_view type = usd_type(input.attribute("type"));
    author_value(input, node, declare(holder, name, type, input.loc), scope);
    const Path attribute = declare(reader, name, type, input.loc);
    const std::string_view interface_name = input.attribute("interfacename");
    if (!interface_name.empty() && !scope.is_document) {
        const Path outer = scope.prim.append_property("inputs:" + usd_name(interface_name));
        if (layer_.has_spec(outer)) return connect(attribute, outer, input.loc);
        warn(input, "mtlx-missing",
             fmt::format("the graph has no input \"{}\", {} keeps its value", interface_name,
                         input.attribute("name")));
    }
    if (const Path source = source_of(input, scope)) connect(attribute, source, input.loc);
}

std::string GraphAuthor::output_name(const XmlElement& node) const {
    return "outputs:" + usd_name(outputs_of(node).front().name);
}

void GraphAuthor::author_inputs(const XmlElement& node, Path prim, const NodeScope& scope) {
    for (const XmlElement& input : node.children) {
        if (input.name == "input") {
            author_input(input, node, prim, prim, scope);
        } else if (input.name == "parameter") {
            warn(input, "mtlx-unsupported",
                 fmt::format("parameter {} belongs to MaterialX 1.37 and older, expected input; it "
                             "is ignored",
                             input.attribute("name")));
        }
    }
}

Path GraphAuthor::author_node(const XmlElement& node, const NodeScope& scope, bool with_inputs) {
    if (layer_.spec_count() > max_specs) {
        if (!is_too_large_)
            warn(node, "mtlx-too-large",
                 fmt::format("more than {} attributes and prims; the rest is skipped", max_specs));
        is_too_large_ = true;
        return Path();
    }
    const auto custom = custom_of(node);
    if (custom && custom->graph != nullptr) return author_custom(node, *custom, scope, with_inputs);
    const Path prim = define_prim(scope.prim, node.attribute("name"), "Shader", node.loc);
    const std::string id = custom ? std::string(custom->definition->attribute("name"))
                           : node.attribute("nodedef").empty()
                               ? node_definition(signature(node))
                               : std::string(node.attribute("nodedef"));
    const Path info = declare(prim, "info:id", "token", node.loc);
    layer_.spec(info)->set_field(fields().variability, Value(layer::Variability::Uniform),
                                 node.loc);
    set(info, Value(Token(id)), node.loc);
    if (with_inputs) author_inputs(node, prim, scope);
    for (const NodeOutput& output : outputs_of(node))
        declare(prim, "outputs:" + usd_name(output.name), usd_type(output.type), node.loc);
    return prim;
}

/// A copy of the graph that the node stands for.
Path GraphAuthor::author_custom(const XmlElement& node,
                                const Custom& custom,
                                const NodeScope& scope,
                                bool with_inputs) {
    const Path prim = define_prim(scope.prim, node.attribute("name"), "NodeGraph", node.loc);
    if (custom_depth_ >= deepest_custom_node) {
        warn(node, "mtlx-cycle",
             fmt::format("node graphs are nested deeper than {}; is there a cycle?",
                         deepest_custom_node));
        return prim;
    }
    const NodeScope defined{scope.prim, scope.nodes, scope.is_document};
    for (const XmlElement& input : custom.definition->children) {
        if (input.name == "input") author_input(input, *custom.definition, prim, prim, defined);
    }
    if (with_inputs) author_inputs(node, prim, scope);
    ++custom_depth_;
    author_contents(*custom.graph, prim, scope);
    --custom_depth_;
    return prim;
}

void GraphAuthor::author_graph(const XmlElement& graph, Path prim, const NodeScope& outside) {
    for (const XmlElement& input : graph.children) {
        if (input.name == "input") author_input(input, graph, prim, prim, outside);
    }
    author_contents(graph, prim, outside);
}

/// Nodes and outputs of a graph.
void GraphAuthor::author_contents(const XmlElement& graph, Path prim, const NodeScope& outside) {
    const NodeScope scope{prim, &graph.children, false,
                          inherited(graph, "colorspace", outside.color_space),
                          inherited(graph, "fileprefix", outside.file_prefix)};
    for (const XmlElement& e : graph.children) {
        if (e.name == "nodegraph")
            warn(e, "mtlx-unsupported", "a nodegraph within a nodegraph is not supported");
        if (is_node(e)) author_node(e, scope);
    }
    for (const XmlElement& e : graph.children) {
        if (e.name != "output") continue;
        const Path output = declare(prim, "outputs:" + usd_name(e.attribute("name")),
                                    usd_type(e.attribute("type")), e.loc);
        if (const Path source = source_of(e, scope)) connect(output, source, e.loc);
    }
}

void GraphAuthor::author_document(Path root) {
    const NodeScope scope{root, &document_.elements, true};
    for (const XmlElement& e : document_.elements) {
        if (e.name == "nodegraph" && e.attribute("nodedef").empty()) {
            author_graph(e, define_prim(root, e.attribute("name"), "NodeGraph", e.loc), scope);
        } else if (is_node(e) && e.attribute("type") != "surfaceshader" &&
                   e.attribute("type") != "displacementshader" && e.name != "surfacematerial") {
            author_node(e, scope);
        }
    }
}

}  // namespace velatura::usd::materialx
