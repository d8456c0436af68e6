// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

namespace velatura::compositor::window {

/// What a key or a menu entry does.
enum class Action {
    OpenFile,
    Reload,
    Follow,
    Compare,
    EndComparison,
    PreviousFrame,
    NextFrame,
    OpenPreset,
    SavePreset,
    SaveImage,
    ExportNuke,
    ExportOiio,
    ExportBlender,
    BakeLook,
    RequestSamples,
    Quit,
    Undo,
    Redo,
    ResetRow,
    ResetAll,
    PreviousRow,
    NextRow,
    SearchRows,
    MuteRow,
    SoloRow,
    GainUp,
    GainDown,
    GainUpFine,
    GainDownFine,
    ExposureUp,
    ExposureDown,
    ExposureReset,
    ZoomFit,
    ZoomOne,
    ZoomIn,
    ZoomOut,
    ToggleWipe,
    SwitchLook,
    CopyLook,
    ShowColor,
    ShowRed,
    ShowGreen,
    ShowBlue,
    ShowAlpha,
    ShowLuminance,
    PreviousLayer,
    NextLayer,
    FlagPixels,
    ShowStops,
    ShowSamples,
    ShowNoise,
    Denoise,
    TakeSnapshot,
    Freeze,
    SortByPixel,
    PickMatte,
    ShowHelp,
};

/// Keys by their American letter, digit or sign; these have none.
enum SpecialKey : int {
    key_space = ' ',
    key_up = 0x100,
    key_down,
    key_left,
    key_right,
    key_f1,
    key_f5,
    key_page_up,
    key_page_down,
    key_enter,
    key_escape,
    key_tab
};

struct KeyPress {
    int key = 0;  ///< upper case
    bool is_ctrl = false, is_shift = false;

    bool operator==(const KeyPress&) const = default;
};

/// A line of the table of keys, which the menus and the help show too.
struct KeyBinding {
    KeyPress press;
    Action action;
    const char* what;
    std::string keys;  ///< as key_press_of reads them: `Ctrl+Shift+Z`
};

std::span<const KeyBinding> key_bindings();

std::optional<Action> action_of(const KeyPress& press);

/// True for steps, which a key that is held down goes on with; a switch is thrown once.
bool repeats(Action action);

/// How its key is written; empty for an action without.
const char* keys_of(Action action);

/// Keys that the bindings speak of, and the space bar.
std::span<const int> bound_keys();

/// `ctrl+shift+z`, `up`, `f1`, `[`. None for what no key is called.
std::optional<KeyPress> key_press_of(std::string text);

}  // namespace velatura::compositor::window
