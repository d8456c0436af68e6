// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::scene {

using Vec3i = Imath::V3i;

/// What the numbers of a grid are.
enum class GridKind : uint8_t {
    AsStored,   ///< whatever its file says, densities where it says nothing
    Densities,  ///< or colors, temperatures …: none below 0
    LevelSet,   ///< distances from a surface, below 0 inside
};

/// Numbers at the points of a lattice, which go over into each other trilinearly between them; most
/// of space is one number. Cut into bricks of 8³ cells that each know all points of their cells: a
/// lookup stays within a brick, and the smallest and the largest number of a brick bound what it
/// can give. 16³ bricks form a node; where those are all one number there is none.
///
/// Lattice coordinates count from the first point of the first brick, in cells.
struct VoxelGrid {
    static constexpr int brick_cells = 8;
    static constexpr int brick_points = brick_cells + 1;
    static constexpr int node_bricks = 16;
    static constexpr int node_cells = node_bricks * brick_cells;
    static constexpr uint32_t is_node = 0x80000000u;  ///< bit of an entry of `nodes`

    struct Brick {
        float min = 0, max = 0;  ///< of all channels
        size_t first_value = 0;  ///< into `values`; no meaning where least == most

        bool is_constant() const { return min == max; }
    };

    Mat4d volume_from_lattice;    ///< affine
    Vec3i node_count = Vec3i(0);  ///< along each axis; beyond them the number is that of bricks[0]
    Vec3 box_min = Vec3(0.0f), box_max = Vec3(0.0f);  ///< lattice; the medium is within, see Volume
    bool is_level_set = false;
    int channels = 1;             ///< 1 or 3; a brick of 3 is constant only where they are alike
    std::vector<uint32_t> nodes;  ///< [z][y][x] index into bricks, or with is_node into node_bricks
    std::vector<std::array<uint32_t, node_bricks * node_bricks * node_bricks>> node_entries;
    std::vector<Brick> bricks;  ///< the first is that of empty space
    std::vector<float> values;  ///< [brick with values][z][y][x][channel], brick_points each way

    /// Values of one brick.
    static constexpr size_t brick_values(int channels) {
        return size_t(brick_points) * brick_points * brick_points * size_t(channels);
    }

    size_t bytes() const {
        return nodes.size() * sizeof nodes[0] + node_entries.size() * sizeof node_entries[0] +
               bricks.size() * sizeof bricks[0] + values.size() * sizeof values[0];
    }

    /// Largest number anywhere.
    float max() const;
};

}  // namespace velatura::scene
