// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/dialogs.h"

#include "compositor/window/widgets.h"

#include <algorithm>
#include <filesystem>

namespace velatura::compositor::window {

namespace {

namespace fs = std::filesystem;

struct FileDialog {
    const char* title;
    const char* button;
    const char* extension;
    const char* hint;
};

FileDialog file_dialog(Dialog dialog, OutputKind kind) {
    const Output& output = output_of(kind);
    switch (dialog) {
        case Dialog::OpenPreset:
            return {"Load preset", "Load", ".json", "preset.json"};
        case Dialog::SavePreset:
            return {"Save preset", "Save", ".json", "preset.json"};
        case Dialog::OpenCompared:
            return {"Compare with", "Compare", ".exr", "another.exr"};
        case Dialog::WriteOutput:
            return {output.title, "Save", output.extension, output.hint};
        default:
            return {"Open light layers", "Open", ".exr", "layers.exr"};
    }
}

}  // namespace

void Dialogs::go_to(const std::string& folder) {
    list_ = list_folder(folder, file_dialog(shown_, output_).extension);
}

void Dialogs::begin(Drawing& drawing) {
    shown_ = drawing.session.dialog();
    output_ = drawing.session.output();
    name_[0] = '\0';
    // Where the artist was last, or where the file is
    const std::string of_file = fs::path(drawing.session.path()).parent_path().string();
    go_to(!list_.folder.empty() ? list_.folder : of_file);
    ImGui::OpenPopup("dialog");
}

void Dialogs::draw(Drawing& drawing) {
    Session& session = drawing.session;
    if (session.dialog() != shown_) {
        if (session.dialog() == Dialog::None)
            shown_ = Dialog::None;
        else
            begin(drawing);
    }
    if (shown_ == Dialog::None) return;
    const ImVec2 screen = ImGui::GetIO().DisplaySize;
    const float unit = ImGui::GetFontSize();
    ImGui::SetNextWindowPos({screen.x / 2, screen.y / 2}, ImGuiCond_Always, {0.5f, 0.5f});
    const bool is_question = shown_ == Dialog::Replace || shown_ == Dialog::Quit;
    // A question is as high as what it says
    ImGui::SetNextWindowSize({std::min(42 * unit, screen.x - 2 * unit),
                              is_question ? 0 : std::min(40 * unit, screen.y - 2 * unit)});
    if (ImGui::BeginPopupModal(
            "dialog", nullptr,
            ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove)) {
        if (shown_ == Dialog::Help)
            draw_help(drawing);
        else if (shown_ == Dialog::Replace)
            draw_replace(drawing);
        else if (shown_ == Dialog::Quit)
            draw_quit(drawing);
        else
            draw_files(drawing);
        if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape)))
            session.set_dialog(Dialog::None);
        if (session.dialog() == Dialog::None) ImGui::CloseCurrentPopup();
        ImGui::EndPopup();
    }
    if (session.dialog() == Dialog::None) shown_ = Dialog::None;
}

void Dialogs::draw_help(Drawing& drawing) {
    text("Keys");
    ImGui::Separator();
    const float unit = ImGui::GetFontSize();
    if (ImGui::BeginChild("keys", {0, -2 * unit})) {
        for (const KeyBinding& b : key_bindings()) {
            text(b.keys, color::accent);
            ImGui::SameLine(9 * unit);
            text(b.what);
        }
        ImGui::Spacing();
        for (const auto& [keys, what] :
             {std::pair{"Alt-click", "Solo a row alone (on its M, S or name)"},
              std::pair{"Double click", "A slider as rendered; on the image: fit or 1:1"},
              std::pair{"Right click", "What is under the mouse as rendered"},
              std::pair{"Wheel, drag", "Zoom and pan the image"},
              std::pair{"Drop a file", "Open layers, or load a preset"}}) {
            text(keys, color::accent);
            ImGui::SameLine(9 * unit);
            text(what);
        }
    }
    ImGui::EndChild();
    if (ImGui::Button("Close")) drawing.session.set_dialog(Dialog::None);
    note_item(drawing, "close");
}

void Dialogs::draw_replace(Drawing& drawing) {
    Session& session = drawing.session;
    const auto& [what, path] = session.replaced();
    ImGui::PushTextWrapPos(0);
    text(fs::path(path).filename().string() + " is there already.");
    text(path, color::dim);
    if (session.replaces_layers())
        text("It is the file that is open: its layers would be lost.", color::error);
    ImGui::PopTextWrapPos();
    ImGui::Spacing();
    const bool is_confirmed = ImGui::Button("Replace");
    note_item(drawing, "replace");
    ImGui::SameLine();
    if (ImGui::Button("Cancel")) session.set_dialog(Dialog::None);
    note_item(drawing, "cancel");
    if (!is_confirmed) return;
    session.set_dialog(Dialog::None);
    save(drawing, what, path);
}

