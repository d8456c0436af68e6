// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "geometry/subdivider.h"
#include "scene/scene.h"

namespace velatura::render {

/// What makes the scene's subdivision surfaces: the plugin's, opened when the first scene holds a
/// mesh that asks for it. nullptr where none does, and where the plugin is missing: a warning says
/// so at the first of the meshes, and they are rendered as their polygons.
const geometry::Subdivider* find_subdivider(const scene::Scene& scene, Diagnostics& diagnostics);

}  // namespace velatura::render
