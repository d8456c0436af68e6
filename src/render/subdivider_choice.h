// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "geometry/subdivider.h"
#include "scene/scene.h"

namespace velatura::render {

/// Subdivider of the subdivision plugin, which is opened for the first scene with a subdivision
/// surface.
/// Returns: nullptr when the scene has none, and when the plugin is missing: one warning at the
///          first such mesh; all of them are rendered as polygons.
const geometry::Subdivider* find_subdivider(const scene::Scene& scene, Diagnostics& diagnostics);

}  // namespace velatura::render
