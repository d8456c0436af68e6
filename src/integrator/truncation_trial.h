// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/path_tracer.h"

#include <atomic>
#include <string>

namespace velatura::integrator {

/// What a maximum path depth cuts off. All but `seconds` is a function of scene, image size and
/// tracer options alone.
struct TruncationTrial {
    double share = 0;          ///< of all light of the frame
    double low = 0, high = 0;  ///< 95 % interval
    RayCounts rays;
    double seconds = 0;
};

/// "light of longer paths is missing: about 1.1 % of all light (0.9 to 1.3), measured by ..."
std::string text_of(const TruncationTrial& trial);

/// Traces paths without the limit of options.max_depth > 0, and counts the light of those that are
/// longer. The bounces of an image do not show it: those of a glass can be bright where the ones
/// before are dark. One sample each of up to 262,144 pixels spread over the frame (more where it
/// has less than 1,024 pixels), whose random numbers the render never meets.
///
/// Args: options of the render to come; `branches` are not looked at, and paths find the light of
///       caustics, too, whatever the render finds it by. stop: ends the trial early.
TruncationTrial try_truncation(const World& world,
                               const PathTracerOptions& options,
                               const std::atomic<bool>* stop = nullptr);

}  // namespace velatura::integrator
