// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/traverse.h"
#include "base/math.h"

#include <span>
#include <vector>

namespace velatura::accel {

/// Boxes that together hold what the tree holds: its nodes down to `most` of them or seven more,
/// the largest opened first. Placed one by one they fit closer around a turned prototype than its
/// one box does. Empty for an empty tree.
std::vector<Box3> outline(const WideTree& tree, size_t most);

/// An instance and the box of its placed prototype.
struct PlacedBox {
    InstanceRecord record;
    Vec3d lower, upper;    ///< render space, holds every point that a ray can be found to meet
    double condition = 1;  ///< growth of rounding errors on the way into the prototype and back
};

/// Fills everything but the indices of `placed.record` for a prototype within `boxes`, one at
/// least. The inverse is computed in double. False when the matrix is singular or not finite or a
/// box too large.
bool place(const Mat4& render_from_prototype, std::span<const Box3> boxes, PlacedBox& placed);

/// The ray in the space of the instance's prototype; d is not normalised, so t keeps its meaning.
void enter(const InstanceRecord& instance, const geometry::Ray& ray, Vec3d& o, Vec3d& d);

/// The box in floats, outside of the one in double. False: empty, not finite or too large, and what
/// is in it cannot be hit.
bool round_outward(const Box3d& box, Box3& out);

}  // namespace velatura::accel
