// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <algorithm>
#include <cmath>
#include <utility>

/// A map between the unit square and the sphere under which equal areas have equal solid angles:
/// the octahedron's eight faces, unfolded. Cells of the square stay compact on the sphere, also at
/// its poles. Ref: Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD",
/// journal of graphics tools 13(3).
namespace velatura::guiding {

/// Args: unit vector. Returns: a point in [0, 1]².
inline Vec2 square_from_direction(const Vec3& w) {
    const float x = std::abs(w.x), y = std::abs(w.y), z = std::min(std::abs(w.z), 1.0f);
    // Distance from the pole in the square, and the share of the quarter turn
    const float r = safe_sqrt(1.0f - z);
    const float turn = x == 0.0f && y == 0.0f ? 0.0f : std::atan2(y, x) * (2.0f / pi);
    float v = r * turn;
    float u = r - v;
    // The lower hemisphere lies beyond the square's diagonals
    if (w.z < 0.0f) {
        std::swap(u, v);
        u = 1.0f - u;
        v = 1.0f - v;
    }
    u = std::copysign(u, w.x);
    v = std::copysign(v, w.y);
    return {std::clamp(0.5f * (u + 1.0f), 0.0f, 1.0f), std::clamp(0.5f * (v + 1.0f), 0.0f, 1.0f)};
}

/// Args: a point in [0, 1]². Returns: a unit vector.
inline Vec3 direction_from_square(const Vec2& q) {
    const float u = 2.0f * q.x - 1.0f, v = 2.0f * q.y - 1.0f;
    const float up = std::abs(u), vp = std::abs(v);
    // Positive inside the diamond of the upper hemisphere
    const float signed_distance = 1.0f - (up + vp);
    const float r = 1.0f - std::abs(signed_distance);
    const float phi = r == 0.0f ? 0.25f * pi : ((vp - up) / r + 1.0f) * (0.25f * pi);
    const float z = std::copysign(1.0f - r * r, signed_distance);
    const float s = r * safe_sqrt(2.0f - r * r);
    return {std::copysign(s * std::cos(phi), u), std::copysign(s * std::sin(phi), v), z};
}

}  // namespace velatura::guiding
