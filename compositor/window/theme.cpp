// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/theme.h"

#include <array>
#include <filesystem>
#include <string>

namespace velatura::compositor::window {

namespace {

ImFont* load_font(const char* file, float size) {
    // Latin, Greek letters that stand for quantities, dashes and dots, arrows, signs, shapes
    static constexpr std::array<ImWchar, 15> ranges = {0x20,   0xff,   0x391,  0x3c9,  0x2010,
                                                       0x2044, 0x2190, 0x21ff, 0x2200, 0x22ff,
                                                       0x25a0, 0x25ff, 0x2630, 0x2637, 0};
    const std::string path = std::string("/usr/share/fonts/truetype/dejavu/") + file;
    ImFontAtlas* fonts = ImGui::GetIO().Fonts;
    if (!std::filesystem::exists(path)) return fonts->AddFontDefault();
    return fonts->AddFontFromFileTTF(path.c_str(), size, nullptr, ranges.data());
}

void set_colors(ImGuiStyle& style) {
    const auto set = [&](ImGuiCol index, const ImVec4& c) { style.Colors[index] = c; };
    ImGui::StyleColorsDark(&style);
    set(ImGuiCol_Text, color::text);
    set(ImGuiCol_TextDisabled, color::dim);
    set(ImGuiCol_WindowBg, color::panel);
    set(ImGuiCol_ChildBg, {0, 0, 0, 0});
    set(ImGuiCol_PopupBg, {0.13f, 0.13f, 0.13f, 1});
    set(ImGuiCol_MenuBarBg, {0.13f, 0.13f, 0.13f, 1});
    set(ImGuiCol_Border, color::line);
    set(ImGuiCol_Separator, color::line);
    set(ImGuiCol_TitleBg, color::panel);
    set(ImGuiCol_TitleBgActive, {0.20f, 0.20f, 0.20f, 1});
    for (const ImGuiCol c : {ImGuiCol_FrameBg, ImGuiCol_Button}) set(c, color::field);
    for (const ImGuiCol c :
         {ImGuiCol_FrameBgHovered, ImGuiCol_ButtonHovered, ImGuiCol_HeaderHovered})
        set(c, color::field_hovered);
    for (const ImGuiCol c : {ImGuiCol_FrameBgActive, ImGuiCol_ButtonActive, ImGuiCol_HeaderActive})
        set(c, {0.33f, 0.33f, 0.33f, 1});
    set(ImGuiCol_Header, {0.25f, 0.25f, 0.25f, 1});
    set(ImGuiCol_Tab, color::panel);
    set(ImGuiCol_TabHovered, color::field_hovered);
    set(ImGuiCol_TabActive, {0.28f, 0.26f, 0.23f, 1});
    set(ImGuiCol_CheckMark, color::accent);
    set(ImGuiCol_SliderGrab, color::accent);
    set(ImGuiCol_SliderGrabActive, color::accent);
    set(ImGuiCol_PlotHistogram, color::accent);
    set(ImGuiCol_TextSelectedBg, with_alpha(color::accent, 0.35f));
    set(ImGuiCol_NavHighlight, color::accent);
    set(ImGuiCol_TableHeaderBg, {0.19f, 0.19f, 0.19f, 1});
    set(ImGuiCol_TableBorderLight, {0.22f, 0.22f, 0.22f, 1});
    set(ImGuiCol_ModalWindowDimBg, {0, 0, 0, 0.45f});
    set(ImGuiCol_ScrollbarBg, {0, 0, 0, 0});
}

}  // namespace

Fonts set_up_theme(float scale) {
    ImGuiStyle& style = ImGui::GetStyle();
    set_colors(style);
    style.WindowRounding = 0;
    style.FrameRounding = style.GrabRounding = style.PopupRounding = style.TabRounding = 3;
    style.WindowBorderSize = 0;
    style.PopupBorderSize = 1;
    style.WindowPadding = {10, 8};
    // The menu bar is lower than ImGui lets a window be, and would lie over the tools
    style.WindowMinSize = {1, 1};
    style.FramePadding = {6, 3};
    style.ItemSpacing = {6, 5};
    style.CellPadding = {3, 2};
    style.ScrollbarSize = 12;
    style.ScaleAllSizes(scale);
    ImGui::GetIO().Fonts->Clear();
    Fonts fonts;
    fonts.text = load_font("DejaVuSans.ttf", 14 * scale);
    fonts.small = load_font("DejaVuSans.ttf", 12 * scale);
    fonts.large = load_font("DejaVuSans.ttf", 26 * scale);
    fonts.numbers = load_font("DejaVuSansMono.ttf", 12 * scale);
    return fonts;
}

}  // namespace velatura::compositor::window
