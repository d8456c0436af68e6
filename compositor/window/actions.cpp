// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/actions.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>
#include <vector>

namespace velatura::compositor::window {

namespace {

constexpr KeyPress plain(int key) {
    return {key, false, false};
}

constexpr KeyPress shift(int key) {
    return {key, false, true};
}

constexpr KeyPress ctrl(int key) {
    return {key, true, false};
}

constexpr KeyPress ctrl_shift(int key) {
    return {key, true, true};
}

// In the order of the help; the first of an action is the one that menus show
constexpr std::array bindings = {
    KeyBinding{ctrl('O'), Action::OpenFile, "Ctrl+O", "Open a file of light layers"},
    KeyBinding{ctrl('L'), Action::OpenPreset, "Ctrl+L", "Load a preset"},
    KeyBinding{ctrl('S'), Action::SavePreset, "Ctrl+S", "Save the look as a preset"},
    KeyBinding{ctrl('E'), Action::SavePicture, "Ctrl+E", "Save the picture (.png, .jpg, .exr)"},
    KeyBinding{ctrl('Q'), Action::Quit, "Ctrl+Q", "Quit"},
    KeyBinding{ctrl('Z'), Action::Undo, "Ctrl+Z", "Undo"},
    KeyBinding{ctrl_shift('Z'), Action::Redo, "Ctrl+Shift+Z", "Redo"},
    KeyBinding{ctrl('Y'), Action::Redo, "Ctrl+Y", "Redo"},
    KeyBinding{plain(key_up), Action::PreviousRow, "Up", "Select the row above"},
    KeyBinding{plain(key_down), Action::NextRow, "Down", "Select the row below"},
    KeyBinding{plain('M'), Action::MuteRow, "M", "Mute the selected row"},
    KeyBinding{plain('S'), Action::SoloRow, "S", "Solo the selected row"},
    KeyBinding{plain(key_right), Action::GainUp, "Right", "Gain of the row up a quarter stop"},
    KeyBinding{plain(key_left), Action::GainDown, "Left", "Gain of the row down a quarter stop"},
    KeyBinding{shift(key_right), Action::GainUpFine, "Shift+Right", "… up a twentieth of a stop"},
    KeyBinding{shift(key_left), Action::GainDownFine, "Shift+Left", "… down a twentieth of a stop"},
    KeyBinding{plain('R'), Action::ResetRow, "R", "Reset the selected row"},
    KeyBinding{ctrl('R'), Action::ResetAll, "Ctrl+R", "Reset the whole look"},
    KeyBinding{plain(']'), Action::ExposureUp, "]", "Exposure up a quarter stop"},
    KeyBinding{plain('['), Action::ExposureDown, "[", "Exposure down a quarter stop"},
    KeyBinding{plain('0'), Action::ExposureReset, "0", "Exposure as rendered"},
    KeyBinding{plain('F'), Action::ZoomFit, "F", "Fit the picture into the window"},
    KeyBinding{plain('1'), Action::ZoomOne, "1",
               "One pixel of the picture per pixel of the screen"},
    KeyBinding{plain('='), Action::ZoomIn, "=", "Zoom in (or the wheel)"},
    KeyBinding{plain('-'), Action::ZoomOut, "-", "Zoom out"},
    KeyBinding{plain('W'), Action::ToggleWipe, "W", "Wipe between look A and look B"},
    KeyBinding{plain('B'), Action::SwitchLook, "B", "Edit the other look"},
    KeyBinding{plain('C'), Action::CopyLook, "C", "Copy this look over the other one"},
    KeyBinding{plain(key_f1), Action::ShowHelp, "F1", "This help"},
    KeyBinding{plain('H'), Action::ShowHelp, "H", "This help"},
};

std::vector<int> keys_in_use() {
    std::vector<int> keys;
    for (const KeyBinding& b : bindings) {
        if (std::find(keys.begin(), keys.end(), b.press.key) == keys.end())
            keys.push_back(b.press.key);
    }
    return keys;
}

}  // namespace

std::span<const KeyBinding> key_bindings() {
    return bindings;
}

std::optional<Action> action_of(const KeyPress& press) {
    const auto at = std::find_if(bindings.begin(), bindings.end(),
                                 [&](const KeyBinding& b) { return b.press == press; });
    if (at == bindings.end()) return std::nullopt;
    return at->action;
}

const char* keys_of(Action action) {
    const auto at = std::find_if(bindings.begin(), bindings.end(),
                                 [&](const KeyBinding& b) { return b.action == action; });
    return at == bindings.end() ? "" : at->keys;
}

std::span<const int> bound_keys() {
    static const std::vector<int> keys = keys_in_use();
    return keys;
}

std::optional<KeyPress> key_press_of(std::string text) {
    constexpr std::array<std::pair<const char*, int>, 8> special = {{{"up", key_up},
                                                                     {"down", key_down},
                                                                     {"left", key_left},
                                                                     {"right", key_right},
                                                                     {"f1", key_f1},
                                                                     {"enter", key_enter},
                                                                     {"escape", key_escape},
                                                                     {"tab", key_tab}}};
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    KeyPress press;
    const auto take = [&text](const std::string& prefix) {
        if (!text.starts_with(prefix)) return false;
        text.erase(0, prefix.size());
        return true;
    };
    press.is_ctrl = take("ctrl+");
    press.is_shift = take("shift+");
    const auto at = std::find_if(special.begin(), special.end(),
                                 [&](const auto& s) { return text == s.first; });
    if (at != special.end()) {
        press.key = at->second;
    } else if (text.size() == 1) {
        press.key = std::toupper(static_cast<unsigned char>(text[0]));
    } else {
        return std::nullopt;
    }
    return press;
}

}  // namespace velatura::compositor::window
