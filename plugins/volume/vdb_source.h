// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "media/volume_source.h"

namespace velatura::plugins::volume {

/// Reads grids of .vdb files, and of .vdb members of packages.
class VdbSource final : public media::VolumeSource {
  public:
    Result<scene::VoxelGrid> read(const media::GridRequest& request) const override;
};

}  // namespace velatura::plugins::volume
