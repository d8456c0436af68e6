// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/light_tracer.h"

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

namespace velatura::integrator {

/// Result of a trial. All but `seconds` is a function of scene, image size and tracer options
/// alone. Errors are those of one sample per pixel: variance / (mean² + 0.01), mean over the image.
struct LightTrial {
    bool is_used = false;    ///< light tracing lowers the error at equal render time
    double other_error = 0;  ///< of what is left to camera paths
    double path_error = 0;   ///< of the caustics, if camera paths find them
    double light_error = 0;  ///< of the caustics by light tracing, one photon per pixel
    LightEmission emission;  ///< where photons begin, and how many there are
    RayCounts rays;
    double seconds = 0;
};

/// "caustics by light tracing, 0.3 photons per pixel and sample".
std::string text_of(const LightTrial& trial);

/// Trial that finds whether light tracing lowers the error at equal render time, how many photons
/// are best, and where they should begin.
///
/// Camera paths: 16 samples each of up to 64 × 64 pixels, without the light of CausticPaths.
/// Photons: two rounds of 32 for each of these pixels. The first teaches which numbers the second
/// begins with, both teach the render, by the squared error that each photon causes. They also tell
/// the error of camera paths that find the same light, which is too rare for a trial:
/// the second moment ∫ c² / p of paths of contribution c and density p is the mean over photons of
/// their splats times c / p.
/// With the errors V of all else and v of a photon per pixel, and costs C and c in rays, f photons
/// per pixel have the efficiency 1 / ((V + v / f) (C + f c)), whose best f is √(v C / (V c)).
///
/// Args: options of the render to come, with caustic_paths; `branches` are not looked at. stop:
/// ends the trial early, without light tracing.
LightTrial try_light_tracing(const World& world,
                             const PathTracerOptions& options,
                             const std::atomic<bool>* stop = nullptr);

}  // namespace velatura::integrator
