// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"

#include <vector>

namespace velatura::app {

/// The job's layers, with the rows of the scene's light mixer, and those that --lpe and the render
/// vars of the first product ask for. Light path expressions that are wrong are left out.
film::LayerSet layers_of(const RenderJob& job, const scene::Scene& scene);

/// The instants at which the motion vectors among the layers ask where things are.
std::vector<scene::MomentKind> moments_of(const film::LayerSet& layers);

/// Says which render vars get no layer, or one under another name, and why. Errors: "lpe", for an
/// --lpe.
Result<void> check_render_vars(const RenderJob& job,
                               const scene::Scene& scene,
                               Diagnostics& diagnostics);

}  // namespace velatura::app
