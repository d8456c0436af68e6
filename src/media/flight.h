// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <limits>
#include <utility>
#include <vector>

namespace velatura::media {

class Medium;

/// What happened to light along a segment.
struct Flight {
    const Medium* medium = nullptr;  ///< that it collided with; null: it got through
    float t = std::numeric_limits<float>::infinity();  ///< of the collision
    /// What arrives there or at the end is to be weighed with: 1 in grey matter. The albedo is not
    /// in it.
    Rgb weight = Rgb(1.0f);
    Rgb emitted = Rgb(0.0f);  ///< radiance given on the way, as seen from its start
    bool is_capped = false;   ///< no more was done: nothing arrives at the end
    /// (t, weight from there on), ascending.
    std::vector<std::pair<float, Rgb>> changes;

    /// Weight of what comes from t.
    Rgb weight_at(float at) const {
        Rgb there(1.0f);
        for (const auto& [t_change, changed] : changes) {
            if (t_change >= at) break;
            there = changed;
        }
        return there;
    }

    void clear() {
        medium = nullptr;
        t = std::numeric_limits<float>::infinity();
        weight = Rgb(1.0f);
        emitted = Rgb(0.0f);
        is_capped = false;
        changes.clear();
    }
};

}  // namespace velatura::media
