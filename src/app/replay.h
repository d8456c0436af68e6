// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"
#include "integrator/path_tracer.h"
#include "scene/scene.h"

#include <array>
#include <cstdint>

namespace velatura::app {

/// Traces one sample again and prints every vertex and deposit of its path. Returns an exit code.
int replay_sample(const integrator::PathTracer& tracer,
                  const film::LayerSet& layers,
                  const scene::Scene& scene,
                  const std::array<uint64_t, 3>& x_y_sample);

}  // namespace velatura::app
