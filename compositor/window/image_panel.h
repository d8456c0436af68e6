// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/drawing.h"

namespace velatura::compositor::window {

/// Zoom, exposure, display and view, looks: one line.
void draw_toolbar(Drawing& drawing);

/// The image, in what is left of the current window. Wheel: zoom about the mouse; drag: move;
/// double click: between fitting and 1:1; the wipe's line is dragged.
void draw_image(Drawing& drawing);

}  // namespace velatura::compositor::window
