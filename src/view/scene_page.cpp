// SPDX-License-Identifier: Apache-2.0
#include "view/scene_page.h"

#include "compositor/window/theme.h"
#include "compositor/window/widgets.h"
#include "view/light_moves.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

namespace velatura::view {

namespace {

namespace color = compositor::window::color;
using compositor::window::Marks;

void heading(const char* words) {
    ImGui::Spacing();
    compositor::window::text(words, color::dim);
    ImGui::Separator();
}

bool is_connected(const LiveLight& light, const char* input) {
    const auto& all = light.values.connected;
    return std::find(all.begin(), all.end(), input) != all.end();
}

}  // namespace

void ScenePage::note(const std::string& mark) {
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    marks_->note(mark, {low.x, low.y, high.x, high.y});
}

void ScenePage::set(const std::string& path,
                    const std::string& name,
                    const std::string& type,
                    const std::string& value,
                    bool is_connected) {
    editor_.edit(path + "." + name, ImGui::IsItemActive(),
                 [&](SceneState& s) { s.values.set(path, name, type, value, is_connected); });
}

/// Boxes to drag or to type into. What is dragged is not what the render has read by now. least =
/// most: any number.
std::optional<ScenePage::Numbers> ScenePage::numbers(const char* label,
                                                     const std::string& mark,
                                                     const Numbers& now,
                                                     int count,
                                                     float speed,
                                                     const char* format,
                                                     float least,
                                                     float most) {
    const ImGuiID id = ImGui::GetID(label);
    Numbers shown = held_ == id ? held_value_ : now;
    ImGui::SetNextItemWidth(0.6f * ImGui::GetContentRegionAvail().x);
    const bool is_changed =
        count == 1 ? ImGui::DragFloat(label, shown.data(), speed, least, most, format,
                                      ImGuiSliderFlags_AlwaysClamp)
                   : ImGui::DragFloat3(label, shown.data(), speed, least, most, format);
    note(mark);
    if (ImGui::IsItemActive()) {
        held_ = id;
        held_value_ = shown;
    } else if (held_ == id) {
        held_ = 0;
    }
    const bool is_finite =
        std::all_of(shown.begin(), shown.end(), [](float v) { return std::isfinite(v); });
    return is_changed && is_finite ? std::optional(shown) : std::nullopt;
}

/// Of the camera that is looked through; null: it is no prim.
const app::CameraLens* ScenePage::lens(const LiveStatus& status) const {
    if (!status.scene || !editor_.scene_camera()) return nullptr;
    const auto& all = status.scene->cameras;
    const auto at = std::find_if(all.begin(), all.end(), [&](const app::CameraLens& c) {
        return c.path == editor_.scene_camera()->name;
    });
    return at == all.end() ? nullptr : &*at;
}

void ScenePage::focus_at(double depth, const LiveStatus& status) {
    wants_focus_ = false;
    const app::CameraLens* camera = lens(status);
    if (!camera || !(depth > 0)) return;
    editor_.edit("", false, [&](SceneState& s) {
        s.values.set(camera->path, "focusDistance", "float", float_text(depth));
    });
}

void ScenePage::draw_camera(const LiveStatus& status) {
    heading("Camera");
    const app::CameraLens* camera = lens(status);
    const std::string now = camera ? camera->path : "frames the scene";
    ImGui::SetNextItemWidth(0.6f * ImGui::GetContentRegionAvail().x);
    if (ImGui::BeginCombo("prim", now.c_str())) {
        for (const app::CameraLens& c : status.scene->cameras) {
            if (ImGui::Selectable(c.path.c_str(), c.path == now) && c.path != now)
                editor_.edit("", false, [&](SceneState& s) {
                    s.camera_prim = c.path;
                    s.camera.reset();
                });
            note("camera " + c.path);
        }
        ImGui::EndCombo();
    }
    note("cameras");
    if (!camera) return;
    const auto row = [&](const char* label, const char* name, double value, float speed,
                         float least) {
        const auto set_to = numbers(label, label, {float(value), 0, 0}, 1,
                                    speed * std::max(float(value), 0.1f), "%.4g", least, 1e6f);
        if (!set_to) return;
        editor_.edit(camera->path + "." + name, ImGui::IsItemActive(), [&](SceneState& s) {
            s.values.set(camera->path, name, "float", float_text((*set_to)[0]));
            // A lens that is focused nowhere has no effect
            const bool is_unfocused = !(camera->focus_distance > 0) && !status.bounds.isEmpty();
            if (std::string_view(name) != "fStop" || !is_unfocused) return;
            const Vec3d middle = 0.5 * (status.bounds.min + status.bounds.max);
            const double far = (middle - origin_of(editor_.camera()->render_from_camera)).length();
            s.values.set(camera->path, "focusDistance", "float", float_text(far));
        });
    };
    row("focal length", "focalLength", camera->focal_length, 0.005f, 0.01f);
    compositor::window::explain(
        "Tenths of a scene unit, or millimeters, by the units of the camera");
    row("f-stop", "fStop", camera->f_stop, 0.01f, 0);
    compositor::window::explain("0: everything is in focus");
    row("focus distance", "focusDistance", camera->focus_distance, 0.005f, 0);
    if (compositor::window::switch_button("pick focus", "Pick the focus", wants_focus_,
                                          color::accent))
        wants_focus_ = !wants_focus_;
    note("pick focus");
    compositor::window::explain("The next click in the image sets the focus distance");
}

void ScenePage::draw_light(const LiveLight& light, const LiveStatus& status) {
    const layers::LightValues& v = light.values;
    if (v.is_in_instance) {
        compositor::window::text("inside an instance: edits do not reach it", color::dim);
        return;
    }
    const auto one = [&](const char* label, const char* name, double value, float speed,
                         float least, float most) {
        const auto set_to =
            numbers(label, label, {float(value), 0, 0}, 1, speed, "%.5g", least, most);
        if (set_to)
            set(v.path, std::string("inputs:") + name, "float", float_text((*set_to)[0]),
                is_connected(light, name));
    };
    one("intensity", "intensity", v.intensity, 0.01f * std::max(float(v.intensity), 0.01f), 0,
        1e9f);
    one("exposure", "exposure", v.exposure, 0.02f, -30, 30);
    if (v.has_color_space) {
        compositor::window::text("color: authored in another color space", color::dim);
    } else {
        Numbers rgb = {float(v.color[0]), float(v.color[1]), float(v.color[2])};
        const ImGuiID id = ImGui::GetID("color");
        if (held_ == id) rgb = held_value_;
        ImGui::SetNextItemWidth(0.6f * ImGui::GetContentRegionAvail().x);
        const bool is_changed = ImGui::ColorEdit3(
            "color", rgb.data(),
            ImGuiColorEditFlags_Float | ImGuiColorEditFlags_HDR | ImGuiColorEditFlags_NoOptions);
        note("color");
        if (ImGui::IsItemActive()) {
            held_ = id;
            held_value_ = rgb;
        } else if (held_ == id) {
            held_ = 0;
        }
        if (is_changed)
            set(v.path, "inputs:color", "color3f", color_text({rgb[0], rgb[1], rgb[2]}),
                is_connected(light, "color"));
    }
    bool has_temperature = v.uses_color_temperature;
    if (ImGui::Checkbox("temperature", &has_temperature))
        set(v.path, "inputs:enableColorTemperature", "bool", has_temperature ? "true" : "false");
    note("temperature");
    if (v.uses_color_temperature)
        one("kelvin", "colorTemperature", v.color_temperature, 20, 1000, 10000);
    if (light.render_from_light && light.has_place) {
        const Vec3d at = origin_of(*light.render_from_light) + status.scene->origin;
        const double size = std::max((status.bounds.max - status.bounds.min).length(), 1e-6);
        const auto set_to =
            numbers("position", "position", {float(at[0]), float(at[1]), float(at[2])}, 3,
                    float(0.001 * size), "%.4g");
        if (set_to) {
            Mat4d world = *light.render_from_light;
            for (int i = 0; i < 3; ++i) world[3][i] = double((*set_to)[size_t(i)]);
            editor_.edit("position " + v.path, ImGui::IsItemActive(),
                         [&](SceneState& s) { s.values.set_transform(v.path, world); });
        }
        compositor::window::explain(
            "Of the light, in the world; the axes in the image move it too");
    }
    ImGui::BeginDisabled(!editor_.state().values.has(v.path));
    if (ImGui::Button("As in the scene"))
        editor_.edit("", false, [&](SceneState& s) { s.values.remove(v.path); });
    note("reset light");
    ImGui::EndDisabled();
}

void ScenePage::draw_lights(const LiveStatus& status) {
    heading("Lights");
    const auto& lights = status.scene->lights;
    const float unit = ImGui::GetFontSize();
    const float height =
        std::min(8.0f, float(lights.size()) + 0.5f) * ImGui::GetTextLineHeightWithSpacing();
    if (ImGui::BeginChild("list", {0, height}, false)) {
        for (const LiveLight& light : lights) {
            const std::string& path = light.values.path;
            const std::string shown =
                compositor::window::fitted(path, ImGui::GetContentRegionAvail().x - 10 * unit);
            const bool is_edited = editor_.state().values.has(path);
            if (is_edited) ImGui::PushStyleColor(ImGuiCol_Text, color::accent);
            if (ImGui::Selectable((shown + "##" + path).c_str(), path == gizmo_.selected())) {
                gizmo_.select(path);
                gizmo_.show(true);
            }
            if (is_edited) ImGui::PopStyleColor();
            note("edit " + path);
            ImGui::SameLine(ImGui::GetContentRegionAvail().x - 9 * unit);
            compositor::window::text(light.values.type + " · " + light.group, color::dim);
        }
    }
    ImGui::EndChild();
    const auto at = std::find_if(lights.begin(), lights.end(), [&](const LiveLight& l) {
        return l.values.path == gizmo_.selected();
    });
    if (at == lights.end()) {
        compositor::window::text("select a light, here or in the image", color::dim);
        return;
    }
    ImGui::PushID(at->values.path.c_str());
    draw_light(*at, status);
    ImGui::PopID();
}

void ScenePage::draw_problems(const LiveStatus& status) {
    if (!status.problems || status.problems->empty()) return;
    heading("Messages of the scene");
    for (const std::string& line : *status.problems) {
        ImGui::PushTextWrapPos(0);
        const bool is_error = line.find(": error:") != std::string::npos;
        compositor::window::text(line, is_error ? color::error : color::text);
        ImGui::PopTextWrapPos();
        note("problem");
    }
}

void ScenePage::draw(const LiveStatus& status, Marks& marks) {
    marks_ = &marks;
    if (status.scene) {
        draw_camera(status);
        draw_lights(status);
    }
    draw_problems(status);
    marks_ = nullptr;
}

}  // namespace velatura::view