void Dialogs::draw_quit(Drawing& drawing) {
    Session& session = drawing.session;
    ImGui::PushTextWrapPos(0);
    text("The look is not saved as a preset.");
    text("It is kept beside the recent files and comes back with this file.", color::dim);
    ImGui::PopTextWrapPos();
    ImGui::Spacing();
    if (ImGui::Button("Save preset …")) session.set_dialog(Dialog::SavePreset);
    note_item(drawing, "save first");
    ImGui::SameLine();
    if (ImGui::Button("Quit")) {
        session.set_dialog(Dialog::None);
        session.quit();
    }
    note_item(drawing, "quit");
    ImGui::SameLine();
    if (ImGui::Button("Cancel")) session.set_dialog(Dialog::None);
    note_item(drawing, "cancel");
}

void Dialogs::draw_list(Drawing& drawing) {
    const auto put_name = [this](const std::string& name) {
        const size_t length = std::min(name.size(), name_.size() - 1);
        std::copy_n(name.begin(), length, name_.begin());
        name_[length] = '\0';
    };
    const float width = ImGui::GetContentRegionAvail().x - ImGui::GetFontSize();
    if (ImGui::Selectable("..", false, ImGuiSelectableFlags_DontClosePopups))
        return go_to(fs::path(list_.folder).parent_path().string());
    for (const std::string& folder : list_.folders) {
        if (ImGui::Selectable((fitted(folder, width) + "/##" + folder).c_str(), false,
                              ImGuiSelectableFlags_DontClosePopups))
            return go_to((fs::path(list_.folder) / folder).string());
    }
    for (const std::string& file : list_.files) {
        const bool is_named = file == name_.data();
        if (ImGui::Selectable(
                (fitted(file, width) + "##" + file).c_str(), is_named,
                ImGuiSelectableFlags_DontClosePopups | ImGuiSelectableFlags_AllowDoubleClick)) {
            put_name(file);
            if (ImGui::IsMouseDoubleClicked(0)) return accept(drawing);
        }
        note_item(drawing, "file " + file);
    }
}

void Dialogs::draw_files(Drawing& drawing) {
    const FileDialog dialog = file_dialog(shown_, output_);
    const float unit = ImGui::GetFontSize();
    text(dialog.title);
    ImGui::PushTextWrapPos(0);
    text(list_.folder, color::dim);
    ImGui::PopTextWrapPos();
    ImGui::PushStyleColor(ImGuiCol_ChildBg, color::workspace);
    if (ImGui::BeginChild("files", {0, -4.4f * unit}, true)) draw_list(drawing);
    ImGui::EndChild();
    ImGui::PopStyleColor();
    if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
    ImGui::SetNextItemWidth(-1);
    const bool is_entered = ImGui::InputTextWithHint(
        "##name", dialog.hint, name_.data(), name_.size(), ImGuiInputTextFlags_EnterReturnsTrue);
    note_item(drawing, "name");
    const bool is_pressed = ImGui::Button(dialog.button, {6 * unit, 0});
    note_item(drawing, "accept");
    ImGui::SameLine();
    if (ImGui::Button("Cancel", {6 * unit, 0})) drawing.session.set_dialog(Dialog::None);
    if (is_entered || is_pressed) accept(drawing);
}

void Dialogs::accept(Drawing& drawing) {
    const std::string typed = name_.data();
    if (typed.empty()) return;
    Session& session = drawing.session;
    std::string path = path_in(list_.folder, typed);
    if (is_folder(path)) {
        name_[0] = '\0';
        return go_to(path);
    }
    path = with_extension(path, file_dialog(shown_, output_).extension);
    session.set_dialog(Dialog::None);
    if (shown_ == Dialog::OpenFile) return drawing.open_file(path);
    if (shown_ == Dialog::OpenCompared) return drawing.open_compared(path);
    if (shown_ == Dialog::OpenPreset) return session.load_preset(path);
    if (!session.ask_to_replace(shown_, path)) save(drawing, shown_, path);
}

void Dialogs::save(Drawing& drawing, Dialog what, const std::string& path) {
    if (what == Dialog::WriteOutput) return drawing.write_output(path);
    drawing.session.save_preset(path);
}

}  // namespace velatura::compositor::window
