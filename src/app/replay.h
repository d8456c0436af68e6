// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/pixel_paths.h"
#include "base/diagnostics.h"
#include "film/film.h"
#include "integrator/path_tracer.h"
#include "scene/scene.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::app {

/// Samples of a pixel that are traced again.
struct ReplayedSamples {
    uint64_t x = 0, y = 0;
    uint64_t first = 0, end = 0;
};

/// Prints every vertex and deposit of the paths. Returns: an exit code.
int print_paths(const integrator::PathTracer& tracer,
                const film::LayerSet& layers,
                const scene::Scene& scene,
                const ReplayedSamples& what);

/// Writes the paths into files, by their extension .json or .usda. Returns: an exit code.
int write_paths(const integrator::PathTracer& tracer,
                const film::LayerSet& layers,
                const integrator::World& world,
                const ReplayedSamples& what,
                const PathsFileInfo& info,
                const std::vector<std::string>& files,
                Diagnostics& diagnostics);

/// The brightest sample of a pixel of the film, traced again.
struct BrightestSample {
    enum class Cause : uint8_t {
        Edge,         ///< of something bright: a pixel near by shows it
        Firefly,      ///< far brighter than the pixels around
        LightTracing  ///< most light of the pixel comes from light paths, of which replay shows
                      ///< none
    };
    uint64_t sample = 0;
    Cause cause = Cause::Edge;
};

BrightestSample brightest_sample(const integrator::PathTracer& tracer,
                                 const film::LayerSet& layers,
                                 const film::Film& film,
                                 int x,
                                 int y);

}  // namespace velatura::app
