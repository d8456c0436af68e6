// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"
#include "integrator/world.h"

namespace velatura::app {

/// What the world of a render is made by. scene: the frame's, or one that more effects were left
/// out of.
integrator::WorldOptions world_options(const RenderJob& job,
                                       const FrameInput& input,
                                       const scene::Scene& scene,
                                       Diagnostics& diagnostics);

}  // namespace velatura::app
