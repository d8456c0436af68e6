// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/menu_bar.h"

#include "compositor/window/widgets.h"

#include <fmt/format.h>

#include <filesystem>
#include <vector>

namespace velatura::compositor::window {

namespace {

void draw_recent(Drawing& drawing) {
    const std::vector<std::string>& recent = drawing.session.recent().paths();
    if (!begin_menu("Open recent", !recent.empty())) return;
    for (const std::string& path : recent) {
        const float width = 0.6f * ImGui::GetIO().DisplaySize.x;
        ImGui::PushID(path.c_str());
        if (ImGui::MenuItem(fitted(path, width).c_str())) drawing.open_file(path);
        note_item(drawing, "recent " + path);
        ImGui::PopID();
    }
    ImGui::EndMenu();
}

void draw_views(Drawing& drawing) {
    const Session& session = drawing.session;
    const bool is_stereo = session.has_file() && !session.stack().views().empty();
    const bool is_open = begin_menu("Stereo view", is_stereo);
    note_item(drawing, "menu Stereo view");
    if (!is_open) return;
    for (const std::string& view : session.stack().views()) {
        if (ImGui::MenuItem(view.c_str(), nullptr, view == session.stack().view()))
            drawing.open_view(view);
        note_item(drawing, "stereo " + view);
    }
    ImGui::EndMenu();
}

bool always(const Session& /*session*/) {
    return true;
}

bool has_file(const Session& session) {
    return session.has_file();
}

bool can_undo(const Session& session) {
    return session.can_undo();
}

bool can_redo(const Session& session) {
    return session.can_redo();
}

bool is_following(const Session& session) {
    return session.is_following();
}

bool is_comparing(const Session& session) {
    return !session.compared().empty();
}

bool is_denoising(const Session& session) {
    return session.is_denoising();
}

bool is_sorting(const Session& session) {
    return session.is_sorting();
}

/// A line of a menu: an action, a menu of its own (`draw`), or a line between others (no label).
struct Entry {
    const char* label = nullptr;
    Action action = Action::ShowHelp;
    bool (*is_enabled)(const Session&) = has_file;
    void (*draw)(Drawing&) = nullptr;
    bool (*is_on)(const Session&) = nullptr;  ///< of a switch
};

struct Menu {
    const char* label;
    bool (*is_enabled)(const Session&);
    std::vector<Entry> entries;
};

/// All menus. Keys are those of the table of keys.
const std::vector<Menu>& menus() {
    static const std::vector<Menu> all = {
        {"File",
         always,
         {{"Open …", Action::OpenFile, always},
          {"Open recent", Action::OpenFile, always, draw_recent},
          {"Read again", Action::Reload},
          {"Follow the file", Action::Follow, has_file, nullptr, is_following},
          {"Compare with …", Action::Compare},
          {"End the comparison", Action::EndComparison, is_comparing},
          {"Previous frame", Action::PreviousFrame},
          {"Next frame", Action::NextFrame},
          {"Stereo view", Action::OpenFile, has_file, draw_views},
          {},
          {"Load preset …", Action::OpenPreset, always},
          {"Save preset …", Action::SavePreset},
          {"Save image …", Action::SaveImage},
          {},
          {"Export to Nuke …", Action::ExportNuke},
          {"Export to oiiotool …", Action::ExportOiio},
          {"Export to Blender …", Action::ExportBlender},
          {"Bake into lights …", Action::BakeLook},
          {"Request samples …", Action::RequestSamples},
          {},
          {"Quit", Action::Quit, always}}},
        {"Edit",
         has_file,
         {{"Undo", Action::Undo, can_undo},
          {"Redo", Action::Redo, can_redo},
          {},
          {"Search rows", Action::SearchRows},
          {"Reset row", Action::ResetRow},
          {"Reset all", Action::ResetAll},
          {},
          {"Copy over the other look", Action::CopyLook}}},
        {"View",
         has_file,
         {{"Fit", Action::ZoomFit},
          {"1:1", Action::ZoomOne},
          {},
          {"Color", Action::ShowColor},
          {"Red", Action::ShowRed},
          {"Green", Action::ShowGreen},
          {"Blue", Action::ShowBlue},
          {"Alpha", Action::ShowAlpha},
          {"Luminance", Action::ShowLuminance},
          {"Next layer", Action::NextLayer},
          {"Previous layer", Action::PreviousLayer},
          {"Mark NaN and clipping", Action::FlagPixels},
          {"False color", Action::ShowStops},
          {"Sample heat map", Action::ShowSamples},
          {"Noise map", Action::ShowNoise},
          {"Denoised", Action::Denoise, has_file, nullptr, is_denoising},
          {"Sort rows by the pixel", Action::SortByPixel, has_file, nullptr, is_sorting},
          {"Pick objects", Action::PickMatte},
          {},
          {"Take a snapshot", Action::TakeSnapshot},
          {"Freeze as B", Action::Freeze},
          {"Wipe A | B", Action::ToggleWipe},
          {"Edit the other look", Action::SwitchLook}}},
        {"Help", always, {{"Keys", Action::ShowHelp, always}}}};
    return all;
}

void draw_entry(Drawing& drawing, const Entry& entry) {
    Session& session = drawing.session;
    if (!entry.label) return ImGui::Separator();
    if (entry.draw) return entry.draw(drawing);
    const bool is_on = entry.is_on && entry.is_on(session);
    if (ImGui::MenuItem(entry.label, keys_of(entry.action), is_on, entry.is_enabled(session)))
        session.perform(entry.action);
    note_item(drawing, std::string("menu ") + entry.label);
}

void draw_menus(Drawing& drawing) {
    for (const Menu& menu : menus()) {
        const bool is_open = begin_menu(menu.label, menu.is_enabled(drawing.session));
        if (is_open) {
            for (const Entry& entry : menu.entries) draw_entry(drawing, entry);
            ImGui::EndMenu();
        }
        note_item(drawing, std::string("menu ") + menu.label);
    }
}

/// Of the look that is edited; empty: none, or not yet counted.
std::string faults_text(const Drawing& drawing) {
    const Session& session = drawing.session;
    const ImageTask* image = session.has_file() ? session.image(session.active()) : nullptr;
    if (!image) return {};
    const image::Window& frame = session.stack().image().display;
    const auto flagged = drawing.flagged.of(session.active(), image->version, frame.pixel_count());
    return flagged ? flagged->text() : std::string();
}

}  // namespace

void draw_menu_bar(Drawing& drawing) {
    const Session& session = drawing.session;
    if (!ImGui::BeginMenuBar()) return;
    draw_menus(drawing);
    if (session.has_file()) {
        const image::Window& frame = session.image_frame();
        const auto name_of = [](const std::string& path) {
            return std::filesystem::path(path).filename().string();
        };
        const std::string name =
            name_of(session.path()) +
            (session.compared().empty() ? "" : " | " + name_of(session.compared()));
        const float unit = ImGui::GetFontSize();
        const std::string size = fmt::format("   {}×{}", frame.width(), frame.height());
        const float room = ImGui::GetWindowWidth() - ImGui::GetCursorPosX() - 2 * unit;
        const std::string title = fitted(name, room - ImGui::CalcTextSize(size.c_str()).x) + size;
        ImGui::SameLine(ImGui::GetWindowWidth() - ImGui::CalcTextSize(title.c_str()).x - unit);
        text(title, color::dim);
        note_item(drawing, "title");
        if (ImGui::IsItemHovered()) explain(session.path().c_str());
    }
    ImGui::EndMenuBar();
}

void draw_status_line(Drawing& drawing) {
    const Session& session = drawing.session;
    const std::string error = session.look_error();
    const bool is_error = !error.empty() || session.message().is_error;
    const MixTimes& t = drawing.times;
    const std::string pace =
        !session.has_file() ? std::string()
        : t.seen > 0 ? fmt::format("mix {:.0f} ms{}", t.seen, drawing.is_working ? " …" : "")
                     : std::string("mixing …");
    const std::string flagged = faults_text(drawing), &live = drawing.live_state;
    const float unit = ImGui::GetFontSize();
    const auto width = [](const std::string& s) { return ImGui::CalcTextSize(s.c_str()).x; };
    const float gap = flagged.empty() ? 0 : unit, live_gap = live.empty() ? 0 : unit;
    const float right = ImGui::GetWindowWidth() - width(pace) - width(flagged) - gap - width(live) -
                        live_gap - unit;
    fitted_text(error.empty() ? session.message().text : error,
                right - ImGui::GetCursorPosX() - unit, is_error ? color::error : color::dim);
    note_item(drawing, "status");
    ImGui::SameLine(right);
    if (!live.empty()) {
        text(live, color::text);
        note_item(drawing, "live");
        ImGui::SameLine(0, live_gap);
    }
    if (!flagged.empty()) {
        text(flagged, color::error);
        note_item(drawing, "faults");
        explain("Pixels of the shown image; O marks them");
        ImGui::SameLine(0, gap);
    }
    text(pace, color::dim);
    note_item(drawing, "pace");
}

}  // namespace velatura::compositor::window
