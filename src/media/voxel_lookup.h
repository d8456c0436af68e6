// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/voxel_grid.h"

#include <algorithm>
#include <cstdint>

namespace velatura::media {

using scene::Vec3i;
using scene::VoxelGrid;

/// Weights of the eight points around one in a brick.
struct CellPoint {
    /// local: lattice coordinates from the brick's first point; what lies outside is moved in.
    explicit CellPoint(const Vec3& local) {
        for (int a = 0; a < 3; ++a) {
            const float x = std::clamp(local[a], 0.0f, float(VoxelGrid::brick_cells));
            cell[a] = std::min(int(x), VoxelGrid::brick_cells - 1);
            rest[a] = x - float(cell[a]);
        }
    }

    /// One channel there. values: of the brick.
    float operator()(const float* values, int channels, int channel) const {
        constexpr int n = VoxelGrid::brick_points;
        const float* v =
            values + size_t((cell.z * n + cell.y) * n + cell.x) * size_t(channels) + channel;
        const size_t x = size_t(channels), y = n * x, z = n * y;
        const auto between = [](float a, float b, float t) { return a + (b - a) * t; };
        const auto plane = [&](const float* p) {
            return between(between(p[0], p[x], rest.x), between(p[y], p[y + x], rest.x), rest.y);
        };
        return between(plane(v), plane(v + z), rest.z);
    }

    Vec3i cell;
    Vec3 rest;
};

/// Number in a brick at lattice coordinates from its first point.
inline float number_in(const VoxelGrid& grid, const VoxelGrid::Brick& brick, const Vec3& local) {
    if (brick.is_constant()) return brick.min;
    return CellPoint(local)(grid.values.data() + brick.first_value, grid.channels, 0);
}

/// The brick at these brick coordinates within the node, or the one brick that the node is.
inline const VoxelGrid::Brick& brick_of(const VoxelGrid& grid, uint32_t node, const Vec3i& brick) {
    if (!(node & VoxelGrid::is_node)) return grid.bricks[node];
    constexpr int n = VoxelGrid::node_bricks;
    const size_t at = size_t((brick.z % n * n + brick.y % n) * n + brick.x % n);
    return grid.bricks[grid.node_entries[node & ~VoxelGrid::is_node][at]];
}

/// Entry of the node at these node coordinates, which must be there.
inline uint32_t node_at(const VoxelGrid& grid, const Vec3i& node) {
    return grid.nodes[(size_t(node.z) * size_t(grid.node_count.y) + size_t(node.y)) *
                          size_t(grid.node_count.x) +
                      size_t(node.x)];
}

/// Calls use(brick, local) with the brick at lattice coordinates and the place in it.
template <class Use>
auto at_point(const VoxelGrid& grid, const Vec3& p, const Use& use) {
    Vec3i brick;
    for (int a = 0; a < 3; ++a) {
        // Also no number is outside
        const int count = grid.node_count[a] * VoxelGrid::node_bricks;
        if (!(p[a] >= 0.0f && p[a] < float(count * VoxelGrid::brick_cells)))
            return use(grid.bricks[0], Vec3(0.0f));
        brick[a] = int(p[a]) / VoxelGrid::brick_cells;
    }
    const Vec3i first = brick * VoxelGrid::brick_cells;
    const Vec3i node = brick / VoxelGrid::node_bricks;
    return use(brick_of(grid, node_at(grid, node), brick),
               p - Vec3(float(first.x), float(first.y), float(first.z)));
}

/// Number at lattice coordinates.
inline float number_at(const VoxelGrid& grid, const Vec3& p) {
    return at_point(grid, p, [&](const VoxelGrid::Brick& brick, const Vec3& local) {
        return number_in(grid, brick, local);
    });
}

/// Color at lattice coordinates; gray where the grid has one channel.
inline Rgb color_at(const VoxelGrid& grid, const Vec3& p) {
    return at_point(grid, p, [&](const VoxelGrid::Brick& brick, const Vec3& local) {
        if (brick.is_constant()) return Rgb(brick.min);
        const CellPoint cell(local);
        const float* const values = grid.values.data() + brick.first_value;
        if (grid.channels == 1) return Rgb(cell(values, 1, 0));
        return Rgb(cell(values, 3, 0), cell(values, 3, 1), cell(values, 3, 2));
    });
}

}  // namespace velatura::media
