// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/drawing.h"
#include "view/scene_editor.h"

#include <array>
#include <optional>
#include <string>

namespace velatura::view {

/// Lights on top of the image: a dot each, which a click selects, and three axes of the selected
/// one. Dragging an axis moves the light along it, with Ctrl it turns about it.
class LightGizmo {
  public:
    explicit LightGizmo(SceneEditor& editor) : editor_(editor) {}

    bool is_shown() const { return is_shown_; }

    void show(bool is_shown) { is_shown_ = is_shown; }

    /// Prim path; empty: none.
    const std::string& selected() const { return selected_; }

    void select(const std::string& path) {
        selected_ = path;
        held_.reset();
    }

    void draw(const compositor::window::ImagePlace& place,
              const LiveStatus& status,
              const image::Window& frame,
              compositor::window::Marks& marks);

    /// Returns: true where the mouse is on a dot or an axis.
    bool take_mouse(const compositor::window::ImageMouse& mouse,
                    const LiveStatus& status,
                    const image::Window& frame);

  private:
    using Pixel = std::array<double, 2>;

    /// A light as it is in the image.
    struct Handles {
        std::string path;
        bool has_place = true;
        Mat4d matrix;  ///< render space
        Vec3d origin = Vec3d(0.0);
        Pixel middle = {0, 0};
        std::array<std::optional<Pixel>, 3> ends;  ///< of the axes, of the selected light
    };

    std::optional<Handles> handles_of(const LiveLight& light,
                                      const LiveStatus& status,
                                      const image::Window& frame) const;
    bool is_near(const Pixel& a, const Pixel& b) const;
    void drag(const compositor::window::ImageMouse& mouse,
              const LiveStatus& status,
              const image::Window& frame);

    SceneEditor& editor_;
    bool is_shown_ = false;
    std::string selected_;
    double scale_ = 1;  ///< pixels of the screen per pixel of the image

    /// An axis in the mouse's hand.
    struct Held {
        size_t axis = 0;
        bool turns = false;
        Pixel from = {0, 0};
        Mat4d matrix;  ///< when it was taken
        Vec3d origin = Vec3d(0.0);
        Mat4d now;  ///< what was asked for
        bool is_down = true;
        size_t loads = 0;  ///< of the scene, when it was let go
    };

    std::optional<Held> held_;
};

}  // namespace velatura::view
