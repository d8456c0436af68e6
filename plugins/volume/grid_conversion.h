// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "scene/voxel_grid.h"

#include <openvdb/openvdb.h>

#include <cstddef>

namespace velatura::plugins::volume {

struct ConversionOptions {
    bool is_color = false;  ///< three channels stay
    bool is_level_set = false;
    size_t max_bytes = 0;
};

/// The active voxels of a grid of floats, doubles, integers or triples of them as bricks; of a
/// level set also what is below 0. Errors:
/// "volume-grid" where it holds something else, "volume-memory" where that or reading what is not
/// read yet would take more than max_bytes.
Result<scene::VoxelGrid> convert(const openvdb::GridBase& grid, const ConversionOptions& options);

}  // namespace velatura::plugins::volume
