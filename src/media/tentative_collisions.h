// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "media/brick_walk.h"
#include "media/medium.h"
#include "sampling/random_stream.h"

#include <cmath>

namespace velatura::media {

/// Optical depth to the next point of a Poisson process.
inline double free_path(sampling::RandomStream& numbers) {
    return -std::log1p(-numbers.next());
}

/// Tentative collisions of a ray with a medium (delta tracking): points of a Poisson process whose
/// rate is the majorant of the brick [1/scene unit].
/// Ref: Novák et al. 2018, "Monte Carlo Methods for Volumetric Light Transport Simulation".
class TentativeCollisions {
  public:
    /// begin, end: distances along the ray [scene unit], of Medium::clip().
    TentativeCollisions(const Medium& medium, const Vec3& o, const Vec3& d, float begin, float end)
        : medium_(&medium), o_(o), d_(d), walk_(medium.walk(o, d, begin, end)), t_(begin) {}

    /// Number of the medium's field there.
    float field() const { return medium_->field(span_, o_, d_, t_); }

    /// Where that is, in the space of the ray as it was given.
    Vec3 place() const { return o_ + d_ * t_; }

    const Medium& medium() const { return *medium_; }

    /// Distance of the collision; before the first one, of the boundary of the medium.
    float t() const { return t_; }

    /// Majorant at the collision.
    float rate() const { return rate_; }

    bool has_begun() const { return has_begun_; }

    /// Advances to the next collision; false: the ray leaves the medium without one.
    bool next_collision(sampling::RandomStream& numbers) {
        has_begun_ = true;
        double way = free_path(numbers);
        while (true) {
            // What the span cannot hold is left for the next
            const double rest = double(rate_) * (double(span_.end) - double(t_));
            if (way < rest) {
                t_ = std::fmin(float(double(t_) + way / double(rate_)), span_.end);
                return true;
            }
            way -= rest;
            if (!walk_.next(span_)) return false;
            rate_ = medium_->majorant(*span_.brick);
            t_ = span_.begin;
        }
    }

  private:
    const Medium* medium_;
    Vec3 o_, d_;
    BrickWalk walk_;
    BrickSpan span_;
    float t_, rate_ = 0;
    bool has_begun_ = false;
};

}  // namespace velatura::media
