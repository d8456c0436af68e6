// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/traverse.h"
#include "base/math.h"

#include <span>
#include <vector>

namespace velatura::accel {

/// Boxes that together hold what the tree holds: its nodes down to `max` of them or seven more,
/// the largest opened first. Placed one by one they fit closer around a turned prototype than its
/// one box does. Empty for an empty tree.
std::vector<Box3> outline(const WideTree& tree, size_t max);

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

/// Instances that move are not there at times at which what their matrix does to rounding errors,
/// PlacedBox::condition, is worse: as they turn inside out, or are flattened to that share.
inline constexpr double worst_moving_condition = 0x1p16;

/// [key] boxes of a prototype within `boxes` that moves: between two keys it is between theirs, as
/// place_at_time places it. False when a matrix is not finite or a box too large.
bool place_keys(std::span<const Mat4> keys,
                std::span<const Box3> boxes,
                std::vector<Box3d>& placed);

/// Fills everything but the indices of `record` for an instance that moves, at a time: its matrix
/// is that of geometry::moved (geometry/motion.h), and it is met as one that stays there. False
/// when it is not there at that time.
bool place_at_time(std::span<const Mat4> keys, float time, InstanceRecord& record);

/// The ray in the space of the instance's prototype; d is not normalized, so t keeps its meaning.
void enter(const InstanceRecord& instance, const geometry::Ray& ray, Vec3d& o, Vec3d& d);

/// The box in floats, outside of the one in double. False: empty, not finite or too large, and what
/// is in it cannot be hit.
bool round_outward(const Box3d& box, Box3& out);

}  // namespace velatura::accel
