// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"

#include <functional>

namespace velatura::app {

/// What is done with a frame that is ready. Returns: an exit code of exit_codes.h.
using FrameFunction =
    std::function<int(const RenderJob& job, const FrameInput& input, Diagnostics& diagnostics)>;

/// Checks the options, opens the scene, and hands over one frame after the other, translated, with
/// its effect plan, and without the effects that are to be left out. Prints diagnostics as they
/// come. Returns: the worst exit code; a signal or wrong usage ends it at once.
int for_each_frame(const RenderArguments& arguments, const FrameFunction& use);

}  // namespace velatura::app
