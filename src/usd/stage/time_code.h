// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>

namespace velatura::usd::stage {

/// A moment on the stage's time line, or "default": the time-less value. Default is not the same as
/// time 0.
class TimeCode {
  public:
    constexpr TimeCode() = default;

    constexpr TimeCode(double value) : value_(value) {}

    static constexpr TimeCode default_time() { return {}; }

    bool is_default() const { return std::isnan(value_); }

    double value() const { return value_; }

  private:
    double value_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace velatura::usd::stage
