// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"
#include "base/diagnostics.h"
#include "base/output_lock.h"
#include "base/result.h"

#include <vector>

namespace velatura::app {

/// Takes the images of a frame for this process, before the render: hours later is too late to find
/// that there is no place for one. Returns: an exit code, Done when it has them.
int take_outputs(const FrameInput& input, std::vector<OutputLock>& locks, Diagnostics& diagnostics);

/// That no file of the frame is one that the scene is read from. Errors: "overwrites-input".
Result<void> check_outputs(const FrameInput& input);

}  // namespace velatura::app
