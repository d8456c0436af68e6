// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/window/actions.h"

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// Where the last frame drew what, by names that scripts use: `gain key`, `mute b1`, `picture`.
class Marks {
  public:
    struct Box {
        float x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< pixels of the screen
        bool is_cut = false;                   ///< part of it is outside its panel or the screen
    };

    void clear() { boxes_.clear(); }

    void note(const std::string& name, const Box& box) { boxes_[name] = box; }

    const Box* find(const std::string& name) const;

  private:
    std::map<std::string, Box> boxes_;
};

/// One line of a script. docs/reference/window.md lists the commands.
struct ScriptStep {
    enum class Kind {
        Wait,
        Frames,
        Hover,
        Whole,
        Click,
        Drag,
        Wheel,
        Key,
        Type,
        Drop,
        Replace,
        Screenshot
    };
    Kind kind = Kind::Wait;
    size_t line = 0;   ///< from 1
    std::string mark;  ///< what the mouse goes to; of a screenshot: what it is cut to
    std::array<float, 2> by = {0, 0};  ///< drag in pixels; wheel in y
    int count = 1;                     ///< frames, or clicks
    KeyPress key;
    bool is_alt = false, is_ctrl = false, is_shift = false;  ///< held during a click or a drag
    std::string text;                                        ///< to type; a file
    std::string other;                                       ///< file that `text` replaces
};

/// Lines as docs/reference/window.md describes them; `#` begins a comment. Errors: "bad-script",
/// with the line.
Result<std::vector<ScriptStep>> parse_script(const std::string& text);

/// What mouse and keys are at a frame.
struct InputFrame {
    std::optional<std::array<float, 2>> mouse;  ///< none: where it was
    bool is_button_down = false;
    float wheel = 0;
    bool is_ctrl = false, is_shift = false, is_alt = false;
    std::optional<int> key;  ///< held down
    std::string typed;
};

/// The frames that a step takes, given where its mark is: the mouse goes there, and buttons go down
/// and up as a hand would do it.
std::vector<InputFrame> input_of(const ScriptStep& step, const Marks::Box& box);

}  // namespace velatura::compositor::window
