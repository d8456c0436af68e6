// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "media/voxel_builder.h"
#include "scene/scene.h"

#include <memory>
#include <utility>

namespace velatura::media::testing {

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
