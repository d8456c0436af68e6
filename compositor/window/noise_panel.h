// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/drawing.h"

namespace velatura::compositor::window {

/// The noise of the active look, what would hold it at that of the render, and where it comes from.
void draw_noise(Drawing& drawing);

}  // namespace velatura::compositor::window
