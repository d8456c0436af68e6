// SPDX-License-Identifier: Apache-2.0
#include "app/scene_loader.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "python/process_settings.h"
#include "python/scene_builder.h"
#include "usd/stage/explain.h"
#include "usd/stage/stage.h"

#include <pybind11/stl.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace velatura::python {

namespace {

using usd::stage::TimeCode;

/// A stage with its diagnostics, which outlive it.
struct OpenStage {
    Diagnostics diagnostics;
    std::shared_ptr<const ProcessSettings> settings;
    std::optional<app::LoadedStage> loaded;

    const usd::stage::Stage& stage() const { return loaded->stage; }

    std::string place(const SourceLoc& loc) const {
        const std::string file = diagnostics.file_name(loc.file_id);
        if (loc.line == 0) return file;
        return file + ":" + std::to_string(loc.line) + ":" + std::to_string(loc.column);
    }
};

using StagePtr = std::shared_ptr<OpenStage>;

struct PrimHandle {
    StagePtr stage;
    usd::stage::Prim prim;
};

struct AttributeHandle {
    StagePtr stage;
    usd::stage::Attribute attribute;
};

TimeCode time_of(const std::optional<double>& time) {
    return time ? TimeCode(*time) : TimeCode::default_time();
}

/// The file of the arguments, or `layer` in memory.
StagePtr compose(const app::RenderArguments& arguments,
                 std::shared_ptr<usd::layer::Layer> layer,
                 bool strict) {
    auto opened = std::make_shared<OpenStage>();
    const py::gil_scoped_release release;
    opened->settings = ProcessSettings::lease(arguments.scene, arguments.assets);
    Result<app::LoadedStage> loaded =
        layer ? app::compose_layer(std::move(layer), opened->diagnostics, arguments.assets)
              : app::compose_stage(arguments.scene, opened->diagnostics, arguments.assets);
    if (!loaded) {
        if (loaded.error().code == "usage")
            throw Failure(Failure::Kind::Usage, "usage", loaded.error().message);
        throw failure_of(opened->diagnostics, loaded.error().code, loaded.error().message);
    }
    opened->loaded.emplace(std::move(*loaded));
    if (strict && opened->diagnostics.error_count() > 0)
        throw failure_of(opened->diagnostics, "strict", {});
    return opened;
}

/// Scene options alone: the others are those of a render.
StagePtr open_stage(const py::object& path, bool strict, const py::kwargs& kwargs) {
    static constexpr const char* known[] = {"search_path", "variant",    "set",     "session",
                                            "confine",     "asset_root", "sandbox", "limit"};
    for (const auto& [name, value] : kwargs) {
        const std::string text = py::str(name);
        if (std::find(std::begin(known), std::end(known), text) == std::end(known))
            throw Failure(Failure::Kind::Keyword, "usage",
                          "Stage.open has no option '" + text +
                              "': it takes search_path, variant, set, session, confine, "
                              "asset_root, sandbox, limit and strict");
    }
    const app::RenderArguments arguments = render_arguments(path_of(path), keywords_of(kwargs));
    return compose(arguments, nullptr, strict);
}

/// Of a SceneBuilder, as it is now.
StagePtr stage_of(const SceneBuilder& builder, bool strict) {
    std::shared_ptr<usd::layer::Layer> layer = builder.layer.layer();
    app::RenderArguments arguments;
    arguments.scene = layer->identifier();
    return compose(arguments, std::move(layer), strict);
}

PrimHandle prim_at(const StagePtr& stage, const std::string& path) {
    const usd::stage::Prim prim = stage->stage().prim_at(std::string_view(path));
    if (!prim) throw py::key_error("no prim at <" + path + ">");
    return {stage, prim};
}

AttributeHandle attribute_of(const PrimHandle& p, const std::string& name) {
    const usd::stage::Attribute attribute = p.prim.attribute(name);
    if (!attribute)
        throw py::key_error("<" + p.prim.path_string() + "> has no attribute '" + name + "'");
    return {p.stage, attribute};
}

py::list traverse(const StagePtr& stage) {
    py::list prims;
    usd::stage::traverse(stage->stage().pseudo_root(), [&](usd::stage::Prim prim) {
        if (!prim.is_pseudo_root()) prims.append(py::cast(PrimHandle{stage, prim}));
        return true;
    });
    return prims;
}

/// Opinions on an object, strongest first, as dicts.
py::list opinions(const OpenStage& stage, const std::string& object, std::optional<double> time) {
    const auto explained = usd::stage::explain(stage.stage(), object, time_of(time));
    if (!explained) throw py::key_error(explained.error().message);
    py::list list;
    for (const usd::stage::ExplainedOpinion& o : explained->opinions) {
        py::dict d;
        d["what"] = o.what;
        d["arc"] = o.arc;
        d["layer"] = o.layer;
        d["path"] = o.site;
        d["place"] = stage.place(o.loc);
        d["value"] = o.value;
        d["decides"] = o.decides;
        list.append(d);
    }
    return list;
}

std::string explain(const OpenStage& stage, const std::string& object, std::optional<double> time) {
    const auto explained = usd::stage::explain(stage.stage(), object, time_of(time));
    if (!explained) throw py::key_error(explained.error().message);
    return usd::stage::explanation_text(*explained, stage.diagnostics);
}

template <class Object>
py::object metadata(const Object& object, const std::string& key) {
    const auto value = object.metadata(key);
    return value ? to_python(*value) : py::none();
}

std::vector<std::string> texts(const std::vector<usd::layer::Token>& tokens) {
    std::vector<std::string> out;
    for (const usd::layer::Token& token : tokens) out.push_back(token.str());
    return out;
}

py::list children(const PrimHandle& p) {
    py::list list;
    for (const usd::stage::Prim& child : p.prim.children())
        list.append(py::cast(PrimHandle{p.stage, child}));
    return list;
}

std::vector<std::string> targets(const PrimHandle& p, const std::string& name) {
    const usd::stage::Relationship relationship = p.prim.relationship(name);
    if (!relationship)
        throw py::key_error("<" + p.prim.path_string() + "> has no relationship '" + name + "'");
    std::vector<std::string> paths;
    for (const usd::layer::Path& path : relationship.forwarded_targets())
        paths.push_back(path.to_string());
    return paths;
}

void add_attribute(py::module_& module) {
    py::class_<AttributeHandle>(module, "Attribute", "An attribute of a prim.")
        .def_property_readonly(
            "name", [](const AttributeHandle& a) { return a.attribute.name().str(); },
            "Name, e.g. \"inputs:intensity\".")
        .def_property_readonly(
            "path", [](const AttributeHandle& a) { return a.attribute.path_string(); },
            "Path, e.g. \"/World/Key.inputs:intensity\".")
        .def_property_readonly(
            "type", [](const AttributeHandle& a) { return a.attribute.type_name().str(); },
            "Type name, e.g. \"color3f\".")
        .def_property_readonly(
            "is_authored",
            [](const AttributeHandle& a) { return a.attribute.has_authored_value(); },
            "Whether a layer has a value for it; else it has the fallback of its schema.")
        .def_property_readonly(
            "times", [](const AttributeHandle& a) { return a.attribute.time_samples(); },
            "Times of the strongest time samples.")
        .def_property_readonly(
            "place", [](const AttributeHandle& a) { return a.stage->place(a.attribute.loc()); },
            "file:line:column of the strongest opinion.")
        .def(
            "get",
            [](const AttributeHandle& a, std::optional<double> time) {
                return to_python(a.attribute.value(time_of(time)));
            },
            py::arg("time") = py::none(),
            "Resolved value at a time code; without one, the default value. Arrays are read-only "
            "NumPy arrays that share the stage's memory.")
        .def(
            "opinions",
            [](const AttributeHandle& a, std::optional<double> time) {
                return opinions(*a.stage, a.attribute.path_string(), time);
            },
            py::arg("time") = py::none(), "All opinions, strongest first, as dicts.")
        .def(
            "metadata",
            [](const AttributeHandle& a, const std::string& key) {
                return metadata(a.attribute, key);
            },
            py::arg("key"), "Composed metadata; None: not authored.")
        .def("__repr__", [](const AttributeHandle& a) {
            return "<velatura.Attribute " + a.attribute.path_string() + ">";
        });
}

void add_prim(py::module_& module) {
    py::class_<PrimHandle>(module, "Prim", "A composed prim.")
        .def_property_readonly(
            "path", [](const PrimHandle& p) { return p.prim.path_string(); }, "Absolute path.")
        .def_property_readonly(
            "name", [](const PrimHandle& p) { return p.prim.name().str(); },
            "Last element of the path.")
        .def_property_readonly(
            "type", [](const PrimHandle& p) { return p.prim.type_name().str(); },
            "Type name, e.g. \"Mesh\"; empty for an untyped prim.")
        .def_property_readonly(
            "kind", [](const PrimHandle& p) { return p.prim.kind(); },
            "Kind, e.g. \"component\"; empty: not authored.")
        .def_property_readonly("children", &children, "Children that a renderer traverses.")
        .def_property_readonly(
            "properties", [](const PrimHandle& p) { return texts(p.prim.property_names()); },
            "Names of authored attributes and relationships.")
        .def_property_readonly(
            "api_schemas", [](const PrimHandle& p) { return texts(p.prim.applied_schemas()); },
            "Applied API schemas.")
        .def_property_readonly(
            "variants",
            [](const PrimHandle& p) {
                py::dict selections;
                for (const auto& [set, choice] : p.prim.variant_selections())
                    selections[py::str(set)] = choice;
                return selections;
            },
            "Selected variants by variant set.")
        .def_property_readonly(
            "place", [](const PrimHandle& p) { return p.stage->place(p.prim.loc()); },
            "file:line:column of the strongest spec.")
        .def_property_readonly(
            "stack",
            [](const PrimHandle& p) {
                std::vector<std::tuple<std::string, std::string, std::string>> stack;
                for (const usd::stage::Prim::SpecSite& site : p.prim.prim_stack())
                    stack.emplace_back(site.layer, site.path, p.stage->place(site.loc));
                return stack;
            },
            "Specs that contribute, strongest first: (layer, path, file:line:column).")
        .def(
            "is_a", [](const PrimHandle& p, const std::string& type) { return p.prim.is_a(type); },
            py::arg("type"), "Whether its type is this one or derives from it.")
        .def("attribute", &attribute_of, py::arg("name"),
             "Attribute by name, authored or of the schema. Raises KeyError.")
        .def("__getitem__", &attribute_of, py::arg("name"))
        .def(
            "get",
            [](const PrimHandle& p, const std::string& name, std::optional<double> time) {
                return to_python(p.prim.attribute(name).value(time_of(time)));
            },
            py::arg("name"), py::arg("time") = py::none(),
            "Resolved value of an attribute; None: there is none.")
        .def("targets", &targets, py::arg("name"),
             "Paths that a relationship leads to. Raises KeyError.")
        .def(
            "metadata",
            [](const PrimHandle& p, const std::string& key) { return metadata(p.prim, key); },
            py::arg("key"), "Composed metadata; None: not authored.")
        .def("__repr__",
             [](const PrimHandle& p) { return "<velatura.Prim " + p.prim.path_string() + ">"; });
}

}  // namespace

