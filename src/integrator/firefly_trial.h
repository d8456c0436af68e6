// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/path_tracer.h"

#include <atomic>
#include <cstdint>
#include <limits>
#include <string>

namespace velatura::integrator {

/// What a firefly guard is chosen for: the samples per pixel that a render will have, or, where
/// that is 0, the error that it is to reach.
struct FireflyGuard {
    double samples = 0;
    double target_error = 0;  ///< √relMSE

    bool operator==(const FireflyGuard&) const = default;
};

/// What a trial came to. All but `seconds` is a function of scene, image size, tracer options and
/// guard alone.
struct FireflyTrial {
    /// Largest channel of one contribution of bounce 2 and later; infinite where there is none.
    /// Where no limit lowers the error, above all that the trial met.
    float limit = std::numeric_limits<float>::infinity();
    double samples = 0;  ///< per pixel that it is chosen for
    /// √relMSE of the light of bounce 2 and later at that number of samples, of the pixels that
    /// were tried: as it is, and with the limit, whose bias it contains.
    double error_without = 0, error_with = 0;
    double bias = 0;  ///< part of error_with that more samples would not lower
    RayCounts rays;
    double seconds = 0;
};

/// "--firefly-guard: no contribution of b2 and later counts above 3.2; ..."
std::string text_of(const FireflyTrial& trial);

/// Finds the limit of one contribution that gives the smallest error: variance over samples, which
/// the limit lowers, plus the squared bias, which it brings. More samples have a higher limit,
/// which grows without end. 16 samples each of up to 4096 pixels spread over the image, whose
/// random numbers the render never meets. The squared bias of a pixel is estimated from its own
/// samples, without what is chance, and the light that rare contributions hold is taken to be
/// missing from all pixels. Light that mirrors and smooth glass alone carry to the camera has no
/// limit.
///
/// Args: options of the render to come; `branches` are not looked at. stop: ends the trial early,
/// without a limit.
FireflyTrial try_fireflies(const World& world,
                           const PathTracerOptions& options,
                           const FireflyGuard& guard,
                           const std::atomic<bool>* stop = nullptr);

}  // namespace velatura::integrator
