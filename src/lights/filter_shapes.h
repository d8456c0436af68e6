// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "lights/light_filter.h"
#include "scene/light_filter.h"

#include <algorithm>
#include <optional>

namespace velatura::lights {

/// What is left of white: 1 − color, not below 0.
inline Rgb inverted(const Rgb& color) {
    return {std::max(1.0f - color.x, 0.0f), std::max(1.0f - color.y, 0.0f),
            std::max(1.0f - color.z, 0.0f)};
}

/// How far a point lies in the box: 1 inside and on its surface, 0 beyond the edges, by a smooth
/// step between.
double coverage(const scene::RoundedBox& box, const Vec3d& p);

/// Where the light of a segment passes the plane z = 0 of a filter.
struct PlaneCrossing {
    Vec2d point;
    bool is_black = false;  ///< no light passes, wherever: FilterProjection::Before::Black
};

/// Nothing: the filter leaves the segment alone.
std::optional<PlaneCrossing> plane_crossing(const scene::FilterProjection& projection,
                                            const FilterSegment& segment);

}  // namespace velatura::lights
