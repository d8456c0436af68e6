// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/desktop.h"
#include "image/window.h"
#include "scene/camera.h"
#include "view/light_gizmo.h"
#include "view/live_render.h"
#include "view/scene_editor.h"
#include "view/scene_page.h"

#include <array>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

namespace velatura::view {

/// What a render adds to the mixer's window: tools, keys, the camera in the mouse's hand, a region,
/// lights, messages.
class ViewTools {
  public:
    /// Both must outlive it. edits: the USD layer that edits are saved to.
    ViewTools(LiveRender& render, compositor::window::Desktop& desktop, std::string edits);

    /// Returns: true for a key that is not for the mixer.
    bool press(const compositor::window::KeyPress& key, bool is_repeat);

    void begin_frame();

    /// Lines: the first image, and drafts while the camera was dragged.
    std::string times() const;

  private:
    using Clock = std::chrono::steady_clock;

    /// What a drag does to the camera.
    enum class Move { None, Orbit, Pan, Dolly };

    void draw(compositor::window::Marks& marks);
    void draw_camera_tools(compositor::window::Marks& marks);
    void draw_edit_tools(compositor::window::Marks& marks);
    void draw_over(const compositor::window::ImagePlace& place, compositor::window::Marks& marks);
    void set_paused(bool is_paused);
    void clear_region();
    bool take_mouse(const compositor::window::ImageMouse& mouse);
    bool take_region(const compositor::window::ImageMouse& mouse);
    void begin_drag(const compositor::window::ImageMouse& mouse);
    void drag(const std::array<float, 2>& moved);
    void turn_wheel(float notches);
    void show_pick();
    Vec3d pivot() const;
    void bake_lights();
    void undo();
    void redo();
    void save();

    LiveRender& render_;
    compositor::window::Desktop& desktop_;
    std::string edits_;
    SceneEditor editor_;
    LightGizmo gizmo_;
    ScenePage page_;
    LiveStatus status_;  ///< of this frame
    bool is_paused_ = false;
    bool has_camera_ = false;       ///< the mouse moves the camera; else it does with Alt alone
    bool has_region_tool_ = false;  ///< the mouse draws the region
    std::optional<std::array<double, 2>> region_from_;  ///< corner, while it is drawn
    image::Window drawn_region_;
    Move move_ = Move::None;
    bool is_moved_ = false;   ///< since the button went down
    size_t drafts_ = 0;       ///< that were noticed
    size_t drag_drafts_ = 0;  ///< of them while the camera was dragged
    Clock::time_point frame_begin_ = Clock::now();
    double drag_s_ = 0;    ///< how long that was
    size_t messages_ = 0;  ///< that were shown
    size_t picks_ = 0;     ///< that were
    bool shows_pick_ = false;
};

}  // namespace velatura::view
