// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/image_panel.h"

#include "compositor/window/names_shown.h"
#include "compositor/window/widgets.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

namespace velatura::compositor::window {

namespace {

constexpr float exposure_stops = 6;
constexpr double wheel_step = 1.2;

bool tool_button(Drawing& drawing, const char* label, bool is_on, const char* what) {
    const bool is_pressed = switch_button(label, label, is_on, color::accent);
    note_item(drawing, std::string("tool ") + label);
    explain(what);
    ImGui::SameLine();
    return is_pressed;
}

void draw_zoom_tools(Drawing& drawing) {
    Session& session = drawing.session;
    ImageView& view = session.view();
    if (tool_button(drawing, "Fit", view.is_fit(), "The whole image (F)"))
        session.perform(Action::ZoomFit);
    if (tool_button(drawing, "1:1", view.scale() == 1, "One image pixel per screen pixel (1)"))
        session.perform(Action::ZoomOne);
    ImGui::AlignTextToFramePadding();
    const float start = ImGui::GetCursorPosX();
    text(fmt::format("{:.0f} %", 100 * view.scale()), color::dim);
    // As wide for any zoom
    ImGui::SameLine(start + 3.4f * ImGui::GetFontSize());
    ImGui::Dummy({0, 0});
}

void draw_exposure(Drawing& drawing) {
    Session& session = drawing.session;
    const float unit = ImGui::GetFontSize();
    const float now = session.look().exposure_stops;
    const auto set = [&](float stops) {
        const float rounded = std::round(stops * 100) / 100;
        session.edit("exposure", [&](Look& l) { l.exposure_stops = rounded; });
    };
    ImGui::AlignTextToFramePadding();
    text("Exposure", color::dim);
    ImGui::SameLine();
    if (const auto stops = drag_slider("exposure", now, -exposure_stops, exposure_stops, 7 * unit))
        set(*stops);
    note_item(drawing, "exposure");
    explain("Stops on everything ([ and ]); double click: as rendered");
    ImGui::SameLine();
    if (const auto stops = stops_box("##exposure", now, stops_width())) set(*stops);
    note_item(drawing, "exposure stops");
}

void draw_displays(Drawing& drawing) {
    Session& session = drawing.session;
    const float unit = ImGui::GetFontSize();
    if (drawing.displays.empty()) return;
    const std::string display =
        session.look().display.empty() ? drawing.displays[0].display : session.look().display;
    const auto of_display = std::find_if(drawing.displays.begin(), drawing.displays.end(),
                                         [&](const auto& d) { return d.display == display; });
    ImGui::SetNextItemWidth(5.5f * unit);
    if (ImGui::BeginCombo("##display", display.c_str())) {
        for (const image::DisplayViews& d : drawing.displays) {
            if (ImGui::Selectable(d.display.c_str(), d.display == display))
                session.set_display(d.display, d.views.empty() ? "" : d.views[0]);
        }
        ImGui::EndCombo();
    }
    explain("Display of the OpenColorIO config ($OCIO, or the built-in one)");
    ImGui::SameLine();
    if (of_display == drawing.displays.end() || of_display->views.empty()) return;
    const std::string view =
        session.look().view.empty() ? of_display->views[0] : session.look().view;
    ImGui::SetNextItemWidth(5.5f * unit);
    if (ImGui::BeginCombo("##view", view.c_str())) {
        for (const std::string& v : of_display->views) {
            if (ImGui::Selectable(v.c_str(), v == view)) session.set_display(display, v);
            note_item(drawing, "view " + v);
        }
        ImGui::EndCombo();
    }
    note_item(drawing, "views");
    explain("View");
}

void draw_look_tools(Drawing& drawing) {
    Session& session = drawing.session;
    for (size_t i = 0; i < 2; ++i) {
        if (tool_button(drawing, i == 0 ? "A" : "B", session.active() == i,
                        "The look that the mixer edits (X switches)") &&
            session.active() != i)
            session.perform(Action::SwitchLook);
    }
    if (tool_button(drawing, "Wipe", session.is_wiping(), "A left, B right of a line (W)"))
        session.perform(Action::ToggleWipe);
    const char* copy = session.active() == 0 ? "A → B" : "B → A";
    if (tool_button(drawing, copy, false, "Copy this look over the other one (C)"))
        session.perform(Action::CopyLook);
    if (tool_button(drawing, "Snapshot", false,
                    "Keep the image and its look in the strip (T); Shift+T compares with it"))
        session.perform(Action::TakeSnapshot);
}

/// What the numbers of the file mean.
void draw_input_space(Drawing& drawing) {
    Session& session = drawing.session;
    const float unit = ImGui::GetFontSize(), width = 10.5f * unit;
    const std::string& now = session.input_space();
    const std::string shown =
        now.empty() ? "in: " + session.own_space().substr(0, session.own_space().find(" (")) : now;
    ImGui::SetNextItemWidth(width);
    ImGui::PushStyleColor(ImGuiCol_Text, now.empty() ? color::dim : color::accent);
    const bool is_open = ImGui::BeginCombo("##space", fitted(shown, width - 2.2f * unit).c_str(),
                                           ImGuiComboFlags_HeightLarge);
    ImGui::PopStyleColor();
    if (is_open) {
        if (ImGui::Selectable(("as in the file: " + session.own_space()).c_str(), now.empty()))
            session.set_input_space("");
        note_item(drawing, "space of the file");
        for (const std::string& space : drawing.spaces) {
            if (ImGui::Selectable(space.c_str(), now == space)) session.set_input_space(space);
            note_item(drawing, "space " + space);
        }
        ImGui::EndCombo();
    }
    note_item(drawing, "spaces");
    explain("Color space of the numbers in the file (--input-space)");
}

/// The mix or one layer, found by typing.
void draw_layers(Drawing& drawing) {
    static std::array<char, 128> search{};
    Session& session = drawing.session;
    const float unit = ImGui::GetFontSize();
    const ViewMode& mode = session.mode();
    const float width = 7 * unit;
    const std::string now = mode.layer ? mode.layer->name : "mix";
    const auto show = [&](std::optional<ShownLayer> layer) {
        ViewMode other = mode;
        other.layer = std::move(layer);
        session.set_mode(std::move(other));
    };
    ImGui::SetNextItemWidth(width);
    if (ImGui::BeginCombo("##layer", fitted(now, width - 2.2f * unit).c_str(),
                          ImGuiComboFlags_HeightLarge)) {
        if (ImGui::IsWindowAppearing()) {
            search[0] = '\0';
            ImGui::SetKeyboardFocusHere();
        }
        ImGui::InputTextWithHint("##search", "Search layers", search.data(), search.size());
        note_item(drawing, "search layers");
        if (ImGui::Selectable("mix", !mode.layer)) show(std::nullopt);
        note_item(drawing, "layer mix");
        for (const ShownLayer& layer : session.shown()) {
            if (!is_found(layer.name, search.data())) continue;
            if (ImGui::Selectable(layer.name.c_str(), mode.layer == layer)) show(layer);
            note_item(drawing, "layer " + layer.name);
        }
        ImGui::EndCombo();
    }
    note_item(drawing, "layers");
    explain("The mix, or one layer of the file alone (. and ,)");
}

void draw_channels(Drawing& drawing) {
    Session& session = drawing.session;
    const ViewMode& mode = session.mode();
    for (const ChannelChoice& choice : channel_choices()) {
        if (switch_button(choice.name, choice.label, mode.channel == choice.channel, color::accent))
            session.perform(choice.action);
        note_item(drawing, std::string("channel ") + choice.name);
        explain(choice.name);
        ImGui::SameLine(0, 2);
    }
    ImGui::SameLine();
    if (switch_button("faults", "!", mode.flags_pixels, color::error))
        session.perform(Action::FlagPixels);
    note_item(drawing, "mark faults");
    explain(
        "Mark pixels (O): NaN or Inf magenta, clipped orange, negative blue; counts are in the "
        "status line");
    ImGui::SameLine();
    if (switch_button("denoised", "Denoised", session.is_denoising(), color::accent))
        session.perform(Action::Denoise);
    note_item(drawing, "tool Denoised");
    explain("All layers by the filter of velatura-comp denoise (D)");
    if (session.picker().layers().empty()) return;
    ImGui::SameLine();
    if (switch_button("pick", "Pick", session.is_picking(), color::accent))
        session.perform(Action::PickMatte);
    note_item(drawing, "tool Pick");
    explain("Click objects of the Cryptomatte: rows act within them (P)");
}

/// What stands above the image, from left to right; a line below where there is no room.
struct Tool {
    void (*draw)(Drawing&);
};

constexpr std::array tools = {Tool{draw_zoom_tools}, Tool{draw_exposure}, Tool{draw_input_space},
                              Tool{draw_displays},   Tool{draw_layers},   Tool{draw_channels},
                              Tool{draw_look_tools}};

/// Rectangle of the image on the screen.
struct Place {
    ImVec2 origin, end;
    double scale = 1;
};

void draw_look(Drawing& drawing, size_t look, const Place& place, float x0, float x1) {
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const Session& session = drawing.session;
    list.PushClipRect({x0, place.origin.y}, {x1, place.end.y}, true);
    drawing.textures.draw(list, look, session.level(), place.origin, place.scale);
    list.PopClipRect();
}

void draw_wipe_line(const Session& session, const Place& place, float x) {
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImU32 ink = packed(color::text), shade = packed({0, 0, 0, 0.6f});
    list.AddLine({x, place.origin.y}, {x, place.end.y}, shade, 3);
    list.AddLine({x, place.origin.y}, {x, place.end.y}, ink, 1);
    const auto label = [&](const std::string& words, bool is_left) {
        const ImVec2 size = ImGui::CalcTextSize(words.c_str());
        const float left = is_left ? x - size.x - 12 : x + 12, top = place.origin.y + 8;
        list.AddRectFilled({left - 5, top - 3}, {left + size.x + 5, top + size.y + 3}, shade, 3);
        list.AddText({left, top}, ink, words.c_str());
    };
    const auto name = [&](size_t look) {
        const Look& l = session.look(look);
        const bool is_rendered = l.controls.empty() && l.exposure_stops == 0;
        const std::string file =
            look == 1 && !session.compared().empty()
                ? " · " + std::filesystem::path(session.compared()).filename().string()
                : "";
        return std::string(look == 0 ? "A" : "B") + file + (is_rendered ? " · as rendered" : "");
    };
    label(name(0), true);
    label(name(1), false);
}

/// What the last item, the image, has of the mouse.
ImageMouse mouse_over(const ImageView::Point& pixel, bool is_over) {
    const ImGuiIO& io = ImGui::GetIO();
    ImageMouse mouse;
    mouse.is_over = is_over;
    mouse.is_pressed = ImGui::IsItemActivated();
    mouse.is_held = ImGui::IsItemActive();
    mouse.is_released = ImGui::IsItemDeactivated();
    mouse.button = io.MouseDown[2] || io.MouseReleased[2] ? 2 : 0;
    mouse.pixel = pixel;
    mouse.moved = {io.MouseDelta.x, io.MouseDelta.y};
    mouse.wheel = is_over ? io.MouseWheel : 0;
    mouse.is_alt = io.KeyAlt;
    mouse.is_ctrl = io.KeyCtrl;
    mouse.is_shift = io.KeyShift;
    return mouse;
}

void handle_mouse(Drawing& drawing, const ImVec2& area, const Place& place, float wipe_x) {
    Session& session = drawing.session;
    ImageView& view = session.view();
    const ImGuiIO& io = ImGui::GetIO();
    static bool is_dragging_wipe = false;
    const bool is_over = ImGui::IsItemHovered(), is_held = ImGui::IsItemActive();
    const ImageView::Point at = {double(io.MousePos.x - area.x), double(io.MousePos.y - area.y)};
    const bool is_near_wipe = session.is_wiping() && std::abs(io.MousePos.x - wipe_x) < 8;
    if (ImGui::IsItemActivated()) is_dragging_wipe = is_near_wipe;
    const bool is_taken = drawing.live.take_mouse && !is_dragging_wipe &&
                          drawing.live.take_mouse(mouse_over(view.image_at(at), is_over));
    if (is_over && (is_near_wipe || (is_held && is_dragging_wipe)))
        ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
    if (is_held && is_dragging_wipe) {
        session.set_wipe(double(io.MousePos.x - place.origin.x) /
                         double(place.end.x - place.origin.x));
    } else if (is_taken) {
        // The mouse moves the camera
    } else if (is_held && (io.MouseDelta.x != 0 || io.MouseDelta.y != 0)) {
        view.pan(double(io.MouseDelta.x), double(io.MouseDelta.y));
    } else if (is_over && !session.is_picking() && ImGui::IsMouseDoubleClicked(0)) {
        if (view.is_fit()) {
            view.zoom_at(at, 1 / view.scale());
        } else {
            view.fit();
        }
    }
    if (!is_over) return;
    if (io.MouseWheel != 0 && !is_taken)
        view.zoom_at(at, std::pow(wheel_step, double(io.MouseWheel)));
    const ImageView::Point pixel = view.image_at(at);
    const image::Window& frame = session.image_frame();
    if (!frame.contains(int(std::floor(pixel[0])), int(std::floor(pixel[1])))) return;
    const int x = int(pixel[0]) / session.reduction(), y = int(pixel[1]) / session.reduction();
    drawing.cursor = {{x, y}};
    session.hover({int(pixel[0]), int(pixel[1])});
    constexpr float still = 9;  // square of the pixels that a hand trembles
    if (session.is_picking() && ImGui::IsItemDeactivated() && !is_dragging_wipe &&
        io.MouseDragMaxDistanceSqr[0] < still)
        session.pick(x, y);
}

/// What would be picked, beside the mouse.
void draw_object(Drawing& drawing, bool is_over) {
    const Session& session = drawing.session;
    if (!session.is_picking() || !is_over || !drawing.cursor) return;
    const auto objects = session.objects_at((*drawing.cursor)[0], (*drawing.cursor)[1]);
    if (objects.empty()) return;
    const std::string words = objects.front().text();
    const ImVec2 extent = ImGui::CalcTextSize(words.c_str()), screen = ImGui::GetIO().DisplaySize;
    const ImVec2 mouse = ImGui::GetIO().MousePos;
    const ImVec2 corner = {std::clamp(mouse.x + 14, 0.0f, std::max(screen.x - extent.x - 12, 0.0f)),
                           mouse.y + 14};
    const ImVec2 end = {corner.x + extent.x + 12, corner.y + extent.y + 8};
    ImDrawList& list = *ImGui::GetForegroundDrawList();
    list.AddRectFilled(corner, end, packed({0, 0, 0, 0.8f}), 3);
    list.AddText({corner.x + 6, corner.y + 4}, packed(color::text), words.c_str());
    drawing.marks.note("object " + objects.front().name, {corner.x, corner.y, end.x, end.y});
}

/// An image that is not that of the look says so itself, on the screen and in what is cut out of
/// it.
void draw_stale(Drawing& drawing, const ImVec2& low) {
    if (drawing.session.look_error().empty()) return;
    const char* words = "not this look: see the status line";
    const ImVec2 extent = ImGui::CalcTextSize(words), corner = {low.x + 8, low.y + 8};
    const ImVec2 end = {corner.x + extent.x + 12, corner.y + extent.y + 8};
    ImDrawList& list = *ImGui::GetWindowDrawList();
    list.AddRectFilled(corner, end, packed({0, 0, 0, 0.75f}), 3);
    list.AddText({corner.x + 6, corner.y + 4}, packed(color::error), words);
    drawing.marks.note("stale", {corner.x, corner.y, end.x, end.y});
}

/// An image that is not the mix in color says so.
void draw_mode(Drawing& drawing, const ImVec2& low, const ImVec2& high) {
    const std::string mode = drawing.session.mode().text();
    if (mode.empty()) return;
    const std::string words = fitted(mode, std::max(high.x - low.x - 28, 1.0f));
    const ImVec2 extent = ImGui::CalcTextSize(words.c_str());
    const ImVec2 corner = {low.x + 8, high.y - extent.y - 16};
    const ImVec2 end = {corner.x + extent.x + 12, corner.y + extent.y + 8};
    ImDrawList& list = *ImGui::GetWindowDrawList();
    list.AddRectFilled(corner, end, packed({0, 0, 0, 0.75f}), 3);
    list.AddText({corner.x + 6, corner.y + 4}, packed(color::accent), words.c_str());
    drawing.marks.note("mode", {corner.x, corner.y, end.x, end.y});
}

/// What false colors stand for, at the lower right.
void draw_scale(Drawing& drawing, const ImVec2& low, const ImVec2& high) {
    const Session& session = drawing.session;
    const ImageTask* image = session.image(session.active());
    if (!image || image->mode.false_color == FalseColor::None) return;
    const float unit = ImGui::GetFontSize();
    const float width = std::min(18 * unit, high.x - low.x - 4 * unit);
    if (width < 6 * unit) return;
    const ImVec2 corner = {high.x - width - 2 * unit, high.y - 2.6f * unit};
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImVec2 end = {high.x - 0.4f * unit, high.y - 0.4f * unit};
    list.AddRectFilled({corner.x - 1.6f * unit, corner.y - 0.4f * unit}, end,
                       packed({0, 0, 0, 0.75f}), 3);
    constexpr int steps = 48;
    for (int i = 0; i < steps; ++i) {
        const auto c = scale_color((float(i) + 0.5f) / steps);
        list.AddRectFilled({corner.x + width * float(i) / steps, corner.y},
                           {corner.x + width * float(i + 1) / steps, corner.y + 0.8f * unit},
                           IM_COL32(c[0], c[1], c[2], 255));
    }
    for (const ScaleMark& mark : scale_of(image->mode)) {
        const float half = ImGui::CalcTextSize(mark.text.c_str()).x / 2;
        list.AddText({corner.x + width * mark.t - half, corner.y + 0.9f * unit},
                     packed(color::text), mark.text.c_str());
    }
    drawing.marks.note("color scale", {corner.x, corner.y, end.x, end.y});
}

void draw_nothing_yet(const Drawing& drawing, const ImVec2& low, const ImVec2& size) {
    const std::string words = !drawing.live_state.empty() ? drawing.live_state
                              : drawing.is_working
                                  ? "Loading …"
                                  : "Drop a file of light layers here, or open one with Ctrl+O";
    const ImVec2 extent = ImGui::CalcTextSize(words.c_str());
    ImGui::SetCursorScreenPos({low.x + (size.x - extent.x) / 2, low.y + (size.y - extent.y) / 2});
    text(words, color::dim);
}

}  // namespace

void draw_toolbar(Drawing& drawing) {
    const size_t more = drawing.live.draw_tools ? 1 : 0;
    drawing.tool_widths.resize(tools.size() + more);
    for (size_t i = 0; i < drawing.tool_widths.size(); ++i) {
        float& width = drawing.tool_widths[i];
        if (i > 0) next_in_line(width, ImGui::GetFontSize());
        ImGui::BeginGroup();
        if (i < more)
            drawing.live.draw_tools(drawing.marks);
        else
            tools[i - more].draw(drawing);
        ImGui::EndGroup();
        width = ImGui::GetItemRectSize().x;
    }
    const ImGuiStyle& style = ImGui::GetStyle();
    drawing.toolbar_height = ImGui::GetCursorPosY() - style.ItemSpacing.y + style.WindowPadding.y;
}

void draw_image(Drawing& drawing) {
    Session& session = drawing.session;
    ImageView& view = session.view();
    const ImVec2 low = ImGui::GetCursorScreenPos(), size = ImGui::GetContentRegionAvail();
    if (size.x < 1 || size.y < 1) return;
    const ImVec2 high = {low.x + size.x, low.y + size.y};
    ImDrawList& list = *ImGui::GetWindowDrawList();
    list.AddRectFilled(low, high, packed(color::workspace));
    if (!session.has_file()) return draw_nothing_yet(drawing, low, size);

    const bool was_fit = view.is_fit();
    view.set_area(int(size.x), int(size.y));
    ImGui::InvisibleButton("picture", size,
                           ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonMiddle);
    const auto place_now = [&] {
        const ImageView::Point o = view.origin();
        const image::Window& frame = session.image_frame();
        Place place;
        place.scale = view.scale();
        place.origin = {low.x + float(o[0]), low.y + float(o[1])};
        place.end = {place.origin.x + float(frame.width() * place.scale),
                     place.origin.y + float(frame.height() * place.scale)};
        return place;
    };
    const auto wipe_at = [&](const Place& p) {
        return std::round(p.origin.x + float(session.wipe()) * (p.end.x - p.origin.x));
    };
    Place place = place_now();
    handle_mouse(drawing, low, place, wipe_at(place));
    draw_object(drawing, ImGui::IsItemHovered());
    if (was_fit != view.is_fit() || !was_fit) place = place_now();

    ImGui::PushClipRect(low, high, true);
    const float wipe_x = wipe_at(place);
    if (session.is_wiping()) {
        draw_look(drawing, 0, place, place.origin.x, wipe_x);
        draw_look(drawing, 1, place, wipe_x, place.end.x);
        draw_wipe_line(session, place, wipe_x);
        drawing.marks.note("wipe", {wipe_x - 2, std::max(place.origin.y, low.y), wipe_x + 2,
                                    std::min(place.end.y, high.y)});
    } else {
        draw_look(drawing, session.active(), place, place.origin.x, place.end.x);
    }
    draw_stale(drawing, {std::max(place.origin.x, low.x), std::max(place.origin.y, low.y)});
    draw_mode(drawing, {std::max(place.origin.x, low.x), std::max(place.origin.y, low.y)},
              {std::min(place.end.x, high.x), std::min(place.end.y, high.y)});
    draw_scale(drawing, {std::max(place.origin.x, low.x), std::max(place.origin.y, low.y)},
               {std::min(place.end.x, high.x), std::min(place.end.y, high.y)});
    if (drawing.live.draw_over)
        drawing.live.draw_over({low, high, place.origin, place.scale}, drawing.marks);
    ImGui::PopClipRect();
    drawing.marks.note("picture", {std::max(place.origin.x, low.x), std::max(place.origin.y, low.y),
                                   std::min(place.end.x, high.x), std::min(place.end.y, high.y)});
}

}  // namespace velatura::compositor::window
