// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "scene/voxel_grid.h"

#include <string>

namespace velatura::plugins::volume {

/// A grid, or why there is none, as bytes for another process of this machine.
std::string to_bytes(const Result<scene::VoxelGrid>& grid);

/// The other way. Error "volume-file" where the bytes are no grid: whoever wrote them was damaged
/// by what it read.
Result<scene::VoxelGrid> from_bytes(const std::string& bytes);

}  // namespace velatura::plugins::volume
