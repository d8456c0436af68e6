// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/mixer_panel.h"

#include "compositor/window/widgets.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>

namespace velatura::compositor::window {

namespace {

constexpr float slider_stops = 6;

/// What a row stands for, in a word or two.
std::string row_note(const LayerStack& stack, const std::string& target) {
    for (const accumulate::LightGroup& light : stack.header().lights) {
        if (light.name != target) continue;
        std::string note;
        for (const std::string& prim : light.prims) note += (note.empty() ? "" : "\n") + prim;
        return note.empty() ? "light of emissive geometry" : note;
    }
    if (target == "all") return "every light";
    if (target == "env") return "all domes together";
    if (target == "direct") return "b1: direct light, one bounce";
    if (target == "indirect") return "b2 to tail: indirect light, two bounces and more";
    if (target == "b0") return "emission and background seen directly";
    if (target == "tail") return "all remaining bounces";
    return "light after " + target.substr(1) + " scatterings";
}

const noise::RowNoise* noise_of(std::span<const noise::RowNoise> rows, const std::string& name) {
    const auto at = std::find_if(rows.begin(), rows.end(),
                                 [&](const noise::RowNoise& r) { return r.name == name; });
    return at == rows.end() ? nullptr : &*at;
}

/// A tint as an image of that color is on the screen.
ImVec4 screen_color(const Session& session, const std::array<float, 3>& tint) {
    const auto bytes = session.screen_color(tint);
    return {float(bytes[0]) / 255, float(bytes[1]) / 255, float(bytes[2]) / 255, 1};
}

/// One row of lights or bounces.
class Row {
  public:
    /// noise: what all rows of the page have of it; empty where it is not known.
    Row(Drawing& drawing, const std::string& target, std::span<const noise::RowNoise> noise)
        : drawing_(drawing),
          session_(drawing.session),
          target_(target),
          noise_(noise),
          row_(target, drawing.session.matte()),
          state_(row_state(drawing.session.look(), row_)) {}

    void draw() {
        ImGui::TableNextRow();
        ImGui::PushID(target_.c_str());
        if (session_.selected() == target_) {
            ImGui::TableSetBgColor(ImGuiTableBgTarget_RowBg0,
                                   packed(with_alpha(color::accent, 0.10f)));
        }
        draw_switches();
        draw_name();
        draw_gain();
        draw_color();
        draw_reset();
        if (session_.selected() == target_ && drawing_.scrolled_to != target_) {
            // Keys or a search have moved on
            const Marks::Box* last = drawing_.marks.find(mark("reset"));
            if (last && last->is_cut) ImGui::SetScrollHereY(0.5f);
            drawing_.scrolled_to = target_;
        }
        ImGui::PopID();
    }

  private:
    std::string mark(const char* what) const { return fmt::format("{} {}", what, target_); }

    void edit(const char* what, const std::function<void(Look&)>& change) {
        session_.select(target_);
        session_.edit(mark(what), change);
    }

    /// Of the last item.
    bool is_right_clicked() const {
        return ImGui::IsItemHovered() && ImGui::IsMouseClicked(ImGuiMouseButton_Right);
    }

    void solo_only() {
        edit("", [&](Look& l) { toggle_only_solo(l, row_); });
        session_.seal();
    }

    void draw_switches() {
        ImGui::TableNextColumn();
        if (switch_button("mute", "M", state_.is_muted, color::mute)) {
            if (ImGui::GetIO().KeyAlt) {
                solo_only();
            } else {
                edit("mute", [&](Look& l) { set_muted(l, row_, !state_.is_muted); });
            }
        }
        note_item(drawing_, mark("mute"));
        explain("Mute. Alt-click: solo this row alone");
        ImGui::TableNextColumn();
        if (switch_button("solo", "S", state_.is_soloed, color::solo)) {
            if (ImGui::GetIO().KeyAlt) {
                solo_only();
            } else {
                edit("solo", [&](Look& l) { set_soloed(l, row_, !state_.is_soloed); });
            }
        }
        note_item(drawing_, mark("solo"));
        explain("Solo. Alt-click: solo this row alone");
    }

