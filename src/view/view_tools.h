// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/desktop.h"
#include "scene/camera.h"
#include "view/light_edits.h"
#include "view/live_render.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace velatura::view {

/// What a render adds to the mixer's window: tools, keys, the camera in the mouse's hand, messages.
class ViewTools {
  public:
    /// Both must outlive it. edits: the USD layer that edits are saved to.
    ViewTools(LiveRender& render, compositor::window::Desktop& desktop, std::string edits);

    /// Returns: true for a key that is not for the mixer.
    bool press(const compositor::window::KeyPress& key, bool is_repeat);

    void begin_frame();

    /// A line: first drafts and how long they took.
    std::string times() const;

  private:
    /// What a drag does to the camera.
    enum class Move { None, Orbit, Pan, Dolly };

    void draw(compositor::window::Marks& marks);
    void set_paused(bool is_paused);
    bool take_mouse(const compositor::window::ImageMouse& mouse);
    void begin_drag(const compositor::window::ImageMouse& mouse);
    void drag(const std::array<float, 2>& moved);
    void turn_wheel(float notches);
    Vec3d pivot() const;
    void move_camera(const scene::Camera& camera, bool is_moving);
    void note_scene();
    void bake_lights();
    void keep_step();
    void undo();
    void save();

    /// Edits of the scene at a moment, and what of the look became edits of lights behind it.
    struct Step {
        scene::Camera camera;
        LightEdits lights;
        std::vector<compositor::Control> baked;
    };

    LiveRender& render_;
    compositor::window::Desktop& desktop_;
    std::string edits_;
    std::optional<scene::Camera> first_camera_, camera_;  ///< of the scene; that is asked for
    LightEdits lights_;
    std::vector<Step> steps_;  ///< before each edit: to undo it
    LiveStatus status_;        ///< of this frame
    size_t loads_ = 0;         ///< of the scene, that were noticed
    bool is_paused_ = false;
    bool has_camera_ = false;  ///< the mouse moves the camera; else it does with Alt alone
    Move move_ = Move::None;
    bool is_moved_ = false;  ///< since the button went down
    size_t messages_ = 0;    ///< that were shown
    size_t picks_ = 0;       ///< that were
    bool shows_pick_ = false;
};

}  // namespace velatura::view
