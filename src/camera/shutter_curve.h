// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace velatura::camera {

/// How much light a shutter lets through while it is open: from 0 when it begins to open it rises
/// straight to 1, where it is fully open, stays, and falls straight to 0. Times run from 0 to 1.
class ShutterCurve {
  public:
    /// At once.
    ShutterCurve() = default;

    /// Args: 0 <= full <= falling <= 1, the times at which it is fully open and begins to close.
    ShutterCurve(double full, double falling)
        : full_(full), falling_(falling), height_(2 / (1 + falling - full)) {}

    /// Whether times are as likely all the time.
    bool is_box() const { return full_ == 0.0 && falling_ == 1.0; }

    /// A time, as often as light comes through then. u in [0, 1); itself for a box.
    float time(float u) const {
        if (is_box()) return u;
        const double x = u, before = 0.5 * height_ * full_, after = 0.5 * height_ * (1 - falling_);
        if (x < before) return float(std::sqrt(2 * full_ * x / height_));
        if (x > 1 - after) return float(1 - std::sqrt(2 * (1 - falling_) * (1 - x) / height_));
        return float(x / height_ + 0.5 * full_);
    }

  private:
    double full_ = 0, falling_ = 1;
    double height_ = 1;  ///< of a density
};

}  // namespace velatura::camera
