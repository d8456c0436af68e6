// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/mixer_panel.h"
#include "compositor/window/widgets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace velatura::compositor::window {

namespace {

constexpr float max_stops = 20;
/// What a table of Dear ImGui takes.
constexpr size_t max_columns = 64;

/// Which lobe the cells are of.
void draw_lobe_choice(Drawing& drawing) {
    Session& session = drawing.session;
    const std::vector<std::string>& lobes = session.rows().lobes;
    if (lobes.empty()) return;
    constexpr const char* all = "all lobes";
    const std::string& now = session.lobe_of_cells();
    ImGui::SetNextItemWidth(-1);
    const bool is_open = ImGui::BeginCombo("##lobe", now.empty() ? all : now.c_str());
    note_item(drawing, "lobe of cells");
    if (!is_open) return;
    if (ImGui::Selectable(all, now.empty())) session.set_lobe_of_cells("");
    note_item(drawing, std::string("lobe ") + all);
    for (const std::string& lobe : lobes) {
        if (lobe == accumulate::emission_lobe) continue;
        if (ImGui::Selectable(lobe.c_str(), lobe == now)) session.set_lobe_of_cells(lobe);
        note_item(drawing, "lobe " + lobe);
    }
    ImGui::EndCombo();
}

/// A number to drag, colored by how far it is from 0. The target is a cell, a group or a bounce.
void draw_cell(Drawing& drawing, const std::string& target) {
    Session& session = drawing.session;
    const RowTarget row(target, session.matte());
    const RowState state = row_state(session.look(), row);
    ImGui::TableNextColumn();
    ImGui::PushID(target.c_str());
    const float strength = std::min(std::abs(state.stops) / 4, 1.0f) * 0.5f;
    const bool is_changed = state.stops != 0 && !state.is_muted;
    ImVec4 fill = state.is_muted ? with_alpha(color::mute, 0.45f) : color::field;
    if (is_changed) {
        const ImVec4& toward = state.stops > 0 ? color::accent : ImVec4(0.35f, 0.55f, 0.80f, 1);
        fill = {fill.x + (toward.x - fill.x) * strength, fill.y + (toward.y - fill.y) * strength,
                fill.z + (toward.z - fill.z) * strength, 1};
    }
    ImGui::PushStyleColor(ImGuiCol_FrameBg, fill);
    ImGui::PushStyleColor(ImGuiCol_Text, is_changed ? color::text : color::dim);
    float stops = state.stops;
    ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x);
    if (ImGui::DragFloat("##stops", &stops, 0.02f, -max_stops, max_stops,
                         state.is_muted     ? "mute"
                         : state.stops == 0 ? "0"
                                            : "%+.2f",
                         ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_NoRoundToFormat))
        session.edit("cell " + target, [&](Look& l) { set_stops(l, row, stops); });
    ImGui::PopStyleColor(2);
    note_item(drawing, "cell " + target);
    if (ImGui::IsItemHovered()) {
        if (ImGui::IsMouseClicked(ImGuiMouseButton_Right))
            session.edit("", [&](Look& l) { reset_row(l, row); });
        if (ImGui::IsMouseClicked(ImGuiMouseButton_Middle))
            session.edit("", [&](Look& l) { set_muted(l, row, !state.is_muted); });
    }
    ImGui::PopID();
}

void draw_name(const std::string& name) {
    ImGui::TableNextColumn();
    ImGui::AlignTextToFramePadding();
    fitted_text(name, ImGui::GetContentRegionAvail().x, color::text);
}

}  // namespace

void draw_cells(Drawing& drawing) {
    const std::vector<std::string> groups = drawing.session.found(drawing.session.rows().groups);
    draw_lobe_choice(drawing);
    // As the look names them: GROUP:LOBE:BOUNCE
    const std::vector<std::string>& lobes = drawing.session.rows().lobes;
    const std::string& chosen = drawing.session.lobe_of_cells();
    const bool is_of_lobe = std::find(lobes.begin(), lobes.end(), chosen) != lobes.end();
    const std::string of_lobe = is_of_lobe ? ":" + chosen : "";
    std::span<const std::string> columns = drawing.session.rows().columns;
    // Emission seen directly has no lobe
    if (is_of_lobe && !columns.empty() && columns.front() == "b0") columns = columns.subspan(1);
    // Names and whole rows take two
    if (columns.size() + 2 > max_columns) {
        text(fmt::format("{} … {} do not fit here; see the page of the bounces.",
                         columns[max_columns - 2], columns.back()),
             color::dim);
        note_item(drawing, "left out");
        columns = columns.first(max_columns - 2);
    }
    ImGui::PushTextWrapPos(0);
    text("Stops. Drag, Ctrl-click to type, right click resets, middle click mutes.", color::dim);
    ImGui::PopTextWrapPos();
    const float unit = ImGui::GetFontSize();
    if (!ImGui::BeginTable("cells", int(columns.size()) + 2,
                           ImGuiTableFlags_ScrollX | ImGuiTableFlags_ScrollY |
                               ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_NoPadOuterX))
        return;
    ImGui::TableSetupScrollFreeze(1, 2);
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, 5.2f * unit);
    ImGui::TableSetupColumn("all", ImGuiTableColumnFlags_WidthFixed, 3.15f * unit);
    for (const std::string& column : columns)
        ImGui::TableSetupColumn(column.c_str(), ImGuiTableColumnFlags_WidthFixed, 3.15f * unit);
    ImGui::TableHeadersRow();
    ImGui::TableNextRow();
    draw_name("all light");
    draw_cell(drawing, is_of_lobe ? chosen : "all");
    for (const std::string& column : columns)
        draw_cell(drawing, is_of_lobe ? chosen + ":" + column : column);
    for (const std::string& group : groups) {
        ImGui::TableNextRow();
        draw_name(group);
        draw_cell(drawing, group + of_lobe);
        for (const std::string& column : columns)
            draw_cell(drawing, group + of_lobe + ":" + column);
    }
    ImGui::EndTable();
}

}  // namespace velatura::compositor::window
