// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"
#include "render/settings.h"

namespace velatura::app {

/// The job's settings with what follows from the frame: its layers, its window, what its plan runs
/// by force, and how much of the memory limit textures may take until it is known what the others
/// need. Of a replay, the window is the one pixel.
render::Settings render_settings(const RenderJob& job, const FrameInput& input);

}  // namespace velatura::app
