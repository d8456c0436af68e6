// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/window/script.h"

#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace velatura::compositor::window {

/// Plays a script into ImGui's input, a frame at a time, as if mouse and keys had done it.
class ScriptPlayer {
  public:
    explicit ScriptPlayer(std::vector<ScriptStep> steps) : steps_(std::move(steps)) {}

    /// Sets mouse and keys for this frame. `marks` is where the last frame drew things;
    /// `is_settled`: nothing is being loaded, mixed or saved. Errors: "bad-script" (a mark that is
    /// not there).
    Result<void> play(const Marks& marks, bool is_settled);

    /// The file that this frame's screen is to be written to, and what to cut out of it.
    const std::string& screenshot() const { return screenshot_; }

    const std::optional<Marks::Box>& cut() const { return cut_; }

    /// A file that falls on the window at this frame.
    std::optional<std::string> take_dropped();

    /// A file that another one takes the place of at this frame: both, that of the script first.
    std::optional<std::pair<std::string, std::string>> take_replaced();

    /// How long the next frame may be waited for, in seconds.
    double patience() const;

    bool is_over() const { return at_ == steps_.size() && frames_.empty(); }

  private:
    Result<void> begin_step(const Marks& marks, bool is_settled);
    void apply(const InputFrame& frame);

    std::vector<ScriptStep> steps_;
    size_t at_ = 0;
    int settled_frames_ = 0;
    std::deque<InputFrame> frames_;  ///< of the step that is under way, the next one first
    InputFrame held_;
    std::string screenshot_;
    std::optional<Marks::Box> cut_;
    std::optional<std::string> dropped_;
    std::optional<std::pair<std::string, std::string>> replaced_;
};

}  // namespace velatura::compositor::window
