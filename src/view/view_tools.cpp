// SPDX-License-Identifier: Apache-2.0
#include "view/view_tools.h"

#include "compositor/window/widgets.h"
#include "view/camera_edits.h"
#include "view/camera_moves.h"

#include <fmt/format.h>
#include <imgui.h>

#include <cmath>
#include <utility>

namespace velatura::view {

namespace {

using compositor::window::ImageMouse;
using compositor::window::KeyPress;
using compositor::window::Marks;

constexpr double degrees_per_pixel = 0.3;
/// Of the distance, a pixel and a notch of the wheel.
constexpr double dolly_per_pixel = 1.005, dolly_per_notch = 0.9;

constexpr KeyPress plain(int key) {
    return {key, false, false};
}

/// Notes where the last item is, for scripts.
void note_last(Marks& marks, const std::string& name) {
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    marks.note(name, {low.x, low.y, high.x, high.y});
}

bool button(Marks& marks, const char* label, const char* mark, const char* explanation) {
    const bool is_clicked = ImGui::Button(label);
    note_last(marks, mark);
    compositor::window::explain(explanation);
    ImGui::SameLine();
    return is_clicked;
}

}  // namespace

ViewTools::ViewTools(LiveRender& render, compositor::window::Desktop& desktop, std::string edits)
    : render_(render), desktop_(desktop), edits_(std::move(edits)) {
    desktop_.hooks().draw_tools = [this](Marks& marks) { draw(marks); };
    desktop_.hooks().take_mouse = [this](const ImageMouse& mouse) { return take_mouse(mouse); };
}

bool ViewTools::press(const KeyPress& key, bool is_repeat) {
    if (desktop_.session().dialog() != compositor::window::Dialog::None) return false;
    if (key == KeyPress{'S', true, false}) {
        if (!is_repeat) render_.save();
        return true;
    }
    if (key == KeyPress{'S', true, true}) {
        if (!is_repeat) save_edits();
        return true;
    }
    if (key == plain(compositor::window::key_space)) {
        if (!is_repeat) set_paused(!is_paused_);
        return true;
    }
    if (!has_camera_ || !camera_) return false;
    if (key == plain('F') || key == plain('A')) {
        const bool has_pick = key.key == 'F' && !status_.pick.bounds.isEmpty();
        move_camera(frame(*camera_, has_pick ? status_.pick.bounds : status_.bounds), false);
        return true;
    }
    return false;
}

void ViewTools::set_paused(bool is_paused) {
    is_paused_ = is_paused;
    render_.pause(is_paused);
}

void ViewTools::begin_frame() {
    status_ = render_.status();
    if (!camera_ && status_.camera) first_camera_ = camera_ = status_.camera;
    if (status_.messages != messages_) {
        messages_ = status_.messages;
        desktop_.session().report(status_.message, status_.is_error);
    }
    if (status_.picks == picks_) return;
    picks_ = status_.picks;
    if (!std::exchange(shows_pick_, false)) return;
    const LivePick& p = status_.pick;
    desktop_.session().report(p.prim.empty()
                                  ? std::string("nothing is hit there")
                                  : fmt::format("{} · material {} · depth {:.4g}", p.prim,
                                                p.material.empty() ? "none" : p.material, p.depth));
}

void ViewTools::draw(Marks& marks) {
    if (button(marks, is_paused_ ? "Resume" : "Pause", "pause", "Space")) set_paused(!is_paused_);
    if (button(marks, "Write", "write", "Ctrl+S: the image so far, with the sums, to continue it"))
        render_.save();
    ImGui::Checkbox("Camera", &has_camera_);
    note_last(marks, "camera");
    compositor::window::explain(
        "The mouse moves the camera: drag orbits, with Shift pans, with Ctrl and the wheel go "
        "nearer; a click picks. F frames it, A all. Without the switch: Alt");
    ImGui::SameLine();
    ImGui::BeginDisabled(!camera_ || is_same_camera(*camera_, *first_camera_));
    if (button(marks, "Reset", "reset camera", "The camera of the scene"))
        move_camera(*first_camera_, false);
    if (button(marks, "Save edits", "save edits", "Ctrl+Shift+S: the camera as a USD layer"))
        save_edits();
    ImGui::EndDisabled();
    ImGui::NewLine();
}

void ViewTools::move_camera(const scene::Camera& camera, bool is_moving) {
    camera_ = camera;
    render_.set_camera(camera, is_moving);
}

/// What the camera turns around: what was picked, else the middle of the scene.
Vec3d ViewTools::pivot() const {
    if (!status_.pick.prim.empty()) return status_.pick.point;
    if (!status_.bounds.isEmpty()) return 0.5 * (status_.bounds.min + status_.bounds.max);
    return position_of(*camera_) + forward_of(*camera_);
}

bool ViewTools::take_mouse(const ImageMouse& mouse) {
    const bool is_wanted = camera_ && (has_camera_ || mouse.is_alt);
    if (mouse.is_pressed && is_wanted) begin_drag(mouse);
    if (move_ == Move::None) {
        if (is_wanted && mouse.is_over && mouse.wheel != 0) turn_wheel(mouse.wheel);
        return is_wanted;
    }
    if (mouse.is_held && (mouse.moved[0] != 0 || mouse.moved[1] != 0)) drag(mouse.moved);
    if (mouse.is_held) return true;
    move_ = Move::None;
    if (is_moved_) {
        move_camera(*camera_, false);
    } else {
        shows_pick_ = true;
        render_.pick({int(std::floor(mouse.pixel[0])), int(std::floor(mouse.pixel[1]))});
    }
    return true;
}

void ViewTools::begin_drag(const ImageMouse& mouse) {
    is_moved_ = false;
    move_ = mouse.button == 2 || mouse.is_shift ? Move::Pan
            : mouse.is_ctrl                     ? Move::Dolly
                                                : Move::Orbit;
}

void ViewTools::drag(const std::array<float, 2>& moved) {
    is_moved_ = true;
    const double dx = double(moved[0]), dy = double(moved[1]);
    const scene::Camera& c = *camera_;
    switch (move_) {
        case Move::Orbit:
            return move_camera(orbit(c, pivot(), nearest_up(*first_camera_), degrees_per_pixel * dx,
                                     degrees_per_pixel * dy),
                               true);
        case Move::Pan: {
            // What lies as far away as the pivot stays under the mouse
            const compositor::window::Session& session = desktop_.session();
            const double width = c.window_right - c.window_left;
            const double far = c.projection == scene::Camera::Projection::Orthographic
                                   ? 1
                                   : std::abs((pivot() - position_of(c)).dot(forward_of(c)));
            const double unit =
                far * width / (session.view().scale() * double(session.image_frame().width()));
            return move_camera(pan(c, -dx * unit, dy * unit), true);
        }
        case Move::Dolly:
            return move_camera(dolly(c, pivot(), std::pow(dolly_per_pixel, dy - dx)), true);
        case Move::None:
            return;
    }
}

void ViewTools::turn_wheel(float notches) {
    move_camera(dolly(*camera_, pivot(), std::pow(dolly_per_notch, double(notches))), false);
}

void ViewTools::save_edits() {
    if (!camera_ || !first_camera_) return;
    const auto saved = save_camera_edit(edits_, *first_camera_, *camera_);
    if (!saved) return desktop_.session().report(saved.error().message, true);
    desktop_.session().report(
        fmt::format("saved {}; `velatura render --session {}` renders it", edits_, edits_));
}

std::string ViewTools::times() const {
    const LiveStatus status = render_.status();
    return fmt::format("{} first drafts, the last one 1/{} in {:.0f} ms\n", status.drafts,
                       status.draft_reduction, 1000 * status.draft_s);
}

}  // namespace velatura::view
