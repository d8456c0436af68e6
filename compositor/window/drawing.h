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

/// The mouse over the image, before zoom and pan see it.
struct ImageMouse {
    bool is_over = false;
    bool is_pressed = false, is_held = false, is_released = false;  ///< a button, over the image
    int button = 0;                                                 ///< 0 left, 2 middle
    std::array<double, 2> pixel = {0, 0};                           ///< of the image, not a draft
    std::array<float, 2> moved = {0, 0};                            ///< since the last frame [px]
    float wheel = 0;                                                ///< notches, up is positive
    bool is_alt = false, is_ctrl = false, is_shift = false;
};

/// Where the image is on the screen.
struct ImagePlace {
    ImVec2 low, high;  ///< of the panel that shows it
    ImVec2 origin;     ///< of the image's top left corner
    double scale = 1;  ///< pixels of the screen per pixel of the image
};

/// What the owner of a render adds to the window; each can be empty.
struct LiveHooks {
    std::function<void(const ImagePlace&, Marks&)> draw_over;  ///< on top of the image
    std::function<void(Marks&)> draw_page;  ///< a page of the mixer, called `page_title`
    std::string page_title;
    std::function<void(Marks&)> draw_tools;             ///< first in the toolbar
    std::function<bool(const ImageMouse&)> take_mouse;  ///< true: neither zoom nor pan
};

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
    LiveHooks live;          ///< none: the layers are those of a file
    std::string live_state;  ///< of the render
};

}  // namespace velatura::compositor::window
