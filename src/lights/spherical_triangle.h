// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cmath>

namespace velatura::lights {

/// A triangle seen from the origin: its first corner and the edges from there to the other two, the
/// edges as given, free of cancellation.
struct TriangleView {
    Vec3d a;
    Vec3d e1, e2;

    /// Six times the volume that the triangle spans with the origin.
    double triple() const { return std::abs(a.dot(e1.cross(e2))); }
};

/// Solid angle [sr] in [0, 2π], the same from both sides, 0 edge on. Relative error about 1e-15, or
/// 1e-16 / sine of the angle against the plane where that is more.
/// Ref: Van Oosterom & Strackee 1983, "The Solid Angle of a Plane Triangle".
double solid_angle(const TriangleView& view);

/// Point a + x·e1 + y·e2 of the triangle, uniform in the solid angle that it fills; x, y >= 0,
/// x + y <= 1. The relative error of the density is about 1e-16 / the angles that it fills: sample
/// the area of tiny ones instead.
/// Args: solid_angle as above, > 0.
/// Ref: Arvo 1995, "Stratified Sampling of Spherical Triangles"; the vertex on the far side comes
/// from the half angle formula of Van Oosterom & Strackee instead of differences of angles.
Vec2d sample_solid_angle(const TriangleView& view, double solid_angle, const Vec2& u);

/// Point x·e1 + y·e2 of a triangle, uniform in area; x, y >= 0, x + y <= 1.
/// Ref: Heitz 2019, "A Low-Distortion Map Between Triangle and Square".
Vec2d sample_triangle_area(const Vec2& u);

}  // namespace velatura::lights
