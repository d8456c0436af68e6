// SPDX-License-Identifier: Apache-2.0
#include "view/value_edits.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace velatura::view {

std::string float_text(double v) {
    return fmt::format("{}", float(v));
}

std::string color_text(const Vec3d& color) {
    return fmt::format("({}, {}, {})", float_text(color[0]), float_text(color[1]),
                       float_text(color[2]));
}

std::string matrix_text(const Mat4d& m) {
    std::string text = "(";
    for (int row = 0; row < 4; ++row)
        text += fmt::format("{} ({}, {}, {}, {})", row == 0 ? "" : ",", m[row][0], m[row][1],
                            m[row][2], m[row][3]);
    return text + " )";
}

void ValueEdits::set(const std::string& path,
                     const std::string& name,
                     const std::string& type,
                     std::string value,
                     bool is_connected) {
    prims_[path][name] = {type, std::move(value), is_connected};
}

void ValueEdits::set_transform(const std::string& path, const Mat4d& world) {
    set(path, "xformOp:transform:view", "matrix4d", matrix_text(world));
    set(path, "xformOpOrder", "uniform token[]",
        "[\"!resetXformStack!\", \"xformOp:transform:view\"]");
}

void ValueEdits::add(const compositor::bake::Bake& bake) {
    for (const compositor::bake::BakedLight& light : bake.lights) {
        const auto set_input = [&](const char* name, const char* type, std::string value) {
            const auto& connected = light.connected;
            set(light.path, std::string("inputs:") + name, type, std::move(value),
                std::find(connected.begin(), connected.end(), name) != connected.end());
        };
        if (light.intensity) set_input("intensity", "float", float_text(*light.intensity));
        if (light.exposure) set_input("exposure", "float", float_text(*light.exposure));
        if (!light.color) continue;
        const auto& c = *light.color;
        set_input("color", "color3f", color_text({c[0], c[1], c[2]}));
    }
}

std::vector<std::string> ValueEdits::values() const {
    std::vector<std::string> values;
    for (const auto& [path, attributes] : prims_)
        for (const auto& [name, a] : attributes) {
            values.push_back(fmt::format("{} {}.{}={}", a.type, path, name, a.value));
            if (a.is_connected) values.push_back(fmt::format("{}.{}.connect=None", path, name));
        }
    return values;
}

std::vector<PrimEdit> ValueEdits::opinions() const {
    std::vector<PrimEdit> edits;
    for (const auto& [path, attributes] : prims_) {
        PrimEdit edit{path, {}, {}};
        for (const auto& [name, a] : attributes) {
            edit.lines.push_back(fmt::format("{} {} = {}", a.type, name, a.value));
            if (a.is_connected)
                edit.lines.push_back(fmt::format("{} {}.connect = None", a.type, name));
        }
        edits.push_back(std::move(edit));
    }
    return edits;
}

}  // namespace velatura::view