    void draw_name() {
        ImGui::TableNextColumn();
        const bool is_silent = state_.is_muted || (session_.is_soloing() && !state_.is_soloed);
        ImGui::PushStyleColor(ImGuiCol_Text, is_silent ? color::dim : color::text);
        ImGui::PushStyleColor(ImGuiCol_HeaderHovered, ImVec4(0, 0, 0, 0));
        ImGui::AlignTextToFramePadding();
        const ImVec2 size = {ImGui::GetContentRegionAvail().x, ImGui::GetFrameHeight() - 2};
        const std::string title = row_title(target_), shown = fitted(title, size.x);
        // What is shown may be the same for two names
        if (ImGui::Selectable((shown + "##name").c_str(), false, ImGuiSelectableFlags_None, size)) {
            session_.select(target_);
            if (ImGui::GetIO().KeyAlt) solo_only();
        }
        ImGui::PopStyleColor(2);
        note_item(drawing_, mark("name"));
        if (ImGui::IsItemHovered()) {
            const std::string note = row_note(session_.stack(), target_);
            explain((shown == title ? note : title + "\n" + note).c_str());
        }
        draw_noise_share();
        draw_pixel_share();
    }

    /// What the row has of the light at the pixel that rows are sorted by.
    void draw_pixel_share() {
        const PixelShares* shares = session_.pixel_shares();
        if (!shares) return;
        const std::string share = fmt::format("{:.0f} %", 100 * shares->of(target_));
        const ImVec2 high = ImGui::GetItemRectMax(), low = ImGui::GetItemRectMin();
        const float width = ImGui::CalcTextSize(share.c_str()).x;
        ImDrawList& list = *ImGui::GetWindowDrawList();
        list.AddRectFilled({high.x - width - 4, low.y}, {high.x, high.y - 6}, packed(color::panel));
        list.AddText({high.x - width, low.y + ImGui::GetStyle().FramePadding.y - 1},
                     packed(color::accent), share.c_str());
        drawing_.marks.note(mark("share"), {high.x - width, low.y, high.x, high.y});
    }

    /// A hair line below the name: how much of the noise is this row's.
    void draw_noise_share() {
        const noise::RowNoise* noise = noise_of(noise_, target_);
        if (!noise || noise->share <= 0) return;
        const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
        const float y = high.y - 4;
        const float x = low.x + (high.x - low.x) * float(std::min(noise->share, 1.0));
        ImGui::GetWindowDrawList()->AddLine({low.x, y}, {x, y}, packed(color::dim), 2);
    }

    void draw_gain() {
        ImGui::TableNextColumn();
        const float width = ImGui::GetContentRegionAvail().x;
        if (const auto stops =
                drag_slider("gain", state_.stops, -slider_stops, slider_stops, width))
            edit("gain", [&](Look& l) { set_stops(l, row_, *stops); });
        note_item(drawing_, mark("gain"));
        if (is_right_clicked()) edit("", [&](Look& l) { set_stops(l, row_, 0); });
        explain("Gain in stops: drag (Shift: finer); double click or right click: as rendered");
        ImGui::TableNextColumn();
        if (const auto stops = stops_box("##stops", state_.stops, ImGui::GetContentRegionAvail().x))
            edit("stops", [&](Look& l) { set_stops(l, row_, *stops); });
        note_item(drawing_, mark("stops"));
        if (is_right_clicked()) edit("", [&](Look& l) { set_stops(l, row_, 0); });
    }

    void draw_color() {
        ImGui::TableNextColumn();
        std::array<float, 3> tint = state_.tint;
        const float side = ImGui::GetFrameHeight();
        if (ImGui::ColorButton("##tint", screen_color(session_, tint),
                               ImGuiColorEditFlags_NoTooltip | ImGuiColorEditFlags_NoAlpha,
                               {side, side}))
            ImGui::OpenPopup("tint");
        note_item(drawing_, mark("tint"));
        if (is_right_clicked()) edit("", [&](Look& l) { set_tint(l, row_, {1, 1, 1}); });
        explain("Tint, a factor per channel, as the display shows it. Right click: none");
        if (ImGui::BeginPopup("tint")) {
            ImGui::ColorButton("##shown", screen_color(session_, tint),
                               ImGuiColorEditFlags_NoTooltip | ImGuiColorEditFlags_NoAlpha,
                               {ImGui::GetContentRegionAvail().x, 2 * side});
            if (ImGui::ColorPicker3("##picker", tint.data(),
                                    ImGuiColorEditFlags_Float | ImGuiColorEditFlags_DisplayRGB |
                                        ImGuiColorEditFlags_NoSidePreview |
                                        ImGuiColorEditFlags_NoSmallPreview |
                                        ImGuiColorEditFlags_NoOptions))
                edit("tint", [&](Look& l) { set_tint(l, row_, tint); });
            if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape)))
                ImGui::CloseCurrentPopup();
            ImGui::EndPopup();
        }
        ImGui::TableNextColumn();
        float kelvin = state_.kelvin.value_or(6500.0f);
        ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x);
        ImGui::PushStyleColor(ImGuiCol_Text, state_.kelvin ? color::text : color::dim);
        if (ImGui::DragFloat("##kelvin", &kelvin, 20, 1667, 25000, state_.kelvin ? "%.0f K" : "– K",
                             ImGuiSliderFlags_AlwaysClamp))
            edit("kelvin", [&](Look& l) { set_kelvin(l, row_, kelvin); });
        ImGui::PopStyleColor();
        note_item(drawing_, mark("kelvin"));
        if (is_right_clicked()) edit("", [&](Look& l) { set_kelvin(l, row_, std::nullopt); });
        explain(
            "Color temperature: tint of a black body relative to 6504 K. Drag, or Ctrl-click to "
            "type. Right click: none");
    }

    void draw_reset() {
        ImGui::TableNextColumn();
        if (quiet_button("reset", "↺", state_ != RowState()))
            edit("", [&](Look& l) { reset_row(l, row_); });
        note_item(drawing_, mark("reset"));
        explain("Reset this row");
    }

    Drawing& drawing_;
    Session& session_;
    const std::string& target_;
    const std::span<const noise::RowNoise> noise_;
    RowTarget row_;
    RowState state_;
};