void add_stage(py::module_& module) {
    py::class_<Message>(module, "Diagnostic", "What is wrong with a scene, and where.")
        .def_readonly("severity", &Message::severity, "\"note\", \"warning\" or \"error\".")
        .def_readonly("code", &Message::code, "Code of docs/reference/messages.md.")
        .def_readonly("file", &Message::file, "File name; empty: not known.")
        .def_readonly("line", &Message::line, "Line, from 1; 0: not known.")
        .def_readonly("column", &Message::column, "Column, from 1; 0: not known.")
        .def_readonly("prim", &Message::prim, "Path of the prim; empty: none.")
        .def_readonly("message", &Message::message, "The message alone.")
        .def("__str__", [](const Message& m) { return m.text; })
        .def("__repr__", [](const Message& m) { return "<velatura.Diagnostic " + m.text + ">"; });
    add_attribute(module);
    add_prim(module);
    py::class_<OpenStage, StagePtr>(module, "Stage", "A composed USD stage.")
        .def_static("open", &open_stage, py::arg("path"), py::kw_only(), py::arg("strict") = false,
                    "Opens and composes a .usda, .usdc, .usd, .usdz or .mtlx file. Options are "
                    "those of `velatura info`: search_path, variant, set, session, confine, "
                    "asset_root, sandbox, limit. Errors of parts of the scene are in "
                    "`diagnostics`; with strict they are raised.")
        .def_static("of", &stage_of, py::arg("builder"), py::kw_only(), py::arg("strict") = false,
                    "Composes the layer of a SceneBuilder as it is now.")
        .def_property_readonly(
            "diagnostics", [](const OpenStage& s) { return to_python(messages_of(s.diagnostics)); },
            "Errors, warnings and notes so far.")
        .def_property_readonly(
            "root",
            [](const StagePtr& s) {
                return PrimHandle{s, s->stage().pseudo_root()};
            },
            "The root of all prims, \"/\".")
        .def("prim", &prim_at, py::arg("path"), "Prim at a path. Raises KeyError.")
        .def("__getitem__", &prim_at, py::arg("path"))
        .def("__contains__",
             [](const OpenStage& s, const std::string& path) {
                 return s.stage().prim_at(std::string_view(path)).is_valid();
             })
        .def("traverse", &traverse, "All prims that a renderer traverses, parents first.")
        .def("opinions", &opinions, py::arg("object"), py::arg("time") = py::none(),
             "Opinions on \"/Prim\", \"/Prim.attribute\" or \"/Prim#metadatum\", strongest first.")
        .def("explain", &explain, py::arg("object"), py::arg("time") = py::none(),
             "The same as text, as `velatura info --explain`.")
        .def(
            "metadata",
            [](const OpenStage& s, const std::string& key) { return metadata(s.stage(), key); },
            py::arg("key"), "Metadata of the stage; None: not authored.")
        .def_property_readonly(
            "layers", [](const OpenStage& s) { return s.stage().layer_files(); },
            "Files of all layers that were opened.")
        .def_property_readonly(
            "up_axis", [](const OpenStage& s) { return s.stage().up_axis(); }, "\"Y\" or \"Z\".")
        .def_property_readonly(
            "meters_per_unit", [](const OpenStage& s) { return s.stage().meters_per_unit(); },
            "Meters per scene unit.")
        .def_property_readonly(
            "start_time", [](const OpenStage& s) { return s.stage().start_time_code(); },
            "First time code.")
        .def_property_readonly(
            "end_time", [](const OpenStage& s) { return s.stage().end_time_code(); },
            "Last time code.")
        .def_property_readonly(
            "frames_per_second", [](const OpenStage& s) { return s.stage().frames_per_second(); },
            "Frames per second.");
}

}  // namespace velatura::python
