// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/menu_bar.h"

#include "compositor/window/widgets.h"

#include <fmt/format.h>

#include <filesystem>

namespace velatura::compositor::window {

namespace {

void entry(Drawing& drawing, const char* label, Action action, bool is_enabled = true) {
    if (ImGui::MenuItem(label, keys_of(action), false, is_enabled)) drawing.session.perform(action);
    note_item(drawing, std::string("menu ") + label);
}

/// Whether the menu is open; Escape closes it.
bool begin_menu(const char* label, bool is_enabled = true) {
    if (!ImGui::BeginMenu(label, is_enabled)) return false;
    if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) ImGui::CloseCurrentPopup();
    return true;
}

void draw_recent(Drawing& drawing) {
    const std::vector<std::string>& recent = drawing.session.recent().paths();
    if (!begin_menu("Open recent", !recent.empty())) return;
    for (const std::string& path : recent) {
        if (ImGui::MenuItem(path.c_str())) drawing.open_file(path);
    }
    ImGui::EndMenu();
}

void draw_menus(Drawing& drawing) {
    const Session& session = drawing.session;
    const bool has_file = session.has_file();
    if (begin_menu("File")) {
        entry(drawing, "Open …", Action::OpenFile);
        draw_recent(drawing);
        entry(drawing, "Read again", Action::Reload, has_file);
        entry(drawing, "Previous frame", Action::PreviousFrame, has_file);
        entry(drawing, "Next frame", Action::NextFrame, has_file);
        ImGui::Separator();
        entry(drawing, "Load preset …", Action::OpenPreset);
        entry(drawing, "Save preset …", Action::SavePreset, has_file);
        entry(drawing, "Save picture …", Action::SavePicture, has_file);
        ImGui::Separator();
        entry(drawing, "Quit", Action::Quit);
        ImGui::EndMenu();
    }
    note_item(drawing, "menu File");
    if (begin_menu("Edit", has_file)) {
        entry(drawing, "Undo", Action::Undo, session.can_undo());
        entry(drawing, "Redo", Action::Redo, session.can_redo());
        ImGui::Separator();
        entry(drawing, "Reset row", Action::ResetRow);
        entry(drawing, "Reset all", Action::ResetAll);
        ImGui::Separator();
        entry(drawing, "Copy over the other look", Action::CopyLook);
        ImGui::EndMenu();
    }
    if (begin_menu("View", has_file)) {
        entry(drawing, "Fit", Action::ZoomFit);
        entry(drawing, "1:1", Action::ZoomOne);
        entry(drawing, "Wipe A | B", Action::ToggleWipe);
        entry(drawing, "Edit the other look", Action::SwitchLook);
        ImGui::EndMenu();
    }
    if (begin_menu("Help")) {
        entry(drawing, "Keys", Action::ShowHelp);
        ImGui::EndMenu();
    }
}

}  // namespace

void draw_menu_bar(Drawing& drawing) {
    const Session& session = drawing.session;
    if (!ImGui::BeginMenuBar()) return;
    draw_menus(drawing);
    if (session.has_file()) {
        const image::Window& frame = session.stack().image().display;
        const std::string name = std::filesystem::path(session.path()).filename().string();
        const std::string title = fmt::format("{}   {}×{}", name, frame.width(), frame.height());
        const float width = ImGui::CalcTextSize(title.c_str()).x;
        ImGui::SameLine(ImGui::GetWindowWidth() - width - ImGui::GetFontSize());
        text(title, colour::dim);
    }
    ImGui::EndMenuBar();
}

void draw_status_line(Drawing& drawing) {
    const Session& session = drawing.session;
    const std::string error = session.look_error();
    const bool is_error = !error.empty() || session.message().is_error;
    text(error.empty() ? session.message().text : error, is_error ? colour::error : colour::dim);
    const MixTimes& t = drawing.times;
    const std::string pace =
        !session.has_file() ? std::string()
        : t.seen > 0 ? fmt::format("mix {:.0f} ms{}", t.seen, drawing.is_working ? " …" : "")
                     : std::string("mixing …");
    const float width = ImGui::CalcTextSize(pace.c_str()).x;
    ImGui::SameLine(ImGui::GetWindowWidth() - width - ImGui::GetFontSize());
    text(pace, colour::dim);
}

}  // namespace velatura::compositor::window
