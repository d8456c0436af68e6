// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"
#include "image/file_color.h"

namespace velatura::compositor {
inline namespace look {

/// What the numbers of the beauty mean (image/file_color.h). Errors: "unknown-space",
/// "ocio-config".
Result<image::FileColor> color_of_stack(const LayerStack& stack, const Look& look);

}  // namespace look
}  // namespace velatura::compositor
