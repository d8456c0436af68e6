// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/window/desktop.h"
#include "compositor/window/glfw_window.h"
#include "compositor/window/script_player.h"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// How long frames and mixes took.
class LoopTimes {
  public:
    void add_frame(double ms) { frames_.push_back(ms); }

    void add_mix(const MixTimes& times);

    /// Two lines of medians.
    std::string text() const;

  private:
    std::vector<double> frames_, first_, seen_, all_;
    MixTimes last_;
};

/// The player of a script; none for an empty path. Errors: "io-open", "bad-script".
Result<std::optional<ScriptPlayer>> player_of(const std::string& path);

/// What the owner of the window does in each frame; each can be empty.
struct LoopHooks {
    /// A key that went down; true: it is not for the mixer.
    std::function<bool(const KeyPress&, bool is_repeat)> press;
    /// Before the panels are drawn.
    std::function<void()> begin_frame;
    /// The window closes without a request of the user.
    std::function<bool()> is_over;
};

/// Draws frame after frame until the window is closed, or the script has ended and all that was to
/// be saved is. Errors: "bad-script"; "io-open" where a script's first file cannot be loaded; those
/// of screenshots.
Result<void> run_window(GlfwWindow& window,
                        Desktop& desktop,
                        std::optional<ScriptPlayer>& player,
                        LoopTimes& times,
                        const LoopHooks& hooks = {});

}  // namespace velatura::compositor::window
