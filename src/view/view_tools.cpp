// SPDX-License-Identifier: Apache-2.0
#include "view/view_tools.h"

#include "compositor/window/widgets.h"
#include "view/camera_moves.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::view {

namespace {

using compositor::window::ImageMouse;
using compositor::window::ImagePlace;
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
    : render_(render),
      desktop_(desktop),
      edits_(std::move(edits)),
      editor_(render),
      gizmo_(editor_),
      page_(editor_, gizmo_) {
    compositor::window::LiveHooks& hooks = desktop_.hooks();
    hooks.draw_tools = [this](Marks& marks) { draw(marks); };
    hooks.take_mouse = [this](const ImageMouse& mouse) { return take_mouse(mouse); };
    hooks.draw_over = [this](const ImagePlace& place, Marks& marks) { draw_over(place, marks); };
    hooks.page_title = "Scene";
    hooks.draw_page = [this](Marks& marks) { page_.draw(status_, marks); };
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
    if (key == KeyPress{'B', true, false}) {
        if (!is_repeat) has_region_tool_ = !has_region_tool_;
        return true;
    }
    if (key == plain('Z')) {
        undo();
        return true;
    }
    if (key == KeyPress{'Z', false, true}) {
        redo();
        return true;
    }
    if (key == plain(compositor::window::key_space)) {
        if (!is_repeat) set_paused(!is_paused_);
        return true;
    }
    if (!has_camera_ || !editor_.camera()) return false;
    if (key == plain('F') || key == plain('A')) {
        const bool has_pick = key.key == 'F' && !status_.pick.bounds.isEmpty();
        const Box3d& box = has_pick ? status_.pick.bounds : status_.bounds;
        editor_.move_camera("", false, frame(*editor_.camera(), box));
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
    editor_.note(status_);
    const Clock::time_point now = Clock::now();
    const std::chrono::duration<double> passed = now - std::exchange(frame_begin_, now);
    if (move_ != Move::None && is_moved_) {
        drag_s_ += passed.count();
        drag_drafts_ += status_.drafts - drafts_;
    }
    drafts_ = status_.drafts;
    // A drag is one edit
    if (!ImGui::IsAnyItemActive()) editor_.seal();
    if (status_.messages != messages_) {
        messages_ = status_.messages;
        desktop_.session().report(status_.message, status_.is_error);
    }
    if (status_.picks == picks_) return;
    picks_ = status_.picks;
    if (std::exchange(shows_pick_, false)) show_pick();
}

void ViewTools::show_pick() {
    compositor::window::Session& session = desktop_.session();
    const LivePick& p = status_.pick;
    if (page_.wants_focus()) {
        page_.focus_at(p.depth, status_);
        return session.report(p.prim.empty()
                                  ? std::string("nothing is hit there: no focus")
                                  : fmt::format("focus at {:.4g} on {}", p.depth, p.prim),
                              p.prim.empty());
    }
    session.report(p.prim.empty() ? std::string("nothing is hit there")
                                  : fmt::format("{} · material {} · depth {:.4g}", p.prim,
                                                p.material.empty() ? "none" : p.material, p.depth));
    if (session.is_sorting()) session.sort_rows_at(p.pixel);
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
    editor_.edit(
        "", false, [&](SceneState& s) { s.values.add(*bake); }, session.look().controls);
    session.edit("", [](compositor::Look& look) { look.controls.clear(); });
    session.report(fmt::format("{} light{} edited; Z undoes it", bake->lights.size(),
                               bake->lights.size() == 1 ? "" : "s"));
}

void ViewTools::undo() {
    const auto baked = editor_.undo();
    if (!baked) return desktop_.session().report("no edit of camera or lights to undo");
    if (baked->empty()) return;
    desktop_.session().edit("", [&](compositor::Look& look) {
        look.controls.insert(look.controls.begin(), baked->begin(), baked->end());
    });
}

void ViewTools::redo() {
    const auto baked = editor_.redo();
    if (!baked) return desktop_.session().report("no edit of camera or lights to redo");
    if (baked->empty()) return;
    desktop_.session().edit("", [&](compositor::Look& look) {
        // Faders that were moved since stay
        std::erase_if(look.controls, [&](const compositor::Control& c) {
            return std::any_of(baked->begin(), baked->end(), [&](const compositor::Control& b) {
                return b.kind == c.kind && b.target == c.target && b.value == c.value &&
                       b.matte == c.matte;
            });
        });
    });
}

void ViewTools::draw(Marks& marks) {
    if (button(marks, is_paused_ ? "Resume" : "Pause", "pause", "Space")) set_paused(!is_paused_);
    if (button(marks, "Write", "write", "Ctrl+S: the image so far, with the sums, to continue it"))
        render_.save();
    draw_camera_tools(marks);
    draw_edit_tools(marks);
    ImGui::NewLine();
}

void ViewTools::draw_camera_tools(Marks& marks) {
    const auto toggle = [&](const char* label, const char* mark, bool& is_on, const char* what) {
        ImGui::Checkbox(label, &is_on);
        note_last(marks, mark);
        compositor::window::explain(what);
        ImGui::SameLine();
    };
    toggle("Camera", "camera", has_camera_,
           "The mouse moves the camera: drag orbits, with Shift pans, with Ctrl and the wheel go "
           "nearer; a click picks. F frames it, A all. Without the switch: Alt");
    ImGui::BeginDisabled(!editor_.state().camera);
    if (button(marks, "Reset", "reset camera", "The camera of the scene"))
        editor_.edit("", false, [](SceneState& s) { s.camera.reset(); });
    ImGui::EndDisabled();
    toggle("Region", "region", has_region_tool_,
           "Ctrl+B: drag a rectangle that alone is rendered; a click renders all of it again");
    bool shows_lights = gizmo_.is_shown();
    toggle("Lights", "lights in image", shows_lights,
           "Lights in the image: a click selects one; its axes move it, with Ctrl they turn it");
    gizmo_.show(shows_lights);
}

void ViewTools::draw_edit_tools(Marks& marks) {
    if (button(marks, "Bake into lights", "bake lights",
               "Makes the faders of lights values of the lights, and renders them"))
        bake_lights();
    ImGui::BeginDisabled(!editor_.can_undo());
    if (button(marks, "Undo edit", "undo edit", "Z: the last edit of the camera or of lights"))
        undo();
    ImGui::EndDisabled();
    ImGui::BeginDisabled(!editor_.is_changed());
    if (button(marks, "Save edits", "save edits",
               "Ctrl+Shift+S: camera and lights as a USD layer over the scene"))
        save();
    ImGui::EndDisabled();
}

void ViewTools::draw_over(const ImagePlace& place, Marks& marks) {
    const auto& frame_of_image = desktop_.session().image_frame();
    const auto rectangle = [&](const image::Window& w) {
        if (w.is_empty()) return;
        const auto at = [&](int x, int y) {
            return ImVec2(place.origin.x + float(x * place.scale),
                          place.origin.y + float(y * place.scale));
        };
        ImDrawList& list = *ImGui::GetWindowDrawList();
        list.AddRect(at(w.x0, w.y0), at(w.x1, w.y1), IM_COL32(0, 0, 0, 160), 0, 0, 3);
        list.AddRect(at(w.x0, w.y0), at(w.x1, w.y1), IM_COL32(237, 176, 92, 255));
        const ImVec2 low = at(w.x0, w.y0), high = at(w.x1, w.y1);
        marks.note("region frame", {low.x, low.y, high.x, high.y});
    };
    if (region_from_)
        rectangle(drawn_region_);
    else if (status_.region)
        rectangle(*status_.region);
    gizmo_.draw(place, status_, frame_of_image, marks);
}

/// What the camera turns around: what was picked, else the middle of the scene.
Vec3d ViewTools::pivot() const {
    if (!status_.pick.prim.empty()) return status_.pick.point;
    if (!status_.bounds.isEmpty()) return 0.5 * (status_.bounds.min + status_.bounds.max);
    return position_of(*editor_.camera()) + forward_of(*editor_.camera());
}

bool ViewTools::take_mouse(const ImageMouse& mouse) {
    if (gizmo_.take_mouse(mouse, status_, desktop_.session().image_frame())) return true;
    if (take_region(mouse)) return true;
    const bool picks_focus = page_.wants_focus() && !mouse.is_alt;
    const bool is_wanted = editor_.camera() && (has_camera_ || mouse.is_alt || picks_focus);
    if (mouse.is_pressed && is_wanted) begin_drag(mouse);
    if (move_ == Move::None) {
        if (is_wanted && mouse.is_over && mouse.wheel != 0) turn_wheel(mouse.wheel);
        return is_wanted;
    }
    const bool moves = mouse.moved[0] != 0 || mouse.moved[1] != 0;
    if (mouse.is_held && moves && (has_camera_ || !picks_focus)) drag(mouse.moved);
    if (mouse.is_held) return true;
    move_ = Move::None;
    if (!is_moved_) {
        shows_pick_ = true;
        render_.pick({int(std::floor(mouse.pixel[0])), int(std::floor(mouse.pixel[1]))});
    }
    return true;
}

void ViewTools::clear_region() {
    render_.set_region(std::nullopt);
}

/// Draws the region while its tool is on.
bool ViewTools::take_region(const ImageMouse& mouse) {
    if (!has_region_tool_) return false;
    if (mouse.is_pressed) {
        region_from_ = mouse.pixel;
        drawn_region_ = {};
    }
    if (!region_from_) return false;
    const image::Window& whole = desktop_.session().image_frame();
    const auto edge = [](double a, double b, int most, bool is_upper) {
        const double v = is_upper ? std::ceil(std::max(a, b)) : std::floor(std::min(a, b));
        return int(std::clamp(v, 0.0, double(most)));
    };
    drawn_region_ = {edge((*region_from_)[0], mouse.pixel[0], whole.width(), false),
                     edge((*region_from_)[1], mouse.pixel[1], whole.height(), false),
                     edge((*region_from_)[0], mouse.pixel[0], whole.width(), true),
                     edge((*region_from_)[1], mouse.pixel[1], whole.height(), true)};
    if (mouse.is_held) return true;
    region_from_.reset();
    has_region_tool_ = false;
    // A click
    constexpr int smallest = 4;
    if (drawn_region_.width() < smallest || drawn_region_.height() < smallest)
        clear_region();
    else
        render_.set_region(drawn_region_);
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
    const scene::Camera& c = *editor_.camera();
    const auto move = [&](const scene::Camera& camera) {
        editor_.move_camera("drag", true, camera);
    };
    switch (move_) {
        case Move::Orbit:
            return move(orbit(c, pivot(), nearest_up(*editor_.scene_camera()),
                              degrees_per_pixel * dx, degrees_per_pixel * dy));
        case Move::Pan: {
            // What lies as far away as the pivot stays under the mouse
            const compositor::window::Session& session = desktop_.session();
            const double width = c.window_right - c.window_left;
            const double far = c.projection == scene::Camera::Projection::Orthographic
                                   ? 1
                                   : std::abs((pivot() - position_of(c)).dot(forward_of(c)));
            const double unit =
                far * width / (session.view().scale() * double(session.image_frame().width()));
            return move(pan(c, -dx * unit, dy * unit));
        }
        case Move::Dolly:
            return move(dolly(c, pivot(), std::pow(dolly_per_pixel, dy - dx)));
        case Move::None:
            return;
    }
}

void ViewTools::turn_wheel(float notches) {
    editor_.move_camera(
        "", false, dolly(*editor_.camera(), pivot(), std::pow(dolly_per_notch, double(notches))));
}

void ViewTools::save() {
    if (!editor_.camera()) return;
    const auto saved = editor_.save(edits_);
    if (!saved) return desktop_.session().report(saved.error().message, true);
    const std::string& prim = editor_.state().camera_prim;
    desktop_.session().report(fmt::format("saved {}; `velatura render --session {}{}` renders it",
                                          edits_, edits_, prim.empty() ? "" : " --camera " + prim));
}

std::string ViewTools::times() const {
    const LiveStatus status = render_.status();
    return fmt::format(
        "first image {:.0f} ms after the scene was ready\n"
        "{} first drafts, the last one 1/{} in {:.0f} ms; {} in {:.1f} s of dragging: {:.1f} per "
        "second\n",
        1000 * status.first_image_s, status.drafts, status.draft_reduction, 1000 * status.draft_s,
        drag_drafts_, drag_s_, drag_s_ > 0 ? double(drag_drafts_) / drag_s_ : 0);
}

}  // namespace velatura::view
