// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "scene/voxel_grid.h"

#include <cstddef>
#include <cstdint>
#include <string>

namespace velatura::media {

/// Under this name and version a plugin hands out a `const VolumeSource*`. The version changes
/// whenever this header or a type that it mentions does.
inline constexpr const char* volume_source_interface = "volume_source";
inline constexpr uint32_t volume_source_interface_version = 2;

/// A grid that is wanted.
struct GridRequest {
    std::string file;       ///< or a member of a package: open_asset_bytes()
    std::string grid = {};  ///< name; empty: the only one of the file
    int index = 0;          ///< among the grids of that name
    bool is_color = false;  ///< three channels will do, too
    scene::GridKind kind = scene::GridKind::Densities;
    size_t max_bytes = SIZE_MAX;  ///< that the grid may take; nor may reading it
};

/// What reads grids of voxels from files.
class VolumeSource {
  public:
    virtual ~VolumeSource() = default;

    /// The grid, its numbers those that the file gives at voxel centers. Outside of the box of its
    /// active voxels numbers are that of empty space; what is no number is 0. Densities are not
    /// below 0; the numbers of a level set are outside of it where the file does not tell. Does not
    /// throw.
    /// Thread-safe. Errors: "volume-file" (not there, not readable, cut off), "volume-grid" (no
    /// such grid, or of a type without densities), "volume-memory".
    virtual Result<scene::VoxelGrid> read(const GridRequest& request) const = 0;
};

}  // namespace velatura::media