void draw_rows(Drawing& drawing, const std::vector<std::string>& targets, size_t masters) {
    const float unit = ImGui::GetFontSize();
    if (!ImGui::BeginTable(
            "rows", 8,
            ImGuiTableFlags_ScrollY | ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_NoPadOuterX))
        return;
    const auto column = [&](const char* name, float width) {
        ImGui::TableSetupColumn(name, ImGuiTableColumnFlags_WidthFixed, width);
    };
    const float side = ImGui::GetFrameHeight();
    ImGui::TableSetupScrollFreeze(0, 1);
    column("", side);
    column("", side);
    ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthStretch, 1);
    ImGui::TableSetupColumn("gain, stops", ImGuiTableColumnFlags_WidthStretch, 1);
    column("", stops_width());
    column("tint", side);
    column("kelvin", 4.4f * unit);
    column("", ImGui::CalcTextSize("↺").x + 2 * ImGui::GetStyle().FramePadding.x);
    ImGui::PushFont(drawing.fonts.small);
    ImGui::PushStyleColor(ImGuiCol_Text, color::dim);
    ImGui::TableHeadersRow();
    ImGui::PopStyleColor();
    ImGui::PopFont();
    std::vector<noise::RowNoise> noise;
    if (drawing.noise)
        noise = drawing.session.page() == Page::Bounces ? drawing.noise->bounces()
                : drawing.session.page() == Page::Lobes ? drawing.noise->lobes()
                                                        : drawing.noise->groups();
    const auto is_master = [&](const std::string& target) {
        return std::find(targets.begin(), targets.begin() + std::ptrdiff_t(masters), target) !=
               targets.begin() + std::ptrdiff_t(masters);
    };
    bool was_master = false;
    for (const std::string& target : drawing.session.found(targets)) {
        if (was_master && !is_master(target)) {
            ImGui::TableNextRow(ImGuiTableRowFlags_None, unit / 2);
            ImGui::TableNextColumn();
        }
        was_master = is_master(target);
        Row(drawing, target, noise).draw();
    }
    ImGui::EndTable();
}

/// Where the rows act, and what can be picked.
void draw_matte(Drawing& drawing) {
    Session& session = drawing.session;
    if (!session.is_picking() && session.matte().empty()) return;
    const float unit = ImGui::GetFontSize();
    const std::vector<std::string>& layers = session.picker().layers();
    ImGui::AlignTextToFramePadding();
    text("within", color::dim);
    ImGui::SameLine();
    const float width = 9 * unit;
    ImGui::SetNextItemWidth(width);
    if (ImGui::BeginCombo("##mattes", fitted(session.pick_layer(), width - 2.2f * unit).c_str())) {
        for (const std::string& layer : layers) {
            if (ImGui::Selectable(layer.c_str(), layer == session.pick_layer()))
                session.set_pick_layer(layer);
            note_item(drawing, "pick from " + layer);
        }
        ImGui::EndCombo();
    }
    note_item(drawing, "mattes");
    explain("Cryptomatte that objects are picked from");
    ImGui::SameLine();
    std::string list;
    for (const std::string& name : session.picked()) list += (list.empty() ? "" : ", ") + name;
    const float room = ImGui::GetContentRegionAvail().x - 2 * ImGui::GetFrameHeight();
    fitted_text(list.empty() ? "click objects in the image" : list, room,
                list.empty() ? color::dim : color::accent);
    note_item(drawing, "matte");
    ImGui::SameLine();
    if (quiet_button("no matte", "×", !session.matte().empty())) session.clear_matte();
    note_item(drawing, "clear matte");
    explain("Rows act everywhere again; what they do within the matte stays in the look");
}

