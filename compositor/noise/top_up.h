// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "compositor/noise/noise.h"
#include "layers/top_up.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::compositor::noise {

/// What a top-up is to come to. None: the error that the render has with every gain at 1.
struct TopUpGoal {
    std::optional<double> target;   ///< √relMSE of the mix
    std::optional<double> samples;  ///< per pixel in the mean, those that are there included
};

/// Further samples for a mix, and what they bring. Errors fall as the root of the samples.
struct TopUpPlan {
    NoiseForecast forecast;
    double target = 0;       ///< √relMSE that was asked for; 0: samples were
    double samples_now = 0;  ///< per pixel, in the mean
    double error_after = 0;  ///< √relMSE of the mix with the request's samples
    double samples_evenly =
        0;  ///< what every pixel's samples grow to for that error without a request
    layers::TopUpRequest request;
};

/// The priority of every pixel: root of the mean, over its neighbors up to image::top_up_reach
/// away, itself left out, of the squared relative error that one sample leaves in the mix. Of
/// pixels that have one number of samples among them, the sum of errors is least if it is in
/// proportion to that. Args: counts = samples of every pixel.
std::vector<float> top_up_priority(const image::Window& window,
                                   const MixError& mix,
                                   const std::vector<uint64_t>& counts);

/// Errors: those of forecast_noise.
Result<TopUpPlan> plan_top_up(const LayerStack& stack,
                              const std::vector<uint64_t>& counts,
                              const Look& look,
                              const TopUpGoal& goal);

}  // namespace velatura::compositor::noise
