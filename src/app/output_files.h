// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"
#include "base/diagnostics.h"
#include "base/output_lock.h"
#include "base/result.h"

#include <optional>
#include <string>

namespace velatura::app {

/// Takes the output for this process, before the render: hours later is too late to find that there
/// is no place for it. Returns: an exit code, Done when it has it.
int take_output(const std::string& path, std::optional<OutputLock>& lock, Diagnostics& diagnostics);

/// That no file of the frame is one that the scene is read from. Errors: "overwrites-input".
Result<void> check_outputs(const FrameInput& input);

}  // namespace velatura::app
