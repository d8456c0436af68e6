// SPDX-License-Identifier: Apache-2.0
#include "compositor/canvas.h"

#include "image/pixel_font.h"

#include <algorithm>

namespace velatura::compositor {

namespace {

constexpr int scale = 2;  // of a font of 7 pixels, its lines 12 apart

}  // namespace

Canvas::Canvas(int width, int height, const Colour& background)
    : width_(width), height_(height), rgb_(3 * size_t(width) * size_t(height)) {
    fill(0, 0, width, height, background);
}

void Canvas::fill(int x, int y, int width, int height, const Colour& colour) {
    const int x1 = std::min(x + width, width_), y1 = std::min(y + height, height_);
    for (int py = std::max(y, 0); py < y1; ++py) {
        for (int px = std::max(x, 0); px < x1; ++px)
            std::copy(colour.begin(), colour.end(),
                      &rgb_[3 * (size_t(py) * size_t(width_) + size_t(px))]);
    }
}

void Canvas::paste(int x, int y, int width, int height, const std::vector<float>& rgb) {
    const int x0 = std::max(x, 0), x1 = std::min(x + width, width_);
    if (x0 >= x1) return;
    for (int py = std::max(y, 0); py < std::min(y + height, height_); ++py) {
        const float* const from = &rgb[3 * (size_t(py - y) * size_t(width) + size_t(x0 - x))];
        std::copy(from, from + 3 * size_t(x1 - x0),
                  &rgb_[3 * (size_t(py) * size_t(width_) + size_t(x0))]);
    }
}

void Canvas::write(int x, int y, int width, std::string_view text, const Colour& colour) {
    while (!text.empty() && text_width(text) > width) text.remove_suffix(1);
    for (const image::LetterBox& box : image::letter_boxes(text))
        fill(x + scale * box.x, y + scale * box.y, scale * box.width, scale * box.height, colour);
}

int Canvas::text_width(std::string_view text) {
    return scale * image::text_width(text);
}

}  // namespace velatura::compositor
