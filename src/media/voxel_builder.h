// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/voxel_grid.h"

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

/// Grid of the numbers that number(x, y, z) gives at points [0, points) of a lattice of cubes, and
/// of `empty` beyond. Cells have the edge `cell`; the first point is at zero.
template <class Number>
scene::VoxelGrid make_voxel_grid(const scene::Vec3i& points,
                                 float cell,
                                 const Number& number,
                                 float empty = 0.0f,
                                 bool is_level_set = false) {
    using scene::Vec3i;
    using scene::VoxelGrid;
    // One brick beyond on the near side, so that numbers go over into those of empty space
    const auto bricks = [](int n) { return (n + 1) / VoxelGrid::brick_cells + 2; };
    const Vec3i count(bricks(points.x), bricks(points.y), bricks(points.z));
    const auto nodes = [](int n) {
        return (n + VoxelGrid::node_bricks - 1) / VoxelGrid::node_bricks;
    };
    VoxelGridBuilder builder(Vec3i(nodes(count.x), nodes(count.y), nodes(count.z)), 1, empty,
                             is_level_set);
    std::vector<float> values(VoxelGrid::brick_values(1));
    for (int z = 0; z < count.z; ++z)
        for (int y = 0; y < count.y; ++y)
            for (int x = 0; x < count.x; ++x) {
                size_t i = 0;
                const Vec3i first = (Vec3i(x, y, z) - Vec3i(1)) * VoxelGrid::brick_cells;
                for (int c = 0; c < VoxelGrid::brick_points; ++c)
                    for (int b = 0; b < VoxelGrid::brick_points; ++b)
                        for (int a = 0; a < VoxelGrid::brick_points; ++a) {
                            const Vec3i p = first + Vec3i(a, b, c);
                            const bool is_inside = p.x >= 0 && p.y >= 0 && p.z >= 0 &&
                                                   p.x < points.x && p.y < points.y &&
                                                   p.z < points.z;
                            values[i++] = is_inside ? number(p.x, p.y, p.z) : empty;
                        }
                builder.add(Vec3i(x, y, z), values);
            }
    Mat4d volume_from_lattice;
    volume_from_lattice.setScale(Vec3d(double(cell)));
    for (int a = 0; a < 3; ++a) volume_from_lattice[3][a] = -double(cell) * VoxelGrid::brick_cells;
    const float near = float(VoxelGrid::brick_cells - 1);
    return builder.finish(
        volume_from_lattice, Vec3(near),
        Vec3(float(points.x), float(points.y), float(points.z)) + Vec3(near + 1.0f));
}

}  // namespace velatura::media
