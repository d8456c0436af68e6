// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/voxel_grid.h"

#include <cstdint>
#include <map>
#include <span>

namespace velatura::media {

/// Makes a VoxelGrid of bricks that come in any order. Numbers below 0 and what is none count as 0:
/// no field of a volume has use for them. In a level set what is no number counts as `empty`.
class VoxelGridBuilder {
  public:
    /// node_count: of nodes of 128³ cells, > 0 along each axis. empty: number of bricks that do not
    /// come.
    VoxelGridBuilder(const scene::Vec3i& node_count,
                     int channels,
                     float empty,
                     bool is_level_set = false);

    /// values: [z][y][x][channel], 9 points each way. brick: coordinates of the brick, which must
    /// be within.
    void add(const scene::Vec3i& brick, std::span<const float> values);

    /// The grid: nodes of one number are none. volume_from_lattice and the box, lattice
    /// coordinates, are as given.
    scene::VoxelGrid finish(const Mat4d& volume_from_lattice,
                            const Vec3& box_min,
                            const Vec3& box_max);

  private:
    float clean(float number) const;
    uint32_t constant_brick(float number);

    float empty_;
    scene::VoxelGrid grid_;
    std::map<float, uint32_t> constants_;  // number → brick
};

}  // namespace velatura::media
