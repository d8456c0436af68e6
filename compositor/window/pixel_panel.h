// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/drawing.h"

namespace velatura::compositor::window {

/// What every layer stores at the pixel last under the mouse, and what the mix makes of it.
void draw_pixel(Drawing& drawing);

}  // namespace velatura::compositor::window
