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

/// Keys without a letter.
constexpr std::array<std::pair<const char*, int>, 12> special_keys = {{{"Space", key_space},
                                                                       {"Up", key_up},
                                                                       {"Down", key_down},
                                                                       {"Left", key_left},
                                                                       {"Right", key_right},
                                                                       {"F1", key_f1},
                                                                       {"F5", key_f5},
                                                                       {"PageUp", key_page_up},
                                                                       {"PageDown", key_page_down},
                                                                       {"Enter", key_enter},
                                                                       {"Escape", key_escape},
                                                                       {"Tab", key_tab}}};

std::string lower(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return text;
}

std::string text_of(const KeyPress& press) {
    const auto at = std::find_if(special_keys.begin(), special_keys.end(),
                                 [&](const auto& s) { return press.key == s.second; });
    const std::string key = at != special_keys.end() ? at->first : std::string(1, char(press.key));
    return std::string(press.is_ctrl ? "Ctrl+" : "") + (press.is_shift ? "Shift+" : "") + key;
}

// In the order of the help; the first of an action is the one that menus show
std::vector<KeyBinding> make_bindings() {
    std::vector<KeyBinding> bindings = {
        {ctrl('O'), Action::OpenFile, "Open a file of light layers", {}},
        {plain(key_f5), Action::Reload, "Read the file again, the look stays", {}},
        {shift(key_f5), Action::Follow, "Follow the file: read it when it is replaced", {}},
        {plain(key_page_up), Action::PreviousFrame, "The frame before, the look stays", {}},
        {plain(key_page_down), Action::NextFrame, "The next frame, the look stays", {}},
        {ctrl('L'), Action::OpenPreset, "Load a preset", {}},
        {ctrl('S'), Action::SavePreset, "Save the look as a preset", {}},
        {ctrl('E'), Action::SaveImage, "Save the image (.png, .jpg, .exr)", {}},
        {ctrl('Q'), Action::Quit, "Quit", {}},
        {ctrl('Z'), Action::Undo, "Undo", {}},
        {ctrl_shift('Z'), Action::Redo, "Redo", {}},
        {ctrl('Y'), Action::Redo, "Redo", {}},
        {plain(key_up), Action::PreviousRow, "Select the row above", {}},
        {plain(key_down), Action::NextRow, "Select the row below", {}},
        {ctrl('F'), Action::SearchRows, "Search rows by name", {}},
        {plain('M'), Action::MuteRow, "Mute the selected row", {}},
        {plain('S'), Action::SoloRow, "Solo the selected row", {}},
        {plain(key_right), Action::GainUp, "Gain of the row up a quarter stop", {}},
        {plain(key_left), Action::GainDown, "Gain of the row down a quarter stop", {}},
        {shift(key_right), Action::GainUpFine, "… up a twentieth of a stop", {}},
        {shift(key_left), Action::GainDownFine, "… down a twentieth of a stop", {}},
        {shift('R'), Action::ResetRow, "Reset the selected row", {}},
        {ctrl('R'), Action::ResetAll, "Reset the whole look", {}},
        {plain(']'), Action::ExposureUp, "Exposure up a quarter stop", {}},
        {plain('['), Action::ExposureDown, "Exposure down a quarter stop", {}},
        {plain('0'), Action::ExposureReset, "Exposure as rendered", {}},
        {plain('F'), Action::ZoomFit, "Fit the image to the window", {}},
        {plain('1'), Action::ZoomOne, "One image pixel per screen pixel", {}},
        {plain('='), Action::ZoomIn, "Zoom in (or the wheel)", {}},
        {plain('-'), Action::ZoomOut, "Zoom out", {}},
        {plain('W'), Action::ToggleWipe, "Wipe between look A and look B", {}},
        {plain('X'), Action::SwitchLook, "Edit the other look", {}},
        {plain('C'), Action::CopyLook, "Copy this look over the other one", {}},
        {plain('R'), Action::ShowRed, "Red alone; again: all channels", {}},
        {plain('G'), Action::ShowGreen, "Green alone", {}},
        {plain('B'), Action::ShowBlue, "Blue alone", {}},
        {plain('A'), Action::ShowAlpha, "Alpha alone", {}},
        {plain('Y'), Action::ShowLuminance, "Luminance", {}},
        {plain('.'), Action::NextLayer, "Look at the next layer of the file alone", {}},
        {plain(','), Action::PreviousLayer, "… at the layer before; before the first: the mix", {}},
        {plain('O'), Action::FlagPixels, "Mark NaN, Inf, clipped and negative pixels", {}},
        {plain('V'), Action::ShowStops, "False color: luminance in stops about 0.18", {}},
        {plain('K'), Action::ShowSamples, "Heat map of the samples per pixel", {}},
        {plain('N'), Action::ShowNoise, "Noise map: relative standard error per pixel", {}},
        {plain('D'), Action::Denoise, "Show all layers denoised", {}},
        {plain('T'), Action::TakeSnapshot, "Keep the image and its look in the strip", {}},
        {shift('T'), Action::Freeze, "Keep the image and compare with it: B stays as it is", {}},
        {plain('L'),
         Action::SortByPixel,
         "Sort rows by their light at the pixel under the mouse",
         {}},
        {plain('P'), Action::PickMatte, "Pick objects in the image: rows act within them", {}},
        {plain(key_f1), Action::ShowHelp, "This help", {}},
        {plain('H'), Action::ShowHelp, "This help", {}},
    };
    for (KeyBinding& b : bindings) b.keys = text_of(b.press);
    return bindings;
}

