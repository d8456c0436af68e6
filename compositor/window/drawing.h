// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/live_noise.h"
#include "compositor/window/pixel_readout.h"
#include "compositor/window/script.h"
#include "compositor/window/session.h"
#include "compositor/window/textures.h"
#include "compositor/window/theme.h"
#include "image/display.h"

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// What all panels draw with.
struct Drawing {
    Session& session;
    Textures& textures;
    Marks marks;
    Fonts fonts;
    std::vector<image::DisplayViews> displays;
    std::vector<std::string> spaces;  ///< color spaces of the config

    std::string scrolled_to;  ///< row that the mixer shows
    FlaggedPixelCounts flagged;
    std::vector<float> tool_widths;  ///< of the last frame
    float toolbar_height = 0;        ///< of the last frame; 0: not yet drawn
    std::optional<LiveNoise> noise;  ///< of the active look
    bool is_noise_old = true;        ///< of a look before this one
    MixTimes times;
    bool is_working = false;
    std::optional<std::array<int, 2>> cursor;  ///< pixel of the image last under the mouse

    /// What the window's owner does for a dialog.
    std::function<void(const std::string&)> open_file, open_compared, write_output;
    /// Reads that view of the stereo file.
    std::function<void(const std::string&)> open_view;
};

}  // namespace velatura::compositor::window
