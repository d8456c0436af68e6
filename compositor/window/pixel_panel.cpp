// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/pixel_panel.h"

#include "compositor/window/widgets.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace velatura::compositor::window {

namespace {

using Rgb = std::array<float, 3>;

/// Six characters whatever the size.
std::string number(float v) {
    const float size = v < 0 ? -v : v;
    if (size == 0) return "     0";
    if (size < 1e-3f || size >= 1e5f) return fmt::format("{:6.0e}", v);
    return fmt::format("{:6.{}f}", v, size < 10 ? 4 : size < 100 ? 3 : size < 1000 ? 2 : 1);
}

std::string numbers(const Rgb& rgb) {
    return fmt::format("{} {} {}", number(rgb[0]), number(rgb[1]), number(rgb[2]));
}

/// A pixel as the screen shows it.
std::string screen_bytes(const Session& session, int x, int y) {
    const auto rgba = session.screen_tile(session.active(), {x, y, x + 1, y + 1}).rgba;
    return fmt::format("{} {} {}", rgba[0], rgba[1], rgba[2]);
}

std::string gain_text(const Rgb& gain) {
    if (gain == Rgb{1, 1, 1}) return {};
    if (gain[0] == gain[1] && gain[1] == gain[2]) return fmt::format("×{:.3g}", gain[0]);
    // Of a tint the mean: three numbers have no place
    return fmt::format("≈×{:.2f}", (gain[0] + gain[1] + gain[2]) / 3);
}

void draw_line(const std::string& name,
               const std::string& values,
               const std::string& note,
               bool is_dim) {
    const float digit = ImGui::CalcTextSize("0").x;
    fitted_text(name, 11.5f * digit, is_dim ? color::dim : color::text);
    ImGui::SameLine(12 * digit);  // from the left edge of the column
    text(values, is_dim ? color::dim : color::text);
    if (note.empty()) return;
    ImGui::SameLine();
    text(note, color::accent);
}

void draw_head(Drawing& drawing, const PixelReadout* pixel) {
    ImGui::AlignTextToFramePadding();
    text("Pixel", color::dim);
    if (!pixel) return;
    ImGui::SameLine();
    text(fmt::format("{}, {}", pixel->x, pixel->y));
    note_item(drawing, "pixel");
    const std::array<std::array<std::string, 2>, 3> facts = {
        {{"mix", numbers(pixel->mix)},
         {"screen", screen_bytes(drawing.session, pixel->x, pixel->y)},
         {"alpha", fmt::format("{:.3g}", pixel->alpha)}}};
    ImGui::PushFont(drawing.fonts.numbers);
    for (const auto& [name, value] : facts) {
        const auto width = [](const std::string& s) { return ImGui::CalcTextSize(s.c_str()).x; };
        const float space = ImGui::GetStyle().ItemSpacing.x;
        next_in_line(width(name) + space + width(value), 2 * space);
        text(name, color::dim);
        ImGui::SameLine();
        text(value);
        note_item(drawing, "pixel " + name);
    }
    ImGui::PopFont();
}

}  // namespace

void draw_pixel(Drawing& drawing) {
    const Session& session = drawing.session;
    const ImageTask* image = session.has_file() ? session.image(session.active()) : nullptr;
    std::optional<PixelReadout> pixel;
    if (image && drawing.cursor) {
        pixel = read_pixel(session.stack(), *image->plans[0], image->look.exposure_stops,
                           (*drawing.cursor)[0], (*drawing.cursor)[1]);
    }
    draw_head(drawing, pixel ? &*pixel : nullptr);
    if (!pixel) return;

    ImGui::PushFont(drawing.fonts.numbers);
    const float digit = ImGui::CalcTextSize("0").x, column = 38 * digit;
    const int columns = std::max(1, int(ImGui::GetContentRegionAvail().x / column));
    const auto count = int(pixel->layers.size() + pixel->data.size());
    const int lines = (count + columns - 1) / columns;
    if (ImGui::BeginTable("layers", columns, ImGuiTableFlags_ScrollY)) {
        // Down the first column, then the next
        for (int i = 0; i < lines * columns; ++i) {
            ImGui::TableNextColumn();
            const auto index = size_t(i % columns * lines + i / columns);
            if (index < pixel->layers.size()) {
                const PixelReadout::Layer& layer = pixel->layers[index];
                const bool is_unused = layer.gain == Rgb{0, 0, 0};
                draw_line(layer.name, numbers(layer.stored),
                          is_unused ? std::string() : gain_text(layer.gain), is_unused);
            } else if (index < size_t(count)) {
                const PixelReadout::Data& data = pixel->data[index - pixel->layers.size()];
                draw_line(data.name, data_text(data.values), "", true);
            }
        }
        ImGui::EndTable();
    }
    ImGui::PopFont();
}

}  // namespace velatura::compositor::window
