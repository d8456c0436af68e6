// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace velatura::app {

/// Seconds of "90", "90s", "10m", "1.5h". Errors: "bad-duration".
Result<double> parse_duration(std::string_view text);

/// [first, end) of "A:B" with A < B. Errors: "bad-samples".
Result<std::pair<uint64_t, uint64_t>> parse_sample_range(std::string_view text);

/// 0.01 of "1%" or "0.01". Errors: "bad-fraction".
Result<double> parse_fraction(std::string_view text);

/// "off", "auto" or a number of samples per pixel from 1, of --firefly-guard. Errors: "bad-guard".
struct GuardChoice {
    bool is_on = false;
    std::optional<uint64_t> samples;
};

Result<GuardChoice> parse_guard(std::string_view text);

/// Of --bounces: b0 … b<last> are stored one by one.
struct StoredBounces {
    int last = 6;
    /// Of "auto": `last` is the last one with this share of the light, and 6 at most.
    std::optional<double> min_share;
};

/// "0" to "64", "auto" (1 % of the light), "auto=0.5%". Errors: "bad-bounces".
Result<StoredBounces> parse_bounces(std::string_view text);

/// Bytes of "800M", "8G", "1.5GiB" or "50%" of `whole`, above 0: K, M, G and T are powers of 1000,
/// with iB of 1024. Errors: "bad-size".
Result<size_t> parse_size(std::string_view text, size_t whole);

/// The parts of a text between separators; one empty part for an empty text.
std::vector<std::string> split(std::string_view text, char separator);

}  // namespace velatura::app
