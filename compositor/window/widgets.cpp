// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/widgets.h"

#include "compositor/window/names_shown.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::compositor::window {

void note_item(Drawing& drawing, const std::string& name) {
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    const ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImVec2 from = list.GetClipRectMin(), to = list.GetClipRectMax();
    // Frames may reach half a pixel over the edge
    const bool is_cut =
        low.x < from.x - 1 || low.y < from.y - 1 || high.x > to.x + 1 || high.y > to.y + 1;
    drawing.marks.note(name, {low.x, low.y, high.x, high.y, is_cut});
}

void text(const std::string& line) {
    ImGui::TextUnformatted(line.data(), line.data() + line.size());
}

void text(const std::string& line, const ImVec4& c) {
    ImGui::PushStyleColor(ImGuiCol_Text, c);
    text(line);
    ImGui::PopStyleColor();
}

void next_in_line(float width, float gap) {
    ImGui::SameLine(0, gap);
    if (ImGui::GetCursorPosX() + width > ImGui::GetWindowContentRegionMax().x) ImGui::NewLine();
}

std::string fitted(const std::string& name, float width) {
    return shorten_middle(name, [&](const std::string& shorter) {
        return ImGui::CalcTextSize(shorter.data(), shorter.data() + shorter.size()).x <= width;
    });
}

void fitted_text(const std::string& name, float width, const ImVec4& c) {
    const std::string shown = fitted(name, width);
    text(shown, c);
    if (shown != name && ImGui::IsItemHovered()) explain(name.c_str());
}

bool begin_menu(const char* label, bool is_enabled) {
    if (!ImGui::BeginMenu(label, is_enabled)) return false;
    if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) ImGui::CloseCurrentPopup();
    return true;
}

float stops_width() {
    return ImGui::CalcTextSize("-20.00 st").x + 2 * ImGui::GetStyle().FramePadding.x;
}

void explain(const char* what) {
    constexpr double rest_s = 0.6;
    if (!ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) return;
    static ImGuiID item = 0;
    static double since = 0;
    const ImGuiID now = ImGui::GetID(what);
    const ImGuiIO& io = ImGui::GetIO();
    const bool is_moved = io.MouseDelta.x != 0 || io.MouseDelta.y != 0;
    if (item != now || is_moved || ImGui::IsAnyItemActive()) since = ImGui::GetTime();
    item = now;
    if (ImGui::GetTime() - since < rest_s) return;
    ImGui::BeginTooltip();
    text(what);
    ImGui::EndTooltip();
}

std::optional<float> drag_slider(const char* id, float value, float min, float max, float width) {
    static float dragged = 0;  // one slider at a time
    const float height = ImGui::GetFrameHeight();
    const ImVec2 low = ImGui::GetCursorScreenPos(), high = {low.x + width, low.y + height};
    ImGui::InvisibleButton(id, {width, height});
    const bool is_hovered = ImGui::IsItemHovered(), is_active = ImGui::IsItemActive();
    std::optional<float> changed;
    if (ImGui::IsItemActivated()) dragged = std::clamp(value, min, max);
    if (is_hovered && ImGui::IsMouseDoubleClicked(0)) {
        changed = dragged = std::clamp(0.0f, min, max);
    } else if (is_active && ImGui::GetIO().MouseDelta.x != 0) {
        const float fine = ImGui::GetIO().KeyShift ? 0.1f : 1.0f;
        dragged += fine * ImGui::GetIO().MouseDelta.x / width * (max - min);
        changed = std::clamp(dragged, min, max);
    }

    const float shown = std::clamp(changed.value_or(value), min, max);
    const auto x_of = [&](float v) { return low.x + (v - min) / (max - min) * width; };
    ImDrawList* draw = ImGui::GetWindowDrawList();
    const float zero = x_of(std::clamp(0.0f, min, max)), x = x_of(shown);
    const float middle = std::floor((low.y + high.y) / 2), thin = std::floor(height / 6);
    draw->AddRectFilled({low.x, middle - thin}, {high.x, middle + thin},
                        packed(is_hovered || is_active ? color::field_hovered : color::field),
                        thin);
    draw->AddRectFilled({std::min(zero, x), middle - thin}, {std::max(zero, x), middle + thin},
                        packed(with_alpha(color::accent, 0.75f)), thin);
    if (min < 0)
        draw->AddLine({zero, middle - 2 * thin}, {zero, middle + 2 * thin}, packed(color::line));
    draw->AddCircleFilled({x, middle}, height / 3.6f,
                          packed(shown != 0 || is_active ? color::accent : color::dim));
    return changed;
}

std::optional<float> stops_box(const char* id, float stops, float width) {
    constexpr float max = 20;
    std::array<char, 32> typed{};
    fmt::format_to_n(typed.data(), typed.size() - 1, "{:+.2f} st", stops);
    ImGui::SetNextItemWidth(width);
    if (!ImGui::InputText(id, typed.data(), typed.size(), ImGuiInputTextFlags_AutoSelectAll))
        return std::nullopt;
    const auto value = stops_of_text(typed.data());
    if (!value) return std::nullopt;
    return std::clamp(*value, -max, max);
}

bool switch_button(const char* id, const char* label, bool is_on, const ImVec4& on_color) {
    ImGui::PushID(id);
    if (is_on) {
        ImGui::PushStyleColor(ImGuiCol_Button, on_color);
        ImGui::PushStyleColor(ImGuiCol_ButtonHovered, on_color);
        ImGui::PushStyleColor(ImGuiCol_Text, color::workspace);
    } else {
        ImGui::PushStyleColor(ImGuiCol_Button, color::field);
        ImGui::PushStyleColor(ImGuiCol_ButtonHovered, color::field_hovered);
        ImGui::PushStyleColor(ImGuiCol_Text, color::dim);
    }
    const float side = ImGui::GetFrameHeight();
    const float width = std::max(side, ImGui::CalcTextSize(label).x + side / 2);
    const bool is_pressed = ImGui::Button(label, {width, side});
    ImGui::PopStyleColor(3);
    ImGui::PopID();
    return is_pressed;
}

bool quiet_button(const char* id, const char* label, bool is_enabled) {
    ImGui::PushID(id);
    ImGui::PushStyleColor(ImGuiCol_Button, ImVec4(0, 0, 0, 0));
    ImGui::BeginDisabled(!is_enabled);
    const bool is_pressed = ImGui::Button(label);
    ImGui::EndDisabled();
    ImGui::PopStyleColor();
    ImGui::PopID();
    return is_pressed;
}

void share_bar(double share, float width, const ImVec4& c) {
    const float height = ImGui::GetTextLineHeight(), thin = std::floor(height / 5);
    const ImVec2 low = ImGui::GetCursorScreenPos();
    const float middle = std::floor(low.y + height / 2);
    ImDrawList* draw = ImGui::GetWindowDrawList();
    draw->AddRectFilled({low.x, middle - thin}, {low.x + width, middle + thin},
                        packed(color::field), thin);
    draw->AddRectFilled({low.x, middle - thin},
                        {low.x + width * float(std::clamp(share, 0.0, 1.0)), middle + thin},
                        packed(c), thin);
    ImGui::Dummy({width, height});
}

std::string percent_text(double share) {
    const double percent = 100 * share;
    return percent < 10 ? fmt::format("{:.2f} %", percent) : fmt::format("{:.1f} %", percent);
}

}  // namespace velatura::compositor::window
