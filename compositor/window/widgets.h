// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/drawing.h"

#include <optional>
#include <string>

namespace velatura::compositor::window {

/// Tells scripts where the item that was just drawn is.
void note_item(Drawing& drawing, const std::string& name);

void text(const std::string& line);
void text(const std::string& line, const ImVec4& color);
/// The next item stands beside the last one, or on a line of its own where it would be cut off.
void next_in_line(float width, float gap);

/// A name, its middle left out where it is wider.
std::string fitted(const std::string& name, float width);
/// The same as a text that is explained by the whole name.
void fitted_text(const std::string& name, float width, const ImVec4& color);

/// Whether the menu is open; Escape closes it.
bool begin_menu(const char* label, bool is_enabled = true);

/// Of a box for any number of stops.
float stops_width();

/// The explanation of the last item, after the mouse has rested on it.
void explain(const char* what);

/// A slider about 0 that is dragged, not set by a click: the value follows the mouse (Shift: ten
/// times finer), a double click resets. Returns: the new value when it changed.
std::optional<float> drag_slider(const char* id, float value, float min, float max, float width);

/// A box for a number of stops to type into.
std::optional<float> stops_box(const char* id, float stops, float width);

/// A small button that stays down.
bool switch_button(const char* id, const char* label, bool is_on, const ImVec4& on_color);

/// A button that is dim where it would do nothing.
bool quiet_button(const char* id, const char* label, bool is_enabled);

/// A thin bar from 0 to 1.
void share_bar(double share, float width, const ImVec4& color);

/// 0.0123 as `1.23 %`.
std::string percent_text(double share);

}  // namespace velatura::compositor::window
