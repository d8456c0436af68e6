// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/surface_point.h"

#include <optional>

namespace velatura::geometry {

/// A thin strand at a point of its surface, seen as one thing that light scatters at. Render space.
struct Fiber {
    Vec3 along;  ///< unit, from root to tip
    Vec3 ng;     ///< unit, across the fiber: of its surface
    /// Where across the fiber, from −1 to 1: the sine of the angle about `along` from the normal of
    /// a round fiber there to the direction that looks. Of ribbons as if they were as round as
    /// wide.
    float h = 0;
};

/// The fiber at a point seen from wo; the point may be one that across_fiber() made. Nothing where
/// there is no curve.
std::optional<Fiber> fiber_at(const scene::Scene& scene, const SurfacePoint& point, const Vec3& wo);

/// The point in place of one on a round fiber from which rays leave it on whichever side they go
/// to, so that what light does inside a fiber happens there and none is met from within. The point
/// is on the axis, and p_error reaches to the surface. Nothing of ribbons and what is no fiber:
/// rays leave from the point itself.
std::optional<SurfacePoint> across_fiber(const scene::Scene& scene, const SurfacePoint& point);

}  // namespace velatura::geometry
