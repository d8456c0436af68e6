// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"

#include <cstddef>

namespace velatura::translate::motion {

/// Maximum number of segments of a motion.
inline constexpr size_t max_segments = 16;
/// Tolerance of linear interpolation between keys, relative to the size of what moves.
inline constexpr double interpolation_tolerance = 0x1p-11;
/// Fraction between two keys where interpolation is tested, in addition to 1/2: full turns between
/// keys, which look like no motion at the keys, are far from full turns there.
inline constexpr double probe_fraction = 0.381966;  // the golden section

/// While it lives, attributes are read at another time, without repeating warnings.
class ScopedTime {
  public:
    ScopedTime(Context& ctx, TimeCode time) : ctx_(ctx), time_(ctx.time), is_quiet_(ctx.is_quiet) {
        ctx_.time = time;
        ctx_.is_quiet = true;
    }

    ScopedTime(const ScopedTime&) = delete;
    ScopedTime& operator=(const ScopedTime&) = delete;

    ~ScopedTime() {
        ctx_.time = time_;
        ctx_.is_quiet = is_quiet_;
    }

  private:
    Context& ctx_;
    TimeCode time_;
    bool is_quiet_;
};

}  // namespace velatura::translate::motion
