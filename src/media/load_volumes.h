// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "media/volume_source.h"
#include "scene/scene.h"

#include <cstddef>

namespace velatura::media {

/// Whether some grid has to be read: of a volume that its optics do not prove to be nothing.
bool needs_grids(const scene::Scene& scene);

/// Reads the grids of all volumes that may be seen. A volume whose density is a level set becomes a
/// shape. A volume with a grid that cannot be read is an
/// error at its field and is taken out of the scene. max_bytes: of all grids together.
void load_volumes(scene::Scene& scene,
                  const VolumeSource& source,
                  size_t max_bytes,
                  Diagnostics& diagnostics);

/// Takes all volumes out that need a grid, with an error at the first and the reason.
void drop_volumes(scene::Scene& scene, const Error& why, Diagnostics& diagnostics);

}  // namespace velatura::media
