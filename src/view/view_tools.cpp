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
        if (!is_repeat) save();
        return true;
    }
    if (key == plain('Z')) {
        undo();
        return true;
    }
    if (key == plain(compositor::window::key_space)) {
        if (!is_repeat) set_paused(!is_paused_);
        return true;
    }
    if (!has_camera_ || !camera_) return false;
    if (key == plain('F') || key == plain('A')) {
        const bool has_pick = key.key == 'F' && !status_.pick.bounds.isEmpty();
        keep_step();
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
    note_scene();
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

/// When the scene was read, at first or again.
void ViewTools::note_scene() {
    if (status_.loads == loads_) return;
    loads_ = status_.loads;
    camera_ = status_.camera;
    first_camera_ = status_.scene_camera;
}

/// Turns the faders of lights into values of the lights, which are then rendered.
void ViewTools::bake_lights() {
    compositor::window::Session& session = desktop_.session();
    if (!session.has_file() || session.look().controls.empty())
        return session.report("the faders change nothing: there is nothing to bake");
    // What is for the eye alone stays
    compositor::Look mix = session.look();
    mix.exposure_stops = 0;
    mix.display.clear();
    mix.view.clear();
    const auto bake = compositor::bake::bake_look(session.stack(), mix);
    if (!bake) return session.report(bake.error().message, true);
    std::vector<std::string> left = bake->left;
    for (const compositor::bake::BakedLight& light : bake->lights)
        if (light.color && light.has_color_space)
            left.push_back(fmt::format("the color of <{}> is in another color space", light.path));
    if (!left.empty())
        return session.report("lights cannot do this, remove it first: " + left.front(), true);
    keep_step();
    steps_.back().baked = session.look().controls;
    lights_.add(*bake);
    render_.set_lights(lights_.values());
    session.edit("", [](compositor::Look& look) { look.controls.clear(); });
    session.report(fmt::format("{} light{} edited; Z undoes it", bake->lights.size(),
                               bake->lights.size() == 1 ? "" : "s"));
}

/// Before an edit. A drag is one.
void ViewTools::keep_step() {
    if (camera_) steps_.push_back({*camera_, lights_, {}});
}

void ViewTools::undo() {
    if (steps_.empty()) return desktop_.session().report("no edit of camera or lights to undo");
    const Step step = std::move(steps_.back());
    steps_.pop_back();
    if (!is_same_camera(step.camera, *camera_)) move_camera(step.camera, false);
    if (step.lights == lights_) return;
    lights_ = step.lights;
    render_.set_lights(lights_.values());
    if (!step.baked.empty())
        desktop_.session().edit("", [&](compositor::Look& look) {
            look.controls.insert(look.controls.begin(), step.baked.begin(), step.baked.end());
        });
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
    if (button(marks, "Reset", "reset camera", "The camera of the scene")) {
        keep_step();
        move_camera(*first_camera_, false);
    }
    ImGui::EndDisabled();
    if (button(marks, "Bake into lights", "bake lights",
               "Makes the faders of lights values of the lights, and renders them"))
        bake_lights();
    ImGui::BeginDisabled(steps_.empty());
    if (button(marks, "Undo edit", "undo edit", "Z: the last move of the camera or bake")) undo();
    ImGui::EndDisabled();
    ImGui::BeginDisabled(!camera_ ||
                         (is_same_camera(*camera_, *first_camera_) && lights_.is_empty()));
    if (button(marks, "Save edits", "save edits",
               "Ctrl+Shift+S: camera and lights as a USD layer over the scene"))
        save();
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
    if (!std::exchange(is_moved_, true)) keep_step();
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
    keep_step();
    move_camera(dolly(*camera_, pivot(), std::pow(dolly_per_notch, double(notches))), false);
}

void ViewTools::save() {
    if (!camera_ || !first_camera_) return;
    std::vector<PrimEdit> edits = lights_.opinions();
    if (!is_same_camera(*camera_, *first_camera_) || edits.empty())
        edits.push_back(camera_edit(*first_camera_, *camera_));
    const auto saved = save_edits(edits_, edits);
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
