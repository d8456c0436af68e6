// SPDX-License-Identifier: Apache-2.0
#include "translate/light_values.h"

#include "translate/light_inputs.h"
#include "translate/values.h"

#include <unordered_set>

namespace velatura::translate {

namespace {

LightPrimValues values_of(Prim prim, TimeCode time) {
    LightPrimValues v;
    v.path = prim.path_string();
    v.type = prim.type_name().str();
    v.intensity = read_number(light_input(prim, "intensity"), default_intensity(v.type), time);
    v.exposure = read_number(light_input(prim, "exposure"), 0.0, time);
    if (const auto color = read_vector(light_input(prim, "color"), 3, time))
        v.color = {(*color)[0], (*color)[1], (*color)[2]};
    v.uses_color_temperature = read_bool(light_input(prim, "enableColorTemperature"), false, time);
    v.color_temperature = read_number(light_input(prim, "colorTemperature"), 6500.0, time);
    for (const char* name : {"intensity", "exposure", "color"}) {
        if (light_input(prim, name).might_be_time_varying()) v.varying.emplace_back(name);
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
    std::vector<LightPrimValues> out;
    for (const scene::LightGroup& group : scene.groups) {
        for (const std::string& path : group.prims) {
            const Prim prim = stage.prim_at(path);
            if (!prim) continue;
            out.push_back(values_of(prim, time));
            out.back().shows_material = material_shown.contains(path);
        }
    }
    return out;
}

}  // namespace velatura::translate
