// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/mixer_panel.h"
#include "compositor/window/widgets.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::compositor::window {

namespace {

using Kind = Control::Kind;

/// One share from 0 to 1: a name, a slider, a box, a way back.
void draw_share(Drawing& drawing, Kind kind, const std::string& target, const std::string& title) {
    Session& session = drawing.session;
    const float unit = ImGui::GetFontSize();
    const std::string name = fmt::format("{} {}", name_of(kind), target);
    const RowTarget row(target, session.matte());
    const float now = share_given(session.look(), kind, row);
    const auto set = [&](float to) {
        session.edit(name, [&](Look& l) { set_share(l, kind, row, to); });
    };
    ImGui::PushID(name.c_str());
    ImGui::AlignTextToFramePadding();
    fitted_text(title, 9.5f * unit, color::text);
    ImGui::SameLine(10 * unit);
    const float width = std::max(ImGui::GetContentRegionAvail().x - 6.8f * unit, 3 * unit);
    if (const auto changed = drag_slider("share", now, 0, 1, width)) set(*changed);
    note_item(drawing, name);
    explain("Drag (Shift: finer); double click: as rendered");
    ImGui::SameLine();
    float percent = 100 * now;
    ImGui::SetNextItemWidth(4 * unit);
    if (ImGui::InputFloat("##percent", &percent, 0, 0, "%.0f %%",
                          ImGuiInputTextFlags_AutoSelectAll))
        set(percent / 100);
    ImGui::SameLine();
    if (quiet_button("reset", "↺", now > 0)) set(0);
    ImGui::PopID();
}

/// The casters of a group, below it.
void draw_casters(Drawing& drawing, const std::string& group) {
    const std::vector<std::string>& casters = drawing.session.rows().casters;
    for (const std::string& target : casters) {
        if (!target.starts_with(group + ":")) continue;
        draw_share(drawing, Kind::Caster, target, "    " + target.substr(group.size() + 1));
    }
}

void draw_clamps(Drawing& drawing) {
    const std::vector<std::string>& clamps = drawing.session.rows().clamps;
    if (clamps.empty()) return;
    ImGui::Spacing();
    ImGui::Separator();
    text("Undoes the firefly clamp.", color::dim);
    for (const std::string& target : drawing.session.found(clamps))
        draw_share(drawing, Kind::Clamp, target, target == "all" ? "all light" : target);
}

}  // namespace

void draw_shadows(Drawing& drawing) {
    const std::vector<std::string>& groups = drawing.session.rows().shadows;
    if (groups.empty()) {
        text("This file has no shadow layers; render with shadow among --layers.", color::dim);
    } else {
        text("Lifts the shadows of a light: 0 as rendered, 100 % none.", color::dim);
    }
    ImGui::Spacing();
    for (const std::string& group : drawing.session.found(groups)) {
        draw_share(drawing, Kind::Shadow, group, group);
        draw_casters(drawing, group);
    }
    draw_clamps(drawing);
}

}  // namespace velatura::compositor::window