/// The search over rows.
void draw_search(Drawing& drawing, const std::vector<std::string>& targets) {
    Session& session = drawing.session;
    std::array<char, 256> typed{};
    const std::string words = session.row_search();
    std::copy_n(words.begin(), std::min(words.size(), typed.size() - 1), typed.begin());
    const auto search = [&](const std::string& other) {
        session.search_rows(other);
        // The rows move: the selected one is shown again
        drawing.scrolled_to.clear();
    };
    const std::string count =
        words.empty() ? fmt::format("{} rows", targets.size())
                      : fmt::format("{} of {}", session.found(targets).size(), targets.size());
    const float unit = ImGui::GetFontSize();
    if (session.take_search_request()) ImGui::SetKeyboardFocusHere();
    ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x - 13 * unit);
    if (ImGui::InputTextWithHint("##search", "Search rows (Ctrl+F)", typed.data(), typed.size()))
        search(typed.data());
    note_item(drawing, "search");
    ImGui::SameLine();
    if (quiet_button("clear", "×", !words.empty())) search("");
    note_item(drawing, "clear search");
    ImGui::SameLine();
    if (switch_button("at pixel", "L", session.is_sorting(), color::accent))
        session.perform(Action::SortByPixel);
    note_item(drawing, "sort by pixel");
    explain("Sort rows by their light at the pixel that the mouse was over last (L)");
    ImGui::SameLine();
    text(count, color::dim);
    note_item(drawing, "row count");
}

float further_height_of(const Session& session) {
    const bool is_empty =
        advanced_controls(session.look(), session.rows(), session.matte()).empty() &&
        session.notes().empty();
    return is_empty ? 0 : 7 * ImGui::GetFrameHeight();
}

bool begin_page(Drawing& drawing, const char* title, Page page) {
    Session& session = drawing.session;
    const bool is_open = ImGui::BeginTabItem(title);
    note_item(drawing, std::string("page ") + title);
    if (is_open && session.page() != page) session.set_page(page);
    return is_open;
}

}  // namespace

void draw_mixer(Drawing& drawing) {
    Session& session = drawing.session;
    const MixerRows& rows = session.rows();
    const float further_height = further_height_of(session);
    const auto body = [&](const char* id, const std::function<void()>& draw) {
        draw_matte(drawing);
        draw_search(drawing, session.targets_of_page());
        if (ImGui::BeginChild(id, {0, -further_height})) draw();
        ImGui::EndChild();
        ImGui::EndTabItem();
    };
    if (ImGui::BeginTabBar("pages")) {
        if (begin_page(drawing, "Lights", Page::Lights))
            body("lights", [&] {
                const size_t masters = size_t(
                    std::count_if(rows.lights.begin(), rows.lights.end(),
                                  [](const std::string& n) { return n == "all" || n == "env"; }));
                draw_rows(drawing, rows.lights, masters);
            });
        if (!rows.bounces.empty() && begin_page(drawing, "Bounces", Page::Bounces))
            body("bounces", [&] {
                draw_rows(drawing, rows.bounces,
                          rows.bounces.size() - session.stack().column_names().size());
            });
        if (!rows.lobes.empty() && begin_page(drawing, "Lobes", Page::Lobes))
            body("lobes", [&] { draw_rows(drawing, rows.lobes, 0); });
        if (!rows.groups.empty() && begin_page(drawing, "Light × bounce", Page::Cells))
            body("cells", [&] { draw_cells(drawing); });
        if (begin_page(drawing, "Shadows", Page::Shadows))
            body("shadows", [&] { draw_shadows(drawing); });
        if (drawing.live.draw_page) {
            const std::string& title = drawing.live.page_title;
            const bool is_open = ImGui::BeginTabItem(title.c_str());
            note_item(drawing, "page " + title);
            if (is_open) {
                if (ImGui::BeginChild("live", {0, -further_height}))
                    drawing.live.draw_page(drawing.marks);
                ImGui::EndChild();
                ImGui::EndTabItem();
            }
        }
        ImGui::EndTabBar();
    }
    if (further_height > 0) draw_advanced(drawing);
}

}  // namespace velatura::compositor::window
