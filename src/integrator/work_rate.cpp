// SPDX-License-Identifier: Apache-2.0
#include "integrator/work_rate.h"

#include <algorithm>
#include <iterator>

namespace velatura::integrator {

void WorkRate::add(double time_s, double work) {
    last_ = {time_s, work};
    constexpr double min_step_s = 0.001, min_growth = 1.01;
    const double before_s = points_.empty() ? 0 : points_.back().time_s;
    if (time_s >= min_growth * before_s + min_step_s) points_.push_back(last_);
}

std::optional<double> WorkRate::seconds_for(double work, double enough) const {
    if (!(work > 0)) return 0.0;
    if (last_.time_s < min_time_s) return std::nullopt;
    // The last point of the earlier half
    const auto later = std::upper_bound(points_.begin(), points_.end(), last_.time_s / 2,
                                        [](double t, const Point& p) { return t < p.time_s; });
    const Point middle = later == points_.begin() ? Point{0, 0} : *std::prev(later);
    const double done = last_.work - middle.work;
    const double wanted = last_.time_s < min_wait_s ? enough : 0.1 * enough;
    if (!(done > 0) || done < wanted) return std::nullopt;
    return work * (last_.time_s - middle.time_s) / done;
}

}  // namespace velatura::integrator
