// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "media/homogeneous_medium.h"

#include <limits>
#include <utility>
#include <vector>

namespace velatura::media {

class Medium;

/// What happened to light along a segment.
struct Flight {
    const Medium* medium = nullptr;  ///< that it collided with; null: none, or what is around
    float t = std::numeric_limits<float>::infinity();  ///< of the collision; else it got through
    Vec3 place = Vec3(0.0f);  ///< of a collision with `medium`: where that is asked for its colors
    /// What arrives there or at the end is to be weighed with: 1 in a gray medium. The albedo is
    /// not in it.
    Rgb weight = Rgb(1.0f);
    Rgb emitted = Rgb(0.0f);  ///< radiance given on the way, as seen from its start
    bool is_capped = false;   ///< no more was done: nothing arrives at the end
    FreePath around =
        {};  ///< through whatever else fills the space; its weights are not in the others
    /// (t, weight from there on), ascending.
    std::vector<std::pair<float, Rgb>> changes;

    bool collides() const { return t < std::numeric_limits<float>::infinity(); }

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
        around = {};
        changes.clear();
    }
};

}  // namespace velatura::media
