// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/drawing.h"
#include "view/light_gizmo.h"
#include "view/scene_editor.h"

#include <imgui.h>

#include <array>
#include <functional>
#include <optional>
#include <string>

namespace velatura::view {

/// A page of the mixer with the numbers of the scene: camera and lens, lights, and what is wrong
/// with its files.
class ScenePage {
  public:
    ScenePage(SceneEditor& editor, LightGizmo& gizmo) : editor_(editor), gizmo_(gizmo) {}

    void draw(const LiveStatus& status, compositor::window::Marks& marks);

    /// The next pick sets the focus, once.
    bool wants_focus() const { return wants_focus_; }

    /// Of the camera that is looked through: a pick at that depth [scene units].
    void focus_at(double depth, const LiveStatus& status);

  private:
    using Numbers = std::array<float, 3>;

    const app::CameraLens* lens(const LiveStatus& status) const;
    void draw_camera(const LiveStatus& status);
    void draw_lights(const LiveStatus& status);
    void draw_light(const LiveLight& light, const LiveStatus& status);
    void draw_problems(const LiveStatus& status);
    std::optional<Numbers> numbers(const char* label,
                                   const std::string& mark,
                                   const Numbers& now,
                                   int count,
                                   float speed,
                                   const char* format,
                                   float least = 0,
                                   float most = 0);
    void set(const std::string& path,
             const std::string& name,
             const std::string& type,
             const std::string& value,
             bool is_connected = false);
    void note(const std::string& mark);

    SceneEditor& editor_;
    LightGizmo& gizmo_;
    compositor::window::Marks* marks_ = nullptr;  ///< while it is drawn
    ImGuiID held_ = 0;                            ///< box that is dragged, and its value
    Numbers held_value_ = {0, 0, 0};
    bool wants_focus_ = false;
};

}  // namespace velatura::view
