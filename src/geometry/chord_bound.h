// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/bezier.h"

#include <algorithm>
#include <cmath>

namespace velatura::geometry {

/// A straight line and a distance from it that a part of a curve with all around it keeps: tells of
/// most rays that meet its box that they do not meet it, without a root or a division.
class ChordBound {
  public:
    ChordBound() = default;

    /// Of a cubic and what reaches `around` from it.
    ChordBound(const Vec3d c[4], double around) : a_(to_float(c[0])), b_(to_float(c[3])) {
        // No point strays from that at the same u on the chord by more than 3/4 of what the control
        // points do. Ends are rounded to float
        double stray = 0, largest = 0;
        for (int i = 1; i < 3; ++i)
            stray = std::max(stray, (c[i] - mixed(c[0], c[3], i / 3.0)).length());
        for (const Vec3d& end : {c[0], c[3]})
            for (int k = 0; k < 3; ++k) largest = std::max(largest, std::abs(end[k]));
        const double reach = 0.75 * stray + around + 0x1p-22 * largest;
        reach_ = next_float_up(float(reach * (1.0 + 0x1p-20)));
    }

    /// Whether the ray passes it, or ends before it, or begins behind.
    bool is_missed(const Vec3d& o, const Vec3d& d, float t_max) const {
        const Vec3d q = Vec3d(a_) - o, e = Vec3d(b_) - Vec3d(a_), n = d.cross(e);
        const double nn = n.dot(n), dd = d.dot(d), r2 = double(reach_) * double(reach_);
        const auto is_beyond = [](double x, double limit2) { return x > 0.0 && x * x > limit2; };
        // Across the plane of line and chord
        const double height = q.dot(n);
        if (height * height > r2 * nn && nn > 0.0) return true;
        // Along the chord, before its begin and after its end, seen along the line
        const double qd = q.dot(d), ed = e.dot(d), w = qd * ed - q.dot(e) * dd;
        const double along2 = r2 * nn * dd;
        if (is_beyond(-w, along2) || is_beyond(w - nn, along2)) return true;
        return is_beyond(-std::max(qd, qd + ed), r2 * dd) ||
               is_beyond(std::min(qd, qd + ed) - double(t_max) * dd, r2 * dd);
    }

  private:
    Vec3 a_ = Vec3(0.0f), b_ = Vec3(0.0f);
    float reach_ = 0;
};

}  // namespace velatura::geometry
