// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "media/brick_walk.h"
#include "media/medium.h"
#include "sampling/random_stream.h"

#include <cmath>

namespace velatura::media {

/// Optical way to the next point of a Poisson process.
inline double free_way(sampling::RandomStream& numbers) {
    return -std::log1p(-numbers.next());
}

/// Where one ray meets one medium: points of a Poisson process whose rate is the majorant of the
/// brick there.
class Meetings {
  public:
    /// begin, end: as Medium::clip() gave them.
    Meetings(const Medium& medium, const Vec3& o, const Vec3& d, float begin, float end)
        : medium_(&medium), walk_(medium.walk(o, d, begin, end)), t_(begin) {}

    const Medium& medium() const { return *medium_; }

    /// Of the meeting; before the first, where the medium begins.
    float t() const { return t_; }

    float rate() const { return rate_; }

    const BrickSpan& span() const { return span_; }

    bool has_begun() const { return has_begun_; }

    /// Goes on to the next meeting; false: there is none.
    bool go_on(sampling::RandomStream& numbers) {
        has_begun_ = true;
        double way = free_way(numbers);
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
    BrickWalk walk_;
    BrickSpan span_;
    float t_, rate_ = 0;
    bool has_begun_ = false;
};

}  // namespace velatura::media
