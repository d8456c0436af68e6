// SPDX-License-Identifier: Apache-2.0
#include "app/parse_values.h"
#include "base/atomic_file.h"
#include "base/nearest_names.h"
#include "compositor/io/image_name.h"
#include "compositor/look/controls.h"
#include "compositor/mix/fit_look.h"
#include "compositor/mix/mix.h"
#include "compositor/mix/mix_plan.h"
#include "compositor/noise/noise_json.h"
#include "layers/layer_file.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "python/layer_arrays.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace velatura::python {

namespace {

using compositor::Control;
using compositor::Look;

constexpr size_t longest_preset = size_t(1) << 24;  // bytes

constexpr std::array kinds = {Control::Kind::Gain,   Control::Kind::Tint, Control::Kind::Kelvin,
                              Control::Kind::Mute,   Control::Kind::Solo, Control::Kind::Shadow,
                              Control::Kind::Caster, Control::Kind::Clamp};

Failure failure(const Error& error) {
    static constexpr const char* of_usage[] = {
        "bad-gain", "bad-matte", "bad-preset", "no-frame", "unknown-name", "bad-fraction", "usage"};
    const bool is_usage =
        std::find(std::begin(of_usage), std::end(of_usage), error.code) != std::end(of_usage);
    return {is_usage ? Failure::Kind::Usage : Failure::Kind::Error, error.code, error.message};
}

template <class T>
T value_of(Result<T> result) {
    if (!result) throw failure(result.error());
    return std::move(*result);
}

bool is_list(const py::handle& value) {
    return py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value);
}

/// `2`, `+1.5st`; a tint's (1, .9, .8) as `1,0.9,0.8`.
std::string value_text(const py::handle& value) {
    if (!is_list(value)) return py::str(value);
    std::string text;
    for (const py::handle item : value)
        text += (text.empty() ? "" : ",") + std::string(py::str(item));
    return text;
}

void add_control(Look& look, Control::Kind kind, const std::string& target, const py::handle& of) {
    py::object value = py::reinterpret_borrow<py::object>(of);
    std::string matte;
    // (value, "matte")
    if (py::isinstance<py::tuple>(value) && py::len(value) == 2 &&
        py::isinstance<py::str>(value[py::int_(1)])) {
        matte = py::str(value[py::int_(1)]);
        value = value[py::int_(0)];
    }
    Control control = value_of(compositor::make_control(
        kind, target, value.is_none() ? std::string() : value_text(value)));
    control.matte = matte;
    look.controls.push_back(std::move(control));
}

/// gain={"key": "+1st"}, mute=["fill"], mute="fill".
void add_controls(Look& look, Control::Kind kind, const py::handle& values) {
    if (py::isinstance<py::dict>(values)) {
        for (const auto& [target, value] : py::reinterpret_borrow<py::dict>(values))
            add_control(look, kind, py::str(target), value);
        return;
    }
    const bool is_switch = kind == Control::Kind::Mute || kind == Control::Kind::Solo;
    if (!is_switch)
        throw Failure(Failure::Kind::Usage, "usage",
                      fmt::format("{0}: expected a dict, e.g. {0}={{\"key\": \"+1st\"}}",
                                  compositor::name_of(kind)));
    if (!is_list(values)) return add_control(look, kind, py::str(values), py::none());
    for (const py::handle target : values) add_control(look, kind, py::str(target), py::none());
}

Look read_preset(const std::string& path) {
    const std::string text = value_of(read_file(path, longest_preset));
    Result<Look> look = compositor::look_from_json(text);
    if (!look) throw failure({look.error().code, path + ": " + look.error().message});
    return std::move(*look);
}

void add_rows(Look& look, const py::handle& rows) {
    for (const auto& [name, list] : py::reinterpret_borrow<py::dict>(rows)) {
        const Result<void> added =
            compositor::add_rows(look, py::str(name), py::cast<std::vector<std::string>>(list));
        if (!added) throw failure(added.error());
    }
}

/// The controls in the order of the keywords, after those of `base`.
Look look_with(Look look, const py::kwargs& controls) {
    std::vector<std::string> known = {"exposure", "rows", "input_space", "display", "view"};
    for (const Control::Kind kind : kinds) known.emplace_back(compositor::name_of(kind));
    for (const auto& [key, value] : controls) {
        const std::string name = py::str(key);
        const auto kind = std::find_if(kinds.begin(), kinds.end(), [&](Control::Kind k) {
            return name == compositor::name_of(k);
        });
        if (value.is_none()) continue;
        if (kind != kinds.end())
            add_controls(look, *kind, value);
        else if (name == "exposure")
            look.exposure_stops += py::cast<float>(value);
        else if (name == "rows")
            add_rows(look, value);
        else if (name == "input_space")
            look.input_space = py::str(value);
        else if (name == "display")
            look.display = py::str(value);
        else if (name == "view")
            look.view = py::str(value);
        else
            throw Failure(Failure::Kind::Keyword, "usage",
                          fmt::format("unknown control '{}'{}", name, did_you_mean(name, known)));
    }
    if (!(std::abs(look.exposure_stops) <= compositor::largest_stops))
        throw failure({"bad-gain", fmt::format("exposure of {:+} stops; the maximum is {}",
                                               look.exposure_stops, compositor::largest_stops)});
    return look;
}

/// A Look, the path of a preset, or None.
Look look_of(const py::object& look, const py::kwargs& controls) {
    if (look.is_none()) return look_with({}, controls);
    if (py::isinstance<Look>(look)) return look_with(py::cast<Look>(look), controls);
    return look_with(read_preset(path_of(look)), controls);
}

