// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/path_tracer.h"
#include "integrator/roulette_gains.h"

#include <atomic>

namespace velatura::integrator {

/// What a trial came to. All but `seconds` is a function of scene, image size and tracer options
/// alone.
struct RouletteTrial {
    RouletteGains gains;  ///< powers of √2
    RayCounts rays;
    double seconds = 0;
};

/// Finds out by how much chances to end paths pay: a path that ends early saves rays, and makes the
/// others count more.
///
/// Before the render, one in 36 pixels, at most 4096, takes 16 samples, whose random numbers the
/// render never meets. With V the variance of a sample and C its cost in rays, ending
/// paths after k scatterings, of which one that carries a brings T by c more rays, adds
/// a T² / gain to V and a · gain · c to C: the product is least for gain² = (E[T² / a] / E[a c]) ·
/// C / V (Bolin & Meyer 1997, "An error metric for Monte Carlo ray tracing"; Rath et al. 2022,
/// "EARS: Efficiency-Aware Russian Roulette and Splitting", with caches where this has one number
/// per k). Squares are relative to the pixel, as in docs/engineering/numerics.md; V is that of runs
/// of eight samples, so that what low-discrepancy points integrate well counts little.
///
/// Args: options of the render to come, whose roulette is Roulette::Efficiency; `roulette` and
/// `branches` are not looked at. stop: ends the trial early, with the usual gain.
RouletteTrial try_roulette(const World& world,
                           const PathTracerOptions& options,
                           const std::atomic<bool>* stop = nullptr);

}  // namespace velatura::integrator
