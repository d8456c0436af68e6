// SPDX-License-Identifier: Apache-2.0
#include "python/bindings.h"
#include "python/conversions.h"
#include "python/layer_arrays.h"

#include <pybind11/stl.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace velatura::python {

namespace {

using LayersPtr = std::shared_ptr<LayerArrays>;

LayersPtr open_layers(const py::object& path, bool foreign, const std::string& view) {
    const std::string name = path_of(path);
    const py::gil_scoped_release release;
    Result<compositor::LayerStack> stack = compositor::LayerStack::load(
        name, foreign ? compositor::ForeignFiles::Plain : compositor::ForeignFiles::Reject, view);
    if (!stack) throw Failure(Failure::Kind::Error, stack.error().code, stack.error().message);
    return std::make_shared<LayerArrays>(std::move(*stack));
}

py::array array_of(const LayersPtr& layers, const std::string& name) {
    const LayerArray* found = nullptr;
    {
        const py::gil_scoped_release release;
        found = layers->find(name);
    }
    if (!found) throw py::key_error("no layer '" + name + "'");
    return to_python(layers, *found);
}

std::vector<std::string> channels_of(const LayerArrays& layers, const std::string& name) {
    const LayerArray* const found = layers.find(name);
    if (!found) throw py::key_error("no layer '" + name + "'");
    return found->channels;
}

bool has_layer(const LayerArrays& layers, const std::string& name) {
    const std::vector<std::string>& names = layers.names();
    return std::find(names.begin(), names.end(), name) != names.end();
}

/// Strings of the header by name; those of Velatura, which are JSON, as objects.
py::dict header_of(const LayerArrays& layers) {
    py::dict header;
    for (const auto& [name, attribute] : layers.stack().image().attributes) {
        const std::string prefix = "velatura/";
        if (const auto* text = std::get_if<std::string>(&attribute))
            header[py::str(name)] =
                name.starts_with(prefix) ? from_json(*text) : py::object(py::str(*text));
        else if (const auto* number = std::get_if<float>(&attribute))
            header[py::str(name)] = double(*number);
        else if (const auto* whole = std::get_if<int>(&attribute))
            header[py::str(name)] = *whole;
        else if (const auto* matrix = std::get_if<image::Matrix44>(&attribute))
            header[py::str(name)] = py::cast(*matrix);
        else if (const auto* colors = std::get_if<image::Chromaticities>(&attribute))
            header[py::str(name)] = py::cast(*colors);
    }
    return header;
}

py::tuple window_of(const image::Window& w) {
    return py::make_tuple(w.x0, w.y0, w.x1, w.y1);
}

}  // namespace

LayersClass add_layers(py::module_& module) {
    LayersClass layers(
        module, "Layers",
        "The layers of a file or of a rendered frame: a mapping of names to read-only NumPy arrays "
        "[height, width, channel], float32 (ids and counts: uint32), row 0 at the top, "
        "scene-linear "
        "and premultiplied. Arrays of one layer share one memory, which lives as long as any of "
        "them.");
    layers
        .def_static("open", &open_layers, py::arg("path"), py::kw_only(),
                    py::arg("foreign") = false, py::arg("view") = "",
                    "Reads a file of light layers; with foreign, also an EXR of another renderer. "
                    "view: of a stereo file. Raises Error.")
        .def("__getitem__", &array_of, py::arg("name"))
        .def("__len__", [](const LayerArrays& l) { return l.names().size(); })
        .def("__iter__", [](const LayerArrays& l) { return py::iter(py::cast(l.names())); })
        .def("__contains__", &has_layer)
        .def(
            "keys", [](const LayerArrays& l) { return l.names(); }, "Names of all layers.")
        .def(
            "items",
            [](const LayersPtr& l) {
                py::list items;
                for (const std::string& name : l->names())
                    items.append(py::make_tuple(name, array_of(l, name)));
                return items;
            },
            "Names and arrays of all layers.")
        .def("channels", &channels_of, py::arg("name"),
             "Channels of a layer, e.g. [\"R\", \"G\", \"B\"].")
        .def_property_readonly(
            "bounces", [](const LayerArrays& l) { return l.stack().column_names(); },
            "Bounces with layers of their own: b0, b1, ..., tail.")
        .def_property_readonly(
            "groups", [](const LayerArrays& l) { return l.stack().group_names(); }, "Light groups.")
        .def_property_readonly("header", &header_of,
                               "Attributes of the file; the strings of Velatura as dicts.")
        .def_property_readonly(
            "window", [](const LayerArrays& l) { return window_of(l.stack().image().data); },
            "Data window (x0, y0, x1, y1), x1 and y1 exclusive: what the arrays cover.")
        .def_property_readonly(
            "display", [](const LayerArrays& l) { return window_of(l.stack().image().display); },
            "Display window: the whole image.");
    return layers;
}

}  // namespace velatura::python
