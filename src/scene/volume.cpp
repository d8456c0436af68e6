// SPDX-License-Identifier: Apache-2.0
#include "scene/volume.h"

#include <algorithm>

namespace velatura::scene {

namespace {

/// A field that nobody read may hold anything.
bool can_be_positive(uint32_t field, const std::vector<VolumeField>& fields) {
    if (field == none) return false;
    const VoxelGrid* const voxels = fields[field].voxels.get();
    return voxels == nullptr || voxels->max() > 0.0f;
}

}  // namespace

float VoxelGrid::max() const {
    float max = 0.0f;
    for (const Brick& brick : bricks) max = std::max(max, brick.max);
    return max;
}

bool is_level_set(const Volume& volume, const std::vector<VolumeField>& fields) {
    if (volume.density == none) return false;
    const VolumeField& field = fields[volume.density];
    return field.voxels ? field.voxels->is_level_set : field.kind == GridKind::LevelSet;
}

bool has_extinction(const Volume& volume, const std::vector<VolumeField>& fields) {
    const VolumeOptics& o = volume.optics;
    return o.density_scale > 0.0f && !is_black(o.extinction_color) &&
           can_be_positive(volume.density, fields);
}

bool has_emission(const Volume& volume, const std::vector<VolumeField>& fields) {
    const VolumeOptics& o = volume.optics;
    if (volume.emission != none)
        return !is_black(o.emission) && can_be_positive(volume.emission, fields);
    const bool absorbs = o.albedo.x < 1.0f || o.albedo.y < 1.0f || o.albedo.z < 1.0f;
    return o.blackbody > 0.0f && absorbs && can_be_positive(volume.temperature, fields) &&
           has_extinction(volume, fields);
}

}  // namespace velatura::scene
