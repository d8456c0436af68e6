// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "scene/scene.h"

#include <optional>

namespace velatura::render {

/// Reads the grids of the scene's visible volumes by the volume plugin, which is opened for the
/// first scene that has one.
/// Args:   max_gb: memory limit of the grids [GB]; nullopt: half of the machine's memory.
/// Errors: a volume without its grids is an error in `diagnostics` and is skipped.
void load_volumes(scene::Scene& scene, std::optional<double> max_gb, Diagnostics& diagnostics);

}  // namespace velatura::render
