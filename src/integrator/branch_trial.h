// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/branch_map.h"
#include "integrator/path_tracer.h"

#include <atomic>

namespace velatura::integrator {

/// What a trial came to. All but `seconds` is a function of scene, picture size, window and tracer
/// options alone, and what the map says of a pixel is one without the window.
struct BranchTrial {
    BranchMap map;
    RayCounts rays;
    double seconds = 0;
};

/// Finds out where dividing paths pays: what all branches share, the camera ray, the first surface
/// and the lights sampled there, costs time as well but often makes little of the noise.
///
/// Before the render, one pixel of every 8×8 takes 16 samples of two branches each, whose random
/// numbers the render never meets. With the variance V of what comes before the division and v of
/// what each branch brings, and costs C and c in rays, n branches have an efficiency of 1 / ((V + v
/// / n) (C + n c)) (splitting: Arvo & Kirk 1990; the optimum: Bolin & Meyer 1997). Each block of
/// pixels takes the best n by what it and its neighbours came to. Variances are those of runs of
/// eight samples, so that what low-discrepancy points integrate well counts little.
///
/// Args: options of the render to come, whose `branches` are not looked at; a guide is used.
/// window: the pixels to be rendered, not empty; nothing is tried far from them. stop: ends the
/// trial early, with one branch everywhere.
BranchTrial try_branches(const World& world,
                         const PathTracerOptions& options,
                         const film::Window& window,
                         const std::atomic<bool>* stop = nullptr);

}  // namespace velatura::integrator
