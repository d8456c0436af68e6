// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/script.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

namespace velatura::compositor::window {

namespace {

using Kind = ScriptStep::Kind;

/// Of one command: some minutes.
constexpr float max_frames = 10'000;

/// Words of a line; one in quotation marks may hold spaces.
std::vector<std::string> words_of(const std::string& line) {
    std::vector<std::string> words;
    std::string word;
    bool is_quoted = false, has_word = false;
    for (const char c : line) {
        if (c == '"') {
            is_quoted = !is_quoted;
            has_word = true;
        } else if (c == '#' && !is_quoted) {
            break;
        } else if (c == ' ' && !is_quoted) {
            if (has_word) words.push_back(word);
            word.clear();
            has_word = false;
        } else {
            word += c;
            has_word = true;
        }
    }
    if (has_word) words.push_back(word);
    return words;
}

std::optional<float> number(const std::string& text) {
    float value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
        return std::nullopt;
    return value;
}

/// Reads one line, words[0] being the command.
class Line {
  public:
    Line(std::vector<std::string> words, size_t number) : words_(std::move(words)) {
        step_.line = number;
    }

    Result<ScriptStep> read();

  private:
    bool read_arguments();
    bool take_word(std::string& word);
    bool take_number(float& value);
    void take_held();

    std::vector<std::string> words_;
    size_t at_ = 1;
    ScriptStep step_;
};

bool Line::take_word(std::string& word) {
    if (at_ >= words_.size()) return false;
    word = words_[at_++];
    return true;
}

bool Line::take_number(float& value) {
    std::string word;
    const auto found = take_word(word) ? number(word) : std::nullopt;
    if (found) value = *found;
    return found.has_value();
}

/// `alt`, `ctrl`, `shift`, `double` at the end of the line.
void Line::take_held() {
    while (at_ < words_.size()) {
        const std::string& word = words_[at_];
        if (word == "alt")
            step_.is_alt = true;
        else if (word == "ctrl")
            step_.is_ctrl = true;
        else if (word == "shift")
            step_.is_shift = true;
        else if (word == "double")
            step_.count = 2;
        else
            return;
        ++at_;
    }
}

bool Line::read_arguments() {
    const std::string& command = words_[0];
    std::string word;
    float value = 0;
    if (command == "wait") {
        step_.kind = Kind::Wait;
    } else if (command == "frames") {
        step_.kind = Kind::Frames;
        if (!take_number(value) || value < 1 || value > max_frames) return false;
        step_.count = int(value);
    } else if (command == "hover" || command == "whole") {
        step_.kind = command == "hover" ? Kind::Hover : Kind::Whole;
        return take_word(step_.mark) && at_ == words_.size();
    } else if (command == "click") {
        step_.kind = Kind::Click;
        if (!take_word(step_.mark)) return false;
        take_held();
    } else if (command == "drag") {
        step_.kind = Kind::Drag;
        if (!take_word(step_.mark) || !take_number(step_.by[0]) || !take_number(step_.by[1]))
            return false;
        take_held();
    } else if (command == "wheel") {
        step_.kind = Kind::Wheel;
        if (!take_word(step_.mark) || !take_number(step_.by[1])) return false;
    } else if (command == "key") {
        step_.kind = Kind::Key;
        const auto key = take_word(word) ? key_press_of(word) : std::nullopt;
        if (!key) return false;
        step_.key = *key;
    } else if (command == "type" || command == "drop") {
        step_.kind = command == "type" ? Kind::Type : Kind::Drop;
        if (!take_word(step_.text)) return false;
    } else if (command == "replace") {
        step_.kind = Kind::Replace;
        if (!take_word(step_.other) || !take_word(step_.text)) return false;
    } else if (command == "screenshot") {
        step_.kind = Kind::Screenshot;
        if (!take_word(step_.text)) return false;
        if (at_ < words_.size()) take_word(step_.mark);
    } else {
        return false;
    }
    return at_ == words_.size();
}

Result<ScriptStep> Line::read() {
    if (read_arguments()) return step_;
    return Error{"bad-script", fmt::format("line {}: cannot parse '{}'", step_.line,
                                           fmt::format("{}", words_[0]))};
}

}  // namespace

const Marks::Box* Marks::find(const std::string& name) const {
    const auto at = boxes_.find(name);
    return at == boxes_.end() ? nullptr : &at->second;
}

Result<std::vector<ScriptStep>> parse_script(const std::string& text) {
    std::vector<ScriptStep> steps;
    std::istringstream lines(text);
    size_t number = 0;
    for (std::string line; std::getline(lines, line);) {
        ++number;
        std::vector<std::string> words = words_of(line);
        if (words.empty()) continue;
        auto step = Line(std::move(words), number).read();
        if (!step) return step.error();
        steps.push_back(std::move(*step));
    }
    return steps;
}

std::vector<InputFrame> input_of(const ScriptStep& step, const Marks::Box& box) {
    constexpr int drag_frames = 8;
    const std::array<float, 2> middle = {std::floor((box.x0 + box.x1) / 2),
                                         std::floor((box.y0 + box.y1) / 2)};
    InputFrame still;
    still.is_alt = step.is_alt;
    still.is_ctrl = step.is_ctrl;
    still.is_shift = step.is_shift;
    if (!step.mark.empty()) still.mouse = middle;
    InputFrame pressed = still;
    pressed.is_button_down = true;
    switch (step.kind) {
        case Kind::Hover:
            return {still, still};
        case Kind::Click: {
            std::vector<InputFrame> frames = {still};
            for (int i = 0; i < step.count; ++i) frames.insert(frames.end(), {pressed, still});
            return frames;
        }
        case Kind::Drag: {
            std::vector<InputFrame> frames = {still, pressed};
            for (int i = 1; i <= drag_frames; ++i) {
                const float share = float(i) / drag_frames;
                pressed.mouse = {std::round(middle[0] + share * step.by[0]),
                                 std::round(middle[1] + share * step.by[1])};
                frames.push_back(pressed);
            }
            still.mouse = pressed.mouse;
            frames.push_back(still);
            return frames;
        }
        case Kind::Wheel: {
            InputFrame turned = still;
            turned.wheel = step.by[1];
            return {still, turned, still};
        }
        case Kind::Key: {
            InputFrame down = still;
            down.key = step.key.key;
            down.is_ctrl = step.key.is_ctrl;
            down.is_shift = step.key.is_shift;
            return {down, still};
        }
        case Kind::Type: {
            InputFrame typing = still;
            typing.typed = step.text;
            return {typing, still};
        }
        default:
            return {};
    }
}

}  // namespace velatura::compositor::window
