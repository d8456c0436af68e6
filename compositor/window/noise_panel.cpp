// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/noise_panel.h"

#include "compositor/window/widgets.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::compositor::window {

namespace {

/// What holding the noise of the render would take.
std::string price(double mix, double rendered) {
    if (rendered <= 0 || mix <= 0) return {};
    const double times = (mix / rendered) * (mix / rendered);
    if (times < 1.05) return "no more than as rendered";
    return fmt::format("{:.{}f}× the samples would hold {}", times, times < 10 ? 1 : 0,
                       percent_text(rendered));
}

void draw_rows(const char* title, const std::vector<noise::RowNoise>& rows, size_t max) {
    if (rows.empty()) return;
    const float unit = ImGui::GetFontSize();
    text(title, color::dim);
    for (size_t i = 0; i < std::min(rows.size(), max); ++i) {
        fitted_text(rows[i].name, 6 * unit, color::text);
        ImGui::SameLine(6.5f * unit);
        share_bar(rows[i].share, 5 * unit, color::dim);
        ImGui::SameLine();
        text(fmt::format("{:.0f} %", 100 * rows[i].share));
    }
}

}  // namespace

void draw_noise(Drawing& drawing) {
    text("Noise of this mix", color::dim);
    if (!drawing.noise) return text("…", color::dim);
    const LiveNoise& noise = *drawing.noise;
    if (!noise.error().empty()) {
        ImGui::PushTextWrapPos(0);
        text(noise.error(), color::dim);
        ImGui::PopTextWrapPos();
        return;
    }
    ImGui::PushFont(drawing.fonts.large);
    text(percent_text(noise.mix()), drawing.is_noise_old ? color::dim : color::text);
    ImGui::PopFont();
    note_item(drawing, "noise");
    explain(
        "Relative standard error of the mix, from the half images: docs/engineering/numerics.md");
    ImGui::PushFont(drawing.fonts.small);
    text(fmt::format(
             "{} as rendered{}", percent_text(noise.rendered()),
             noise.is_done() ? "" : fmt::format(" · {:.0f} % of the rows", 100 * noise.share())),
         color::dim);
    text(price(noise.mix(), noise.rendered()), color::dim);
    ImGui::Spacing();
    draw_rows("from", noise.groups(), 3);
    draw_rows("of bounces", noise.bounces(), 2);
    ImGui::PopFont();
}

}  // namespace velatura::compositor::window
