// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/drawing.h"

namespace velatura::compositor::window {

/// Lights, bounces, cells and shadows: what a look is made of. Fills the current window.
void draw_mixer(Drawing& drawing);

/// What the look holds beside its rows: nothing that is in force is out of sight.
void draw_advanced(Drawing& drawing);

/// Gains per cell of the bounce × group matrix.
void draw_cells(Drawing& drawing);

/// Shadows to lift, by light and by what casts them, and what a clamp took.
void draw_shadows(Drawing& drawing);

}  // namespace velatura::compositor::window
