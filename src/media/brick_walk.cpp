// SPDX-License-Identifier: Apache-2.0
#include "media/brick_walk.h"

#include "media/voxel_lookup.h"

#include <algorithm>
#include <cmath>

namespace velatura::media {

BrickWalk::BrickWalk(const VoxelGrid& grid, const Vec3& o, const Vec3& d, float begin, float end)
    : grid_(&grid), o_(o), d_(d), t_(begin), end_(end) {
    for (int a = 0; a < 3; ++a) {
        step_[a] = int(d[a] > 0.0f) - int(d[a] < 0.0f);
        inverse_d_[a] = step_[a] != 0 ? 1.0f / d[a] : 0.0f;
        const int count = grid.node_count[a] * VoxelGrid::node_bricks;
        const float brick = std::floor((o[a] + d[a] * begin) / float(VoxelGrid::brick_cells));
        // Rounding may have left the ray just outside of where it begins
        at_[a] = int(std::clamp(brick, 0.0f, float(count - 1)));
    }
}

bool BrickWalk::next(BrickSpan& span) {
    if (!(t_ < end_)) return false;
    if (whole_) {
        span = {t_, end_, whole_, Vec3(0.0f)};
        t_ = end_;
        return true;
    }
    Vec3i node;
    for (int a = 0; a < 3; ++a) {
        if (at_[a] < 0 || at_[a] >= grid_->node_count[a] * VoxelGrid::node_bricks) return false;
        node[a] = at_[a] / VoxelGrid::node_bricks;
    }
    const uint32_t entry = node_at(*grid_, node);
    const bool is_node = (entry & VoxelGrid::is_node) != 0;
    const int size = is_node ? 1 : VoxelGrid::node_bricks;  // bricks
    const Vec3i first = is_node ? at_ : node * VoxelGrid::node_bricks;

    // Find the side where the ray leaves
    float exit = end_;
    int axis = -1;
    for (int a = 0; a < 3; ++a) {
        if (step_[a] == 0) continue;
        const int side = step_[a] > 0 ? first[a] + size : first[a];
        const float t = (float(side * VoxelGrid::brick_cells) - o_[a]) * inverse_d_[a];
        if (t < exit) {
            exit = t;
            axis = a;
        }
    }
    exit = std::max(exit, t_);
    span.begin = t_;
    span.end = exit;
    span.brick = &brick_of(*grid_, entry, at_);
    const Vec3i point = first * VoxelGrid::brick_cells;
    span.first = Vec3(float(point.x), float(point.y), float(point.z));
    t_ = axis < 0 ? end_ : exit;
    if (axis < 0) return true;

    // Enter what is behind it; across a node the ray may have gone on along the other axes
    for (int a = 0; a < 3 && !is_node; ++a) {
        if (a == axis || step_[a] == 0) continue;
        const int there = int(std::floor((o_[a] + d_[a] * exit) / float(VoxelGrid::brick_cells)));
        at_[a] = step_[a] > 0 ? std::clamp(there, at_[a], first[a] + size - 1)
                              : std::clamp(there, first[a], at_[a]);
    }
    at_[axis] = step_[axis] > 0 ? first[axis] + size : first[axis] - 1;
    return true;
}

bool clip_to_box(const Vec3& box_min,
                 const Vec3& box_max,
                 const Vec3& o,
                 const Vec3& d,
                 float& begin,
                 float& end) {
    for (int a = 0; a < 3; ++a) {
        if (d[a] == 0.0f) {
            if (!(o[a] >= box_min[a] && o[a] <= box_max[a])) return false;
            continue;
        }
        const float inverse = 1.0f / d[a];
        const float t0 = (box_min[a] - o[a]) * inverse, t1 = (box_max[a] - o[a]) * inverse;
        begin = std::max(begin, std::min(t0, t1));
        end = std::min(end, std::max(t0, t1));
    }
    return begin < end;
}

}  // namespace velatura::media
