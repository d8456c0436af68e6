// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

namespace velatura::integrator {

/// How fast work goes: by what was done in the later half of the time so far. The beginning, where
/// textures and grids are read and caches are empty, is soon left behind, and as passes double, the
/// later half is about the last pass, which visited every pixel.
class WorkRate {
  public:
    /// Total work done at a time since the start; neither goes back.
    void add(double time_s, double work);

    /// Nothing in the first second, or before `enough` work was done in the later half of the time;
    /// after min_wait_s, a tenth of that will do.
    std::optional<double> seconds_for(double work, double enough) const;

    static constexpr double min_time_s = 1, min_wait_s = 10;

  private:
    struct Point {
        double time_s, work;
    };

    std::vector<Point> points_;  ///< times grow by a hundredth
    Point last_{0, 0};
};

}  // namespace velatura::integrator
