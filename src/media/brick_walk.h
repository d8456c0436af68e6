// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/voxel_grid.h"

namespace velatura::media {

/// A part of a ray within one brick, or within a node that is one number.
struct BrickSpan {
    float begin = 0, end = 0;
    const scene::VoxelGrid::Brick* brick = nullptr;
    Vec3 first = Vec3(0.0f);  ///< lattice coordinates of its first point
};

/// The bricks that a ray goes through, one after the other: every span begins where the last one
/// ended, bit for bit, so that lengths add up. Nodes without bricks are one step.
/// Ref: Amanatides & Woo 1987, "A Fast Voxel Traversal Algorithm for Ray Tracing".
class BrickWalk {
  public:
    BrickWalk() = default;

    /// o + t·d in lattice coordinates, for begin <= t < end.
    BrickWalk(const scene::VoxelGrid& grid, const Vec3& o, const Vec3& d, float begin, float end);

    /// One span, as if all were one brick.
    BrickWalk(const scene::VoxelGrid::Brick& whole, float begin, float end)
        : whole_(&whole), t_(begin), end_(end) {}

    /// False: there is no more.
    bool next(BrickSpan& span);

    /// Where the next span begins.
    float t() const { return t_; }

  private:
    const scene::VoxelGrid* grid_ = nullptr;
    const scene::VoxelGrid::Brick* whole_ = nullptr;
    Vec3 o_ = Vec3(0.0f), d_ = Vec3(0.0f), inverse_d_ = Vec3(0.0f);
    float t_ = 0, end_ = 0;
    scene::Vec3i at_ = scene::Vec3i(0);    // brick
    scene::Vec3i step_ = scene::Vec3i(0);  // sign of d
};

/// Cuts [begin, end) of the ray to where it is in the box; false: nowhere.
bool clip_to_box(const Vec3& box_min,
                 const Vec3& box_max,
                 const Vec3& o,
                 const Vec3& d,
                 float& begin,
                 float& end);

}  // namespace velatura::media
