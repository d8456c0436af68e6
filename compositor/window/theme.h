// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <imgui.h>

namespace velatura::compositor::window {

/// Colors by what they say.
namespace color {
inline const ImVec4 accent = {0.93f, 0.69f, 0.36f, 1};  ///< values that were changed
inline const ImVec4 mute = {0.80f, 0.30f, 0.28f, 1};
inline const ImVec4 solo = {0.90f, 0.76f, 0.27f, 1};
inline const ImVec4 text = {0.86f, 0.86f, 0.85f, 1};
inline const ImVec4 dim = {0.55f, 0.55f, 0.54f, 1};
inline const ImVec4 error = {0.95f, 0.52f, 0.45f, 1};
inline const ImVec4 workspace = {0.115f, 0.115f, 0.115f,
                                 1};  ///< neutral: colors are judged beside it
inline const ImVec4 panel = {0.155f, 0.155f, 0.155f, 1};
inline const ImVec4 field = {0.22f, 0.22f, 0.22f, 1};
inline const ImVec4 field_hovered = {0.27f, 0.27f, 0.27f, 1};
inline const ImVec4 line = {0.30f, 0.30f, 0.30f, 1};
}  // namespace color

struct Fonts {
    ImFont* text = nullptr;
    ImFont* small = nullptr;
    ImFont* large = nullptr;
    ImFont* numbers = nullptr;  ///< all digits as wide
};

/// Colors, distances and fonts, for a monitor of that scale (1 = 96 dots per inch). DejaVu from
/// its Debian folder; without it ImGui's own font, which lacks some signs.
Fonts set_up_theme(float scale);

inline ImU32 packed(const ImVec4& c) {
    return ImGui::ColorConvertFloat4ToU32(c);
}

inline ImVec4 with_alpha(ImVec4 c, float alpha) {
    c.w = alpha;
    return c;
}

}  // namespace velatura::compositor::window
