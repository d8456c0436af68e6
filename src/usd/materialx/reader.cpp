// SPDX-License-Identifier: Apache-2.0
#include "usd/materialx/reader.h"

#include "usd/layer/fields.h"
#include "usd/materialx/document.h"
#include "usd/materialx/graph_author.h"
#include "usd/materialx/values.h"

#include <fmt/format.h>

namespace velatura::usd::materialx {

using layer::fields;
using layer::Path;
using layer::Token;
using layer::Value;

namespace {

/// Makes the materials of a document.
struct MaterialAuthor {
    layer::Layer& layer;
    GraphAuthor& graphs;
    const Document& document;
    Path graphs_root;

    void reference(Path prim, Path target, SourceLoc loc) {
        layer.spec(prim)->set_field(
            fields().references,
            Value(layer::ReferenceListOp::make_explicit({layer::Reference{"", target, {}, {}}})),
            loc);
    }

    /// What an input sees of the graphs: a reference below the material, of one graph or of all.
    Path graphs_for(Path material, const XmlElement& input) {
        const std::string_view name = input.attribute("nodegraph");
        const bool is_connected = !name.empty() || !input.attribute("nodename").empty() ||
                                  !input.attribute("output").empty();
        if (!is_connected) return material;
        const XmlElement* graph = graphs.find_graph(name);
        if (graph != nullptr && GraphAuthor::is_self_contained(*graph)) {
            const Path path = material.append_child(usd_name(name));
            if (layer.has_spec(path)) return material;
            graphs.define_prim(material, name, "NodeGraph", input.loc);
            reference(path, graphs_root.append_child(usd_name(name)), input.loc);
            return material;
        }
        const Path all = material.append_child("NodeGraphs");
        if (!layer.has_spec(all)) {
            graphs.define_prim(material, "NodeGraphs", "", input.loc);
            reference(all, graphs_root, input.loc);
        }
        return all;
    }

    /// A shader of the document as a child of the material, which offers its inputs.
    void author_shader(Path material, const XmlElement& shader, const std::string& output) {
        const NodeScope inside{material, &document.elements, true};
        const Path prim = graphs.author_node(shader, inside, false);
        if (!prim) return;
        // An input of the definition that the document does not set can still be set from outside
        for (const InterfaceInput& input : surface_inputs(shader.name)) {
            const std::string name = "inputs:" + std::string(input.name);
            const Path own = graphs.declare(material, name, usd_type(input.type), shader.loc);
            graphs.connect(graphs.declare(prim, name, usd_type(input.type), shader.loc), own,
                           shader.loc);
        }
        for (const XmlElement& input : shader.children) {
            if (input.name != "input") continue;
            NodeScope scope = inside;
            scope.seen_as = graphs_for(material, input);
            const bool is_offered = layer.has_spec(
                material.append_property("inputs:" + usd_name(input.attribute("name"))));
            graphs.author_input(input, shader, is_offered ? material : prim, prim, scope);
        }
        const Path result = prim.append_property(graphs.output_name(shader));
        graphs.connect(graphs.declare(material, output, "token", shader.loc), result, shader.loc);
    }

    void author(const XmlElement& element, Path materials) {
        const Path material =
            graphs.define_prim(materials, element.attribute("name"), "Material", element.loc);
        for (const XmlElement& input : element.children) {
            if (input.name != "input") continue;
            const std::string_view name = input.attribute("name");
            const XmlElement* shader = graphs.find(input.attribute("nodename"));
            if (name == "backsurfaceshader") {
                graphs.warn(input, "mtlx-unsupported",
                            "backsurfaceshader is not supported, both sides have the front's");
            } else if (shader == nullptr) {
                graphs.warn(input, "mtlx-missing",
                            fmt::format("{} of material {} names no node of the document", name,
                                        element.attribute("name")));
            } else {
                const bool is_surface = name == "surfaceshader";
                author_shader(material, *shader,
                              is_surface ? "outputs:mtlx:surface" : "outputs:mtlx:displacement");
            }
        }
    }
};

}  // namespace

Result<std::shared_ptr<layer::Layer>> read_materialx_layer(const AssetBytesPtr& bytes,
                                                           const std::string& identifier,
                                                           Diagnostics& diagnostics) {
    const Result<Document> document = read_document(bytes->bytes(), identifier, diagnostics);
    if (!document) return document.error();
    auto layer = std::make_shared<layer::Layer>(identifier);
    const uint32_t file_id = diagnostics.file_id(identifier);
    layer->set_file_id(file_id);
    const SourceLoc start{file_id, 1, 1};
    GraphAuthor graphs(*layer, *document, diagnostics);
    layer->pseudo_root().set_field(fields().default_prim, Value(Token("MaterialX")), start);
    const Path root = graphs.define_prim(Path::absolute_root(), "MaterialX", "", start);
    const Path materials = graphs.define_prim(root, "Materials", "", start);
    const Path graphs_root = graphs.define_prim(root, "NodeGraphs", "", start);
    graphs.author_document(graphs_root);
    MaterialAuthor author{*layer, graphs, *document, graphs_root};
    for (const XmlElement& element : document->elements) {
        if (element.name == "surfacematerial") author.author(element, materials);
        // What says where materials go is USD's to say
        for (const char* unread : {"material", "look", "lookgroup", "variantset", "collection",
                                   "geominfo", "volumematerial"}) {
            if (element.name == unread)
                graphs.warn(element, "mtlx-unsupported",
                            fmt::format("<{}> is not supported; it is ignored", unread));
        }
    }
    return layer;
}

}  // namespace velatura::usd::materialx