const std::vector<KeyBinding>& bindings() {
    static const std::vector<KeyBinding> all = make_bindings();
    return all;
}

std::vector<int> keys_in_use() {
    std::vector<int> keys = {key_space};
    for (const KeyBinding& b : bindings()) {
        if (std::find(keys.begin(), keys.end(), b.press.key) == keys.end())
            keys.push_back(b.press.key);
    }
    return keys;
}

}  // namespace

std::span<const KeyBinding> key_bindings() {
    return bindings();
}

std::optional<Action> action_of(const KeyPress& press) {
    for (const KeyBinding& b : bindings()) {
        if (b.press == press) return b.action;
    }
    return std::nullopt;
}

bool repeats(Action action) {
    switch (action) {
        case Action::Undo:
        case Action::Redo:
        case Action::PreviousRow:
        case Action::NextRow:
        case Action::GainUp:
        case Action::GainDown:
        case Action::GainUpFine:
        case Action::GainDownFine:
        case Action::ExposureUp:
        case Action::ExposureDown:
        case Action::ZoomIn:
        case Action::ZoomOut:
        case Action::PreviousLayer:
        case Action::NextLayer:
            return true;
        default:
            return false;
    }
}

const char* keys_of(Action action) {
    for (const KeyBinding& b : bindings()) {
        if (b.action == action) return b.keys.c_str();
    }
    return "";
}

std::span<const int> bound_keys() {
    static const std::vector<int> keys = keys_in_use();
    return keys;
}

std::optional<KeyPress> key_press_of(std::string text) {
    text = lower(std::move(text));
    KeyPress press;
    const auto take = [&text](const std::string& prefix) {
        if (!text.starts_with(prefix)) return false;
        text.erase(0, prefix.size());
        return true;
    };
    press.is_ctrl = take("ctrl+");
    press.is_shift = take("shift+");
    const auto at = std::find_if(special_keys.begin(), special_keys.end(),
                                 [&](const auto& s) { return text == lower(s.first); });
    if (at != special_keys.end()) {
        press.key = at->second;
    } else if (text.size() == 1) {
        press.key = std::toupper(static_cast<unsigned char>(text[0]));
    } else {
        return std::nullopt;
    }
    return press;
}

}  // namespace velatura::compositor::window
