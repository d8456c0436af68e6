// SPDX-License-Identifier: Apache-2.0
#include "media/voxel_builder.h"

#include "base/check.h"

#include <algorithm>
#include <cmath>

namespace velatura::media {

using scene::Vec3i;
using scene::VoxelGrid;

VoxelGridBuilder::VoxelGridBuilder(const Vec3i& node_count,
                                   int channels,
                                   float empty,
                                   bool is_level_set)
    : empty_(std::isfinite(empty) ? empty : 0.0f) {
    grid_.is_level_set = is_level_set;
    grid_.node_count = node_count;
    grid_.channels = channels;
    grid_.nodes.assign(size_t(node_count.x) * size_t(node_count.y) * size_t(node_count.z), 0);
    constant_brick(clean(empty_));
}

float VoxelGridBuilder::clean(float number) const {
    if (grid_.is_level_set) return std::isfinite(number) ? number : empty_;
    return number > 0.0f && std::isfinite(number) ? number : 0.0f;
}

uint32_t VoxelGridBuilder::constant_brick(float number) {
    const auto [at, is_new] = constants_.try_emplace(number, uint32_t(grid_.bricks.size()));
    if (is_new) grid_.bricks.push_back({number, number, 0});
    return at->second;
}

void VoxelGridBuilder::add(const Vec3i& brick, std::span<const float> values) {
    VELATURA_CHECK(values.size() == VoxelGrid::brick_values(grid_.channels),
                   "a brick has 9³ points");
    // Clean the numbers and find their bounds
    const size_t first = grid_.values.size();
    float min = std::numeric_limits<float>::infinity(), max = -min;
    for (const float v : values) {
        const float number = clean(v);
        grid_.values.push_back(number);
        min = std::min(min, number);
        max = std::max(max, number);
    }
    uint32_t id = 0;
    if (min == max) {
        grid_.values.resize(first);
        id = constant_brick(min);
        if (id == 0) return;
    } else {
        id = uint32_t(grid_.bricks.size());
        grid_.bricks.push_back({min, max, first});
    }
    constexpr int n = VoxelGrid::node_bricks;
    const Vec3i node = brick / n;
    uint32_t& entry = grid_.nodes[(size_t(node.z) * size_t(grid_.node_count.y) + size_t(node.y)) *
                                      size_t(grid_.node_count.x) +
                                  size_t(node.x)];
    if (!(entry & VoxelGrid::is_node)) {
        entry = uint32_t(grid_.node_entries.size()) | VoxelGrid::is_node;
        grid_.node_entries.emplace_back().fill(0);
    }
    const size_t at = size_t((brick.z % n * n + brick.y % n) * n + brick.x % n);
    grid_.node_entries[entry & ~VoxelGrid::is_node][at] = id;
}

VoxelGrid VoxelGridBuilder::finish(const Mat4d& volume_from_lattice,
                                   const Vec3& box_min,
                                   const Vec3& box_max) {
    for (uint32_t& entry : grid_.nodes) {
        if (!(entry & VoxelGrid::is_node)) continue;
        const auto& bricks = grid_.node_entries[entry & ~VoxelGrid::is_node];
        const uint32_t id = bricks[0];
        const bool is_one =
            std::all_of(bricks.begin(), bricks.end(), [&](uint32_t b) { return b == id; });
        if (is_one && grid_.bricks[id].is_constant()) entry = id;
    }
    grid_.volume_from_lattice = volume_from_lattice;
    grid_.box_min = box_min;
    grid_.box_max = box_max;
    return std::move(grid_);
}

}  // namespace velatura::media
