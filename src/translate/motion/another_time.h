// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"

#include <cstddef>

namespace velatura::translate::motion {

/// Maximum number of segments of a motion.
inline constexpr size_t max_segments = 16;
/// How far motion may stray from straight lines, in sizes of what moves.
inline constexpr double straying = 0x1p-11;
/// Where between two keys that is asked for, beside halfway: no number of whole turns, which bring
/// everything back to where it was, is near a whole number there.
inline constexpr double aside = 0.381966;  // the golden section

/// Reads at another time, without complaining again.
class AnotherTime {
  public:
    AnotherTime(Context& ctx, TimeCode time) : ctx_(ctx), time_(ctx.time), is_quiet_(ctx.is_quiet) {
        ctx_.time = time;
        ctx_.is_quiet = true;
    }

    AnotherTime(const AnotherTime&) = delete;
    AnotherTime& operator=(const AnotherTime&) = delete;

    ~AnotherTime() {
        ctx_.time = time_;
        ctx_.is_quiet = is_quiet_;
    }

  private:
    Context& ctx_;
    TimeCode time_;
    bool is_quiet_;
};

}  // namespace velatura::translate::motion
