// SPDX-License-Identifier: Apache-2.0
#include "integrator/trial_layers.h"

namespace velatura::integrator {

film::LayerSet trial_layers(const scene::Scene& scene) {
    film::LayerSet layers;
    layers.bounce_layers = layers.group_layers = layers.data_layers = false;
    for (const scene::LightGroup& g : scene.groups)
        layers.groups.push_back({g.name, g.prims, g.is_environment});
    return layers;
}

}  // namespace velatura::integrator
