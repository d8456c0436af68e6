// SPDX-License-Identifier: Apache-2.0
#include "translate/light_values.h"

#include "translate/color/color_space.h"
#include "translate/context/values.h"
#include "translate/lights/light_inputs.h"
#include "translate/materials/shader_inputs.h"

#include <algorithm>
#include <unordered_set>

namespace velatura::translate {

namespace {

LightPrimValues values_of(const usd::stage::Stage& stage,
                          Prim prim,
                          const color::WorkingSpace& working,
                          TimeCode time) {
    LightPrimValues v;
    const auto input = [&](const std::string& name) {
        const Attribute own = prim.attribute("inputs:" + name);
        const materials::ShaderSource source = materials::shader_source(stage, own);
        return source.shader || !source.value.is_valid() ? own : source.value;
    };
    v.path = prim.path_string();
    v.type = prim.type_name().str();
    v.intensity = read_number(input("intensity"), lights::default_intensity(v.type), time);
    v.exposure = read_number(input("exposure"), 0.0, time);
    const Attribute color = input("color");
    const auto space = color::color_space_of(color, [](auto&&...) {});
    if (const auto authored = read_vector(color, 3, time)) {
        Vec3d linear((*authored)[0], (*authored)[1], (*authored)[2]);
        linear = working.from(space.value_or(color::ColorSpace()))(linear);
        for (int c = 0; c < 3; ++c)
            v.color[size_t(c)] = space ? std::max(linear[c], 0.0) : linear[c];
    }
    v.has_color_space =
        !working.is_rec709() || (space.has_value() && !space->decoding.is_identity());
    v.uses_color_temperature = read_bool(input("enableColorTemperature"), false, time);
    v.color_temperature = read_number(input("colorTemperature"), 6500.0, time);
    for (const char* name : {"intensity", "exposure", "color"}) {
        if (input(name).might_be_time_varying()) v.varying.emplace_back(name);
        if (prim.attribute(std::string("inputs:") + name).has_authored_connections())
            v.connected.emplace_back(name);
    }
    v.is_in_instance = prim.is_instance_proxy();
    return v;
}

}  // namespace

std::vector<LightPrimValues> light_prim_values(const usd::stage::Stage& stage,
                                               const scene::Scene& scene,
                                               usd::stage::TimeCode time) {
    std::unordered_set<std::string> material_shown;
    for (const scene::MeshLight& light : scene.mesh_lights) {
        if (light.shows_material) material_shown.insert(light.name);
    }
    const auto working = color::WorkingSpace::named(scene.settings.working_space);
    std::vector<LightPrimValues> out;
    for (const scene::LightGroup& group : scene.groups) {
        for (const std::string& path : group.prims) {
            const Prim prim = stage.prim_at(path);
            if (!prim) continue;
            out.push_back(values_of(stage, prim, working.value_or(color::WorkingSpace()), time));
            out.back().shows_material = material_shown.contains(path);
        }
    }
    return out;
}

}  // namespace velatura::translate
