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

/// The brightest sample of a pixel of the film, traced again.
struct BrightestSample {
    uint64_t sample = 0;
    /// It is far brighter than the pixels around: a firefly, and no edge of something bright.
    bool is_firefly = false;
};

BrightestSample brightest_sample(const integrator::PathTracer& tracer,
                                 const film::LayerSet& layers,
                                 const film::Film& film,
                                 int x,
                                 int y);

}  // namespace velatura::app
