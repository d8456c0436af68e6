// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/sample_sums.h"
#include "statistics/stated_error.h"

#include <nlohmann/json_fwd.hpp>

#include <optional>
#include <string>

namespace velatura::layers {

/// metric, mean, low, high, confidence, is_upper, is_lower; half_in_pixels where few pixels hold
/// half of it; hidden where there is such light: square, fourth, is_lower.
nlohmann::ordered_json error_json(const std::optional<statistics::StatedError>& error);

/// Whether that error is a lower bound by hidden light.
bool is_error_hidden(const std::string& stats_json);

/// Entry of the ledger: what firefly clamps removed. `limits`: direct and indirect, those given.
nlohmann::ordered_json clamp_entry(const nlohmann::ordered_json& limits,
                                   const accumulate::SampleSums& sums);

/// velatura/stats of a file of these sums, made from that of one of its parts: the error and what
/// clamps removed are those of the sums, the rest is the same for every part of a render. A text
/// that is no such string is returned as it is.
std::string stats_of_whole(const std::string& stats_of_part, const accumulate::SampleSums& sums);

}  // namespace velatura::layers
