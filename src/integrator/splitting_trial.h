// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/path_tracer.h"
#include "integrator/splitting_map.h"

#include <atomic>

namespace velatura::integrator {

/// Result of a trial. All but `seconds` is a function of scene, resolution, window and tracer
/// options; the count of a pixel does not depend on the window.
struct SplittingTrial {
    SplittingMap map;
    RayCounts rays;
    double seconds = 0;
};

/// Trial that finds where path splitting lowers the error at equal render time: the shared prefix
/// (camera ray, first surface, direct light there) costs time but often adds little noise.
///
/// Before the render, one pixel of every 8×8 takes 16 samples of two branches each, whose random
/// numbers the render never meets. With the variance V of what comes before the division and v of
/// what each branch brings, and costs C and c in rays, n branches have an efficiency of 1 / ((V + v
/// / n) (C + n c)) (splitting: Arvo & Kirk 1990; the optimum: Bolin & Meyer 1997). Each block of
/// pixels takes the best n by what it and its neighbors came to. Variances are those of runs of
/// eight samples, so that what low-discrepancy points integrate well counts little.
///
/// Args: options of the render to come, whose `branches` are not looked at; a guide is used.
/// window: the pixels to be rendered, not empty; nothing is tried far from them. stop: ends the
/// trial early, with one branch everywhere.
SplittingTrial try_splitting(const World& world,
                             const PathTracerOptions& options,
                             const film::Window& window,
                             const std::atomic<bool>* stop = nullptr);

}  // namespace velatura::integrator
