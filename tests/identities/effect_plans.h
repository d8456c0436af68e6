// SPDX-License-Identifier: Apache-2.0
// Plans of what render_scene() renders.
#pragma once

#include "integrator/effect_plan.h"

#include <string>
#include <vector>

namespace velatura::test {

inline integrator::PlanOptions plan_of_test() {
    integrator::PlanOptions options;
    options.layers.groups = {{"key", {}, false}};
    options.guiding = integrator::Guiding::Off;
    options.splits = options.is_adaptive = false;
    options.layers.matrix_layers = options.layers.shadow_layers = options.layers.halves = true;
    return options;
}

inline std::string names_of(const std::vector<scene::Effect>& effects) {
    std::string text;
    for (const scene::Effect e : effects) text += std::string(scene::info(e).name) + " ";
    return text;
}

}  // namespace velatura::test
