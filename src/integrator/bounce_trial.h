// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/path_tracer.h"

#include <atomic>
#include <string>
#include <vector>

namespace velatura::integrator {

/// What a trial came to. All but `seconds` is a function of scene, image size and tracer options
/// alone.
struct BounceTrial {
    std::vector<double> shares;  ///< [bounce] of the image's light; the last: all that follow
    RayCounts rays;
    double seconds = 0;

    /// The last bounce up to `max` with that share of the light or more; at least 1, so that
    /// direct light is told from the rest. Without light, and where the trial was stopped: `max`.
    int last_bounce(double share, int max) const;
};

/// "b0 to b3 are stored one by one, the rest in tail; shares of the light: ..."
std::string text_of(const BounceTrial& trial, int last_bounce);

/// Finds out how much light each bounce brings: 8 samples each of up to 4096 pixels spread over the
/// image, whose random numbers the render never meets.
///
/// Args: options of the render to come; `branches` are not looked at. bounces: how many are told
/// apart. stop: ends the trial early.
BounceTrial try_bounces(const World& world,
                        const PathTracerOptions& options,
                        int bounces,
                        const std::atomic<bool>* stop = nullptr);

}  // namespace velatura::integrator
