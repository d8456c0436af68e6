// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/noise/noise.h"

#include <nlohmann/json_fwd.hpp>

#include <optional>

namespace velatura::compositor::noise {

/// Samples per pixel, mean.
double mean_samples(const LayerStack& stack);

/// What `velatura-comp noise --json` prints: schema, frame, rendered, mix, storage, advice, groups,
/// bounces, lobes where the file tells them apart, shadows.
/// Args: samples: mean_samples(); seconds: that the render took, to predict times; frame: of a
///       sequence.
nlohmann::ordered_json noise_json(const NoiseForecast& forecast,
                                  double samples,
                                  std::optional<double> seconds = {},
                                  std::optional<int> frame = {});

}  // namespace velatura::compositor::noise
