// SPDX-License-Identifier: Apache-2.0
#include "view/light_gizmo.h"

#include "view/camera_moves.h"
#include "view/light_moves.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

namespace velatura::view {

namespace {

using compositor::window::ImageMouse;
using compositor::window::ImagePlace;
using compositor::window::Marks;

constexpr double axis_length = 64, reach = 9;  // pixels of the screen
constexpr double degrees_per_pixel = 0.5;
constexpr std::array<ImU32, 3> axis_colors = {
    IM_COL32(230, 90, 80, 255), IM_COL32(120, 200, 90, 255), IM_COL32(90, 150, 240, 255)};
constexpr std::array<const char*, 3> axis_names = {"x", "y", "z"};

}  // namespace

/// None: it is not in front of the camera.
std::optional<LightGizmo::Handles> LightGizmo::handles_of(const LiveLight& light,
                                                          const LiveStatus& status,
                                                          const image::Window& frame) const {
    const scene::Camera* camera = editor_.camera();
    if (!camera || !light.render_from_light) return std::nullopt;
    Handles h;
    h.path = light.values.path;
    h.has_place = light.has_place;
    const bool is_held = held_ && h.path == selected_;
    h.matrix = is_held ? held_->now : *light.render_from_light;
    // What only turns is turned in the middle of the scene
    h.origin = h.has_place ? origin_of(h.matrix) : 0.5 * (status.bounds.min + status.bounds.max);
    const auto middle = pixel_of(*camera, frame, h.origin);
    if (!middle) return std::nullopt;
    h.middle = *middle;
    if (h.path != selected_) return h;
    const double far = camera->projection == scene::Camera::Projection::Orthographic
                           ? 1
                           : std::abs((h.origin - position_of(*camera)).dot(forward_of(*camera)));
    const double unit = far * (camera->window_right - camera->window_left) / frame.width();
    const std::array<Vec3d, 3> axes = axes_of(is_held ? held_->matrix : h.matrix);
    for (size_t i = 0; i < axes.size(); ++i)
        h.ends[i] = pixel_of(*camera, frame, h.origin + axis_length / scale_ * unit * axes[i]);
    return h;
}

void LightGizmo::draw(const ImagePlace& place,
                      const LiveStatus& status,
                      const image::Window& frame,
                      Marks& marks) {
    scale_ = place.scale;
    if (!is_shown_ || !status.scene) return;
    if (held_ && !held_->is_down && held_->loads != status.loads) held_.reset();
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const auto screen = [&](const Pixel& p) {
        return ImVec2(place.origin.x + float(p[0] * place.scale),
                      place.origin.y + float(p[1] * place.scale));
    };
    const auto note = [&](const std::string& name, const ImVec2& at) {
        marks.note(name, {at.x - 4, at.y - 4, at.x + 4, at.y + 4});
    };
    for (const LiveLight& light : status.scene->lights) {
        const bool is_selected = light.values.path == selected_;
        if (!light.has_place && !is_selected) continue;
        const auto h = handles_of(light, status, frame);
        if (!h) continue;
        const ImVec2 at = screen(h->middle);
        for (size_t i = 0; i < h->ends.size(); ++i) {
            if (!h->ends[i]) continue;
            const ImVec2 end = screen(*h->ends[i]);
            list.AddLine(at, end, IM_COL32(0, 0, 0, 160), 4);
            list.AddLine(at, end, axis_colors[i], 2);
            list.AddCircleFilled(end, 5, axis_colors[i]);
            note(fmt::format("axis {}", axis_names[i]), end);
        }
        list.AddCircleFilled(at, is_selected ? 6 : 5, IM_COL32(0, 0, 0, 180));
        list.AddCircleFilled(at, is_selected ? 5 : 3.5f, IM_COL32(250, 200, 90, 255));
        note("light " + h->path, at);
    }
}

bool LightGizmo::is_near(const Pixel& a, const Pixel& b) const {
    return std::hypot(a[0] - b[0], a[1] - b[1]) * scale_ < reach;
}

bool LightGizmo::take_mouse(const ImageMouse& mouse,
                            const LiveStatus& status,
                            const image::Window& frame) {
    if (!is_shown_ || !status.scene) return false;
    if (held_ && held_->is_down) {
        if (mouse.is_held) {
            drag(mouse, status, frame);
        } else {
            held_->is_down = false;
            held_->loads = status.loads;
        }
        return true;
    }
    if (!mouse.is_pressed || mouse.button != 0) return false;
    for (const LiveLight& light : status.scene->lights) {
        const auto h = handles_of(light, status, frame);
        if (!h) continue;
        for (size_t i = 0; i < h->ends.size(); ++i) {
            if (!h->ends[i] || !is_near(*h->ends[i], mouse.pixel)) continue;
            held_ = Held{i,           mouse.is_ctrl || !h->has_place,
                         mouse.pixel, h->matrix,
                         h->origin,   h->matrix,
                         true,        0};
            return true;
        }
    }
    for (const LiveLight& light : status.scene->lights) {
        const auto h = light.has_place ? handles_of(light, status, frame) : std::nullopt;
        if (!h || !is_near(h->middle, mouse.pixel)) continue;
        select(h->path);
        return true;
    }
    return false;
}

void LightGizmo::drag(const ImageMouse& mouse,
                      const LiveStatus& status,
                      const image::Window& frame) {
    const Pixel moved = {mouse.pixel[0] - held_->from[0], mouse.pixel[1] - held_->from[1]};
    if ((mouse.moved[0] == 0 && mouse.moved[1] == 0) || !editor_.camera()) return;
    const Vec3d axis = axes_of(held_->matrix)[held_->axis];
    held_->now =
        held_->turns
            ? turned_by(held_->matrix, axis, degrees_per_pixel * scale_ * (moved[0] - moved[1]))
            : moved_by(held_->matrix,
                       distance_along(*editor_.camera(), frame, held_->origin, axis, moved) * axis);
    const Mat4d world = moved_by(held_->now, status.scene->origin);
    editor_.edit("gizmo " + selected_, true,
                 [&](SceneState& s) { s.values.set_transform(selected_, world); });
}

}  // namespace velatura::view
