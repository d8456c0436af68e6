// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/noise/noise.h"

#include <string>
#include <utility>
#include <vector>

namespace velatura::compositor::cli {

/// What `noise` and `plan` read and say alike.

/// A number above 0 with one of the units or none, in units of the plain number. Errors:
/// "bad-target", which names the option.
Result<double> parse_amount(const std::string& text,
                            const char* option,
                            const std::vector<std::pair<char, double>>& units);

/// `1%` or `0.01`. Errors: "bad-target".
Result<double> parse_target(const std::string& text);

/// Seconds of the render that the statistics of `velatura render --stats` tell of. Errors:
/// "bad-stats", those of read_file.
Result<double> render_seconds(const std::string& path);

std::string percent(double value);
std::string interval(const statistics::RelativeError& error);

/// Shares of the squared error by group, by bounce and by lifted shadow, a line each.
std::string shares_text(const noise::NoiseForecast& forecast);

}  // namespace velatura::compositor::cli
