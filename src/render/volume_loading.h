// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "scene/scene.h"

#include <optional>

namespace velatura::render {

/// Reads the grids of the scene's volumes by the plugin, opened when the first scene holds one
/// that may be seen. Volumes without their grids are errors, and are left out. most_gb: memory
/// that grids may take; nothing: half of the machine's.
void load_volumes(scene::Scene& scene, std::optional<double> most_gb, Diagnostics& diagnostics);

}  // namespace velatura::render
