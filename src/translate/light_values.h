// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/scene.h"
#include "usd/stage/stage.h"

#include <array>
#include <string>
#include <vector>

namespace velatura::translate {

/// What a light prim says about its emission, as the renderer reads it (schema fallbacks included).
struct LightPrimValues {
    std::string path;  ///< prim path
    std::string type;  ///< USD type
    double intensity = 1, exposure = 0;
    std::array<double, 3> color = {1, 1, 1};  ///< in the working space
    bool uses_color_temperature = false;
    double color_temperature = 6500;
    std::vector<std::string> varying;  ///< of intensity, exposure, color: those that change in time
    std::vector<std::string> connected;  ///< of those: the ones with connections
    bool has_color_space = false;        ///< `color` is in another space than what is authored
    bool is_in_instance = false;  ///< below a native instance, where no opinion can be authored
    bool shows_material = false;  ///< the camera sees the material's emission, not the light's
};

/// One row per prim of the scene's light groups; prims that the stage does not have are left out.
std::vector<LightPrimValues> light_prim_values(const usd::stage::Stage& stage,
                                               const scene::Scene& scene,
                                               usd::stage::TimeCode time);

}  // namespace velatura::translate
