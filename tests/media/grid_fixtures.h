// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "media/voxel_builder.h"
#include "scene/scene.h"

#include <memory>
#include <utility>
#include <vector>

namespace velatura::media::testing {

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

/// One number in the box from lo to hi, without soft edges.
inline scene::VoxelGrid constant_box(const Vec3d& lo, const Vec3d& hi, float number) {
    scene::VoxelGrid grid;
    grid.node_count = scene::Vec3i(1);
    grid.nodes = {0};
    grid.bricks = {{number, number, 0}};
    grid.box_max = Vec3(float(scene::VoxelGrid::node_cells));
    for (int a = 0; a < 3; ++a) {
        grid.volume_from_lattice[a][a] = (hi[a] - lo[a]) / scene::VoxelGrid::node_cells;
        grid.volume_from_lattice[3][a] = lo[a];
    }
    return grid;
}

inline uint32_t add_field(scene::Scene& scene, scene::VoxelGrid grid) {
    scene::VolumeField field;
    field.voxels = std::make_shared<const scene::VoxelGrid>(std::move(grid));
    scene.volume_fields.push_back(std::move(field));
    return uint32_t(scene.volume_fields.size() - 1);
}

/// A volume of this density, which scatters nothing until somebody says so.
inline scene::Volume& add_volume(scene::Scene& scene,
                                 scene::VoxelGrid density,
                                 const Mat4d& placed = Mat4d()) {
    scene::Volume volume;
    volume.name = "/Volume";
    volume.density = add_field(scene, std::move(density));
    volume.render_from_volume = placed;
    volume.optics.albedo = Rgb(0.0f);
    scene.volumes.push_back(std::move(volume));
    return scene.volumes.back();
}

}  // namespace velatura::media::testing
