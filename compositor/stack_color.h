// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/controls.h"
#include "compositor/layer_stack.h"
#include "image/file_color.h"

namespace velatura::compositor {

/// What the numbers of the beauty mean (image/file_color.h). Errors: "unknown-space",
/// "ocio-config".
Result<image::FileColor> color_of_stack(const LayerStack& stack, const Look& look);

}  // namespace velatura::compositor
