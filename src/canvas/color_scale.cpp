// SPDX-License-Identifier: Apache-2.0
#include "canvas/color_scale.h"

#include "canvas/false_color.h"

#include <algorithm>

namespace velatura::canvas {

namespace {

constexpr int scale_height = 44, bar_height = 14, margin = 6, tick_height = 4, gap = 12;
constexpr Canvas::Color background = {0.11f, 0.11f, 0.12f}, letters = {0.92f, 0.92f, 0.92f};

}  // namespace

Canvas with_heat_scale(int width,
                       int height,
                       const std::vector<float>& rgb,
                       const std::vector<ScaleLabel>& labels) {
    int min_width = 2 * margin;
    for (const ScaleLabel& label : labels) min_width += Canvas::text_width(label.text) + gap;
    Canvas canvas(std::max(width, min_width), height + scale_height, background);
    canvas.paste(0, 0, width, height, rgb);
    const int bar_width = canvas.width() - 2 * margin, bar = height + margin;
    for (int x = 0; x < bar_width; ++x)
        canvas.fill(margin + x, bar, 1, bar_height, heat(float(x) / float(bar_width - 1)));
    for (const ScaleLabel& label : labels) {
        const int x = margin + int(label.t * float(bar_width - 1));
        const int text_width = Canvas::text_width(label.text);
        canvas.fill(x, bar + bar_height, 1, tick_height, letters);
        canvas.write(std::clamp(x - text_width / 2, margin, margin + bar_width - text_width),
                     bar + bar_height + tick_height + 2, text_width, label.text, letters);
    }
    return canvas;
}

}  // namespace velatura::canvas
