// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/layer_set.h"
#include "scene/scene.h"

namespace velatura::integrator {

/// Layers of the trial paths before a render: the beauty alone, with the light groups that paths
/// deposit into.
film::LayerSet trial_layers(const scene::Scene& scene);

}  // namespace velatura::integrator