Look fitted(const LayerArrays& layers, Look look, std::optional<double> frame, bool is_lenient) {
    if (compositor::has_keys(look)) {
        if (!frame) throw failure({"no-frame", "the look has keyed values; give frame=N"});
        look = compositor::look_at(std::move(look), *frame);
    }
    return is_lenient ? compositor::mix::fit_look(layers.stack(), look).look : look;
}

image::Image mixed(const LayerArrays& layers, const Look& look, bool with_layers) {
    const auto plan = compositor::mix::plan_mix(layers.stack(), look);
    if (!plan) throw failure(plan.error());
    return compositor::mix::apply_mix(layers.stack(), *plan, look, with_layers);
}

py::array mix(const LayerArrays& layers,
              const py::object& look,
              std::optional<double> frame,
              bool lenient,
              const py::kwargs& controls) {
    const Look asked = look_of(look, controls);
    std::shared_ptr<const LayerArrays> made;
    const LayerArray* beauty = nullptr;
    {
        const py::gil_scoped_release release;
        image::Image image = mixed(layers, fitted(layers, asked, frame, lenient), false);
        made = std::make_shared<const LayerArrays>(
            value_of(compositor::LayerStack::from_image(std::move(image))));
        beauty = made->find("rgba");
    }
    return to_python(made, *beauty);
}

void write_mix(const LayerArrays& layers,
               const py::object& path,
               const py::object& look,
               std::optional<double> frame,
               bool lenient,
               bool with_layers,
               const py::kwargs& controls) {
    const std::string name = path_of(path);
    const Look asked = look_of(look, controls);
    const bool is_linear = compositor::is_exr(name);
    if (with_layers && !is_linear)
        throw failure({"usage", "with_layers needs an .exr, which " + name + " is not"});
    if (!is_linear && !compositor::is_display_image(name))
        throw failure({"usage", name + " is not " + compositor::image_names()});
    const py::gil_scoped_release release;
    const Look at_frame = fitted(layers, asked, frame, lenient);
    const image::Image image = mixed(layers, at_frame, with_layers);
    const Result<void> written = is_linear ? layers::write_image_file(name, image)
                                           : compositor::mix::write_display(name, image, at_frame);
    if (!written) throw failure(written.error());
}

double target_of(const py::object& target) {
    return value_of(app::parse_fraction(std::string(py::str(target))));
}

py::object noise(const LayerArrays& layers,
                 const py::object& look,
                 const py::object& target,
                 std::optional<double> frame,
                 bool lenient,
                 const py::kwargs& controls) {
    const Look asked = look_of(look, controls);
    const std::optional<double> wanted =
        target.is_none() ? std::nullopt : std::optional<double>(target_of(target));
    std::string text;
    {
        const py::gil_scoped_release release;
        const auto forecast = compositor::noise::forecast_noise(
            layers.stack(), fitted(layers, asked, frame, lenient), wanted);
        if (!forecast) throw failure(forecast.error());
        text = compositor::noise::noise_json(*forecast,
                                             compositor::noise::mean_samples(layers.stack()))
                   .dump();
    }
    return from_json(text);
}

void save(const Look& look, const py::object& path) {
    const Result<void> saved = write_file_atomically(path_of(path), compositor::look_to_json(look));
    if (!saved) throw failure(saved.error());
}

}  // namespace

void add_mix(py::module_& module, LayersClass& layers) {
    py::class_<Look>(module, "Look", "What a mix does to rows: gains, tints, mutes, shadow lifts.")
        .def(py::init(&look_of), py::arg("preset") = py::none(),
             "preset: a file of `velatura-comp mix --save-preset`, or a Look, to start from. "
             "Controls by keyword, in their order: gain={\"key\": \"+1.5st\", \"b1\": 2}, "
             "tint={\"fill\": (1, .9, .8)}, kelvin={\"key\": 3200}, mute=[\"rim\"], solo=\"key\", "
             "shadow={\"key\": 0.3}, caster={\"key:Vase\": 0.5}, clamp={\"all\": 1}, exposure=0.5, "
             "rows={\"lamps\": [\"key\", \"fill\"]}. (value, \"MATTE\") limits a control to a "
             "matte. Raises UsageError, TypeError.")
        .def("save", &save, py::arg("path"), "Writes a preset.")
        .def_property_readonly(
            "json", [](const Look& l) { return compositor::look_to_json(l); },
            "The text of a preset.")
        .def_property_readonly(
            "exposure", [](const Look& l) { return l.exposure_stops; }, "Stops.")
        .def(
            "difference",
            [](const Look& a, const Look& b) { return compositor::look_differences(a, b); },
            py::arg("other"),
            "What makes the other look of this one: a line for each control. Empty: both do the "
            "same.");
    layers
        .def("mix", &mix, py::arg("look") = py::none(), py::kw_only(),
             py::arg("frame") = py::none(), py::arg("lenient") = false,
             "The mixed image [height, width, channel], float32, with the bits that "
             "`velatura-comp mix` writes. look: a Look or the path of a preset; controls by "
             "keyword come after it. frame: where keyed values are read. lenient: skips what the "
             "look names and the file lacks. Raises UsageError, Error.")
        .def("write_mix", &write_mix, py::arg("path"), py::arg("look") = py::none(), py::kw_only(),
             py::arg("frame") = py::none(), py::arg("lenient") = false,
             py::arg("with_layers") = false,
             "Writes the mix as scene-linear .exr, with_layers: with all layers, or as .png, .jpg "
             "… through OpenColorIO.")
        .def("noise", &noise, py::arg("look") = py::none(), py::kw_only(),
             py::arg("target") = py::none(), py::arg("frame") = py::none(),
             py::arg("lenient") = false,
             "The predicted noise of a mix, as `velatura-comp noise --json`. Needs halves.");
}

}  // namespace velatura::python
