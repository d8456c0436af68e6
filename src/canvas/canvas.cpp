// SPDX-License-Identifier: Apache-2.0
#include "canvas/canvas.h"

#include "canvas/pixel_font.h"

#include <algorithm>
#include <cmath>

namespace velatura::canvas {

namespace {

constexpr int scale = 2;  // of a font of 7 pixels, its lines 12 apart

}  // namespace

Canvas::Canvas(int width, int height, const Color& background)
    : width_(width), height_(height), rgb_(3 * size_t(width) * size_t(height)) {
    fill(0, 0, width, height, background);
}

void Canvas::fill(int x, int y, int width, int height, const Color& color) {
    const int x1 = std::min(x + width, width_), y1 = std::min(y + height, height_);
    for (int py = std::max(y, 0); py < y1; ++py) {
        for (int px = std::max(x, 0); px < x1; ++px)
            std::copy(color.begin(), color.end(),
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

void Canvas::write(int x, int y, int width, std::string_view text, const Color& color) {
    while (!text.empty() && text_width(text) > width) text.remove_suffix(1);
    for (const LetterBox& box : letter_boxes(text))
        fill(x + scale * box.x, y + scale * box.y, scale * box.width, scale * box.height, color);
}

void Canvas::blend(int x, int y, const Color& color, double coverage) {
    if (x < 0 || y < 0 || x >= width_ || y >= height_ || !(coverage > 0)) return;
    float* const pixel = &rgb_[3 * (size_t(y) * size_t(width_) + size_t(x))];
    const float share = float(std::min(coverage, 1.0));
    for (size_t c = 0; c < 3; ++c) pixel[c] += share * (color[c] - pixel[c]);
}

void Canvas::write_along(int x, int y, std::string_view text, bool is_turned, const Color& color) {
    constexpr int base = capital_height * scale;
    for (const LetterBox& box : letter_boxes(text)) {
        for (int v = scale * box.y; v < scale * (box.y + box.height); ++v) {
            for (int u = scale * box.x; u < scale * (box.x + box.width); ++u) {
                if (is_turned)
                    blend(x + v - base, y - u, color, 1);
                else
                    blend(x + u, y + v - base, color, 1);
            }
        }
    }
}

void Canvas::draw_segment(const Point& a, const Point& b, double width, const Color& color) {
    const double dx = b.first - a.first, dy = b.second - a.second,
                 square = std::max(dx * dx + dy * dy, 1e-12), reach = 0.5 * width + 1;
    const int x0 = int(std::floor(std::min(a.first, b.first) - reach)),
              x1 = int(std::ceil(std::max(a.first, b.first) + reach));
    const int y0 = int(std::floor(std::min(a.second, b.second) - reach)),
              y1 = int(std::ceil(std::max(a.second, b.second) + reach));
    for (int y = std::max(y0, 0); y < std::min(y1, height_); ++y) {
        for (int x = std::max(x0, 0); x < std::min(x1, width_); ++x) {
            const double px = x + 0.5 - a.first, py = y + 0.5 - a.second;
            const double t = std::clamp((px * dx + py * dy) / square, 0.0, 1.0);
            blend(x, y, color, 0.5 * width + 0.5 - std::hypot(px - t * dx, py - t * dy));
        }
    }
}

int Canvas::text_width(std::string_view text) {
    return scale * canvas::text_width(text);
}

}  // namespace velatura::canvas
