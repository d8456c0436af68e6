// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/path_tracer.h"
#include "statistics/hidden_light.h"

#include <atomic>

namespace velatura::integrator {

/// Result of a trial. All but `seconds` is a function of scene, image size and tracer options
/// alone.
struct HiddenCaustics {
    statistics::HiddenLight light;
    RayCounts rays;
    double seconds = 0;
};

/// Trial of the caustics that camera paths see in mirrors or through glass. Light tracing cannot
/// connect these to the camera, and paths find them so seldom that the samples of an image may not
/// have met one: no estimate from samples knows of their noise.
///
/// Camera paths record where they meet surfaces with wide lobes after a narrow one; photons, where
/// caustics arrive. The second moment ∫ c² / p of paths of contribution c and density p is the mean
/// over photons of what they bring times c / p, as in LightTrial. What a photon brings to a place
/// is known by the density of photons about it: that blurs the caustics, and leaves their sum.
/// Ref: Jensen 1996, "Global Illumination using Photon Maps" (density of photons).
///
/// Args: options of the render to come, with caustic_paths. stop: ends the trial early, with
/// nothing found.
HiddenCaustics try_hidden_caustics(const World& world,
                                   const PathTracerOptions& options,
                                   const std::atomic<bool>* stop = nullptr);

}  // namespace velatura::integrator
