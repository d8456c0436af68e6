// SPDX-License-Identifier: Apache-2.0
#include "view/light_edits.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::view {

namespace {

/// The shortest text that reads back as the same float, which is what the inputs hold.
std::string number(double v) {
    return fmt::format("{}", float(v));
}

}  // namespace

void LightEdits::add(const compositor::bake::Bake& bake) {
    for (const compositor::bake::BakedLight& light : bake.lights) {
        const auto set = [&](const char* name, const char* type, std::string value) {
            const auto& connected = light.connected;
            lights_[light.path][std::string("inputs:") + name] = {
                type, std::move(value),
                std::find(connected.begin(), connected.end(), name) != connected.end()};
        };
        if (light.intensity) set("intensity", "float", number(*light.intensity));
        if (light.exposure) set("exposure", "float", number(*light.exposure));
        if (!light.color) continue;
        const auto& c = *light.color;
        set("color", "color3f",
            fmt::format("({}, {}, {})", number(c[0]), number(c[1]), number(c[2])));
    }
}

std::vector<std::string> LightEdits::values() const {
    std::vector<std::string> values;
    for (const auto& [path, inputs] : lights_)
        for (const auto& [name, input] : inputs) {
            values.push_back(fmt::format("{} {}.{}={}", input.type, path, name, input.value));
            if (input.is_connected) values.push_back(fmt::format("{}.{}.connect=None", path, name));
        }
    return values;
}

std::vector<PrimEdit> LightEdits::opinions() const {
    std::vector<PrimEdit> edits;
    for (const auto& [path, inputs] : lights_) {
        PrimEdit edit{path, {}, {}};
        for (const auto& [name, input] : inputs) {
            edit.lines.push_back(fmt::format("{} {} = {}", input.type, name, input.value));
            if (input.is_connected)
                edit.lines.push_back(fmt::format("{} {}.connect = None", input.type, name));
        }
        edits.push_back(std::move(edit));
    }
    return edits;
}

}  // namespace velatura::view
