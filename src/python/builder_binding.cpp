// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "python/scene_builder.h"
#include "usd/layer/type_name.h"
#include "usd/text/writer.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace velatura::python {

namespace {

using namespace usd::layer;

Path path_at(const std::string& text) {
    const Path path = Path::from(text);
    if (path.is_empty())
        throw Failure(Failure::Kind::Usage, "usd-author",
                      fmt::format("\"{}\" is not the path of a prim or property", text));
    return path;
}

std::vector<Path> paths_at(const std::vector<std::string>& texts) {
    std::vector<Path> paths;
    for (const std::string& text : texts) paths.push_back(path_at(text));
    return paths;
}

void check(const Result<void>& done) {
    if (!done) throw Failure(Failure::Kind::Usage, done.error().code, done.error().message);
}

const TypeInfo& type_at(const std::string& name) {
    const TypeInfo* const type = find_type(name);
    if (!type)
        throw Failure(Failure::Kind::Usage, "usd-author",
                      fmt::format("\"{}\" is not a value type of USD", name));
    return *type;
}

Value value_at(const std::string& type, const py::object& value) {
    return value.is_none() ? Value::block() : from_python(type_at(type), value);
}

void set(SceneBuilder& b,
         const std::string& attribute,
         const py::object& value,
         const std::string& type) {
    check(b.layer.set(path_at(attribute), type, value_at(type, value)));
}

void set_samples(SceneBuilder& b,
                 const std::string& attribute,
                 const std::map<double, py::object>& samples,
                 const std::string& type) {
    std::vector<std::pair<double, Value>> values;
    for (const auto& [time, value] : samples) values.emplace_back(time, value_at(type, value));
    check(b.layer.set_samples(path_at(attribute), type, std::move(values)));
}

std::string text_of(const SceneBuilder& b) {
    return usd::text::write_text_layer(*b.layer.layer());
}

void save(const SceneBuilder& b, const py::object& path) {
    const std::string name = path_of(path);
    if (!name.ends_with(".usda") && !name.ends_with(".usd"))
        throw Failure(Failure::Kind::Usage, "usage",
                      fmt::format("expected a name ending in .usda or .usd, found \"{}\"", name));
    const std::string text = text_of(b);
    const py::gil_scoped_release release;
    if (const Result<void> ok = write_file_atomically(name, text); !ok)
        throw Failure(Failure::Kind::Error, ok.error().code, ok.error().message);
}

}  // namespace

void add_builder(py::module_& module) {
    py::class_<SceneBuilder, std::shared_ptr<SceneBuilder>>(
        module, "SceneBuilder",
        "A USD layer in memory that a script writes. What is there already is replaced.")
        .def(py::init([](const std::string& name) {
                 return std::make_shared<SceneBuilder>(SceneBuilder{LayerBuilder(name)});
             }),
             py::arg("name") = "scene.usda",
             "name: of the layer in messages; asset paths are relative to its folder.")
        .def(
            "define",
            [](SceneBuilder& b, const std::string& prim, const std::string& type) {
                check(b.layer.define(path_at(prim), type));
            },
            py::arg("prim"), py::arg("type") = "",
            "Defines a prim; ancestors that are missing become prims without type.")
        .def("set", &set, py::arg("attribute"), py::arg("value"), py::arg("type"),
             "Sets \"/Prim.attribute\" of a type such as \"float\" or \"point3f[]\". Arrays are "
             "those of NumPy, [n] or [n, components]; None hides the default of the schema.")
        .def("set_samples", &set_samples, py::arg("attribute"), py::arg("samples"), py::arg("type"),
             "Sets values by time code.")
        .def(
            "connect",
            [](SceneBuilder& b, const std::string& attribute,
               const std::vector<std::string>& sources, const std::string& type) {
                check(b.layer.connect(path_at(attribute), type, paths_at(sources)));
            },
            py::arg("attribute"), py::arg("sources"), py::arg("type") = "token",
            "Connects an attribute to others, such as the surface of a Material.")
        .def(
            "set_targets",
            [](SceneBuilder& b, const std::string& relationship,
               const std::vector<std::string>& targets) {
                check(b.layer.set_targets(path_at(relationship), paths_at(targets)));
            },
            py::arg("relationship"), py::arg("targets"), "Sets the targets of a relationship.")
        .def(
            "apply",
            [](SceneBuilder& b, const std::string& prim, const std::string& schema) {
                check(b.layer.apply_schema(path_at(prim), schema));
            },
            py::arg("prim"), py::arg("schema"), "Applies an API schema, such as ShapingAPI.")
        .def(
            "set_metadata",
            [](SceneBuilder& b, const std::string& object, const std::string& key,
               const py::object& value, const std::string& type) {
                check(b.layer.set_metadata(path_at(object), key, value_at(type, value)));
            },
            py::arg("object"), py::arg("key"), py::arg("value"), py::arg("type") = "token",
            "Sets metadata of a prim or property, such as \"interpolation\"; \"/\": of the layer, "
            "such as \"upAxis\".")
        .def(
            "remove",
            [](SceneBuilder& b, const std::string& object) {
                return b.layer.remove(path_at(object));
            },
            py::arg("object"),
            "Removes a prim or property and what is below it. Returns whether it was there.")
        .def(
            "__contains__",
            [](const SceneBuilder& b, const std::string& object) {
                return b.layer.has(path_at(object));
            },
            py::arg("object"))
        .def_property_readonly("text", &text_of, "The layer as .usda.")
        .def("save", &save, py::arg("path"), "Writes the layer as .usda.");
}

}  // namespace velatura::python
