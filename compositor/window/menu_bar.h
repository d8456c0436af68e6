// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/drawing.h"

namespace velatura::compositor::window {

/// Menus, with the file's name beside them.
void draw_menu_bar(Drawing& drawing);

/// What was done last, or what is wrong, and how long the mix took.
void draw_status_line(Drawing& drawing);

}  // namespace velatura::compositor::window
