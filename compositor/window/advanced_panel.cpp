// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/mixer_panel.h"
#include "compositor/window/widgets.h"

namespace velatura::compositor::window {

namespace {

/// The frame at which keys are read.
void draw_frame(Drawing& drawing) {
    Session& session = drawing.session;
    ImGui::AlignTextToFramePadding();
    text("keys at frame", color::dim);
    ImGui::SameLine();
    double frame = session.frame();
    ImGui::SetNextItemWidth(5 * ImGui::GetFontSize());
    if (ImGui::InputDouble("##frame", &frame, 0, 0, "%g", ImGuiInputTextFlags_AutoSelectAll))
        session.set_frame(frame);
    note_item(drawing, "frame");
    explain("Values between keys are linear; the file's frame at first");
}

}  // namespace

void draw_advanced(Drawing& drawing) {
    Session& session = drawing.session;
    ImGui::Separator();
    if (!ImGui::BeginChild("further")) return ImGui::EndChild();
    ImGui::AlignTextToFramePadding();
    text("Also in this look", color::dim);
    if (has_keys(session.look())) {
        ImGui::SameLine(0, 2 * ImGui::GetFontSize());
        draw_frame(drawing);
    }
    ImGui::PushTextWrapPos(0);
    for (const std::string& note : session.notes()) text(note, color::dim);
    ImGui::PopTextWrapPos();
    for (const size_t i : advanced_controls(session.look(), session.rows(), session.matte())) {
        ImGui::PushID(int(i));
        const std::string line = control_text(session.look().controls[i]);
        const bool is_removed = quiet_button("remove", "×", true);
        note_item(drawing, "remove " + line);
        ImGui::SameLine();
        fitted_text(line, ImGui::GetContentRegionAvail().x, color::text);
        ImGui::PopID();
        if (!is_removed) continue;
        session.edit("", [&](Look& l) { l.controls.erase(l.controls.begin() + long(i)); });
        break;
    }
    ImGui::EndChild();
}

}  // namespace velatura::compositor::window
