// SPDX-License-Identifier: Apache-2.0
#include "study/raster.h"

#include "image/pixel_font.h"

#include <algorithm>
#include <cmath>

namespace velatura::study {

namespace {

using Color = std::array<float, 3>;

constexpr Color rgb(unsigned hex) {
    return {float(hex >> 16 & 255) / 255.0f, float(hex >> 8 & 255) / 255.0f,
            float(hex & 255) / 255.0f};
}

/// Those of the page's style.
Color color_of(int color) {
    static constexpr std::array<Color, 7> curves = {rgb(0x1b1b1a), rgb(0x2a6fc9), rgb(0xd1571f),
                                                    rgb(0x138a62), rgb(0x9a5fc4), rgb(0xb07d00),
                                                    rgb(0xc94b7d)};
    if (color == PlotDrawing::grid_color) return rgb(0xdddbd6);
    return color == PlotDrawing::text_color ? rgb(0x5d5c58) : curves[size_t(color)];
}

constexpr Color paper = rgb(0xfcfcfb);

/// Pixels for one of the font.
constexpr int letter_scale = 2;

}  // namespace

Raster::Raster(int width, int height) : width_(width), height_(height) {
    rgb_.reserve(3 * size_t(width) * size_t(height));
    for (size_t i = 0; i < size_t(width) * size_t(height); ++i)
        rgb_.insert(rgb_.end(), paper.begin(), paper.end());
}

void Raster::blend(int x, int y, const Color& color, double coverage) {
    if (x < 0 || y < 0 || x >= width_ || y >= height_ || !(coverage > 0)) return;
    float* const pixel = &rgb_[3 * (size_t(y) * size_t(width_) + size_t(x))];
    const float share = float(std::min(coverage, 1.0));
    for (size_t c = 0; c < 3; ++c) pixel[c] += share * (color[c] - pixel[c]);
}

void Raster::draw_segment(const Point& a, const Point& b, double width, const Color& color) {
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

void Raster::draw_line(const std::vector<Point>& points,
                       double width,
                       bool is_dashed,
                       const Color& color) {
    constexpr double dash = 12, gap = 9;
    double begun = 0;  // of the way, at the segment
    for (size_t i = 1; i < points.size(); ++i) {
        const Point a = points[i - 1], b = points[i];
        const double length = std::hypot(b.first - a.first, b.second - a.second);
        const auto at = [&](double t) {
            return Point(a.first + t / length * (b.first - a.first),
                         a.second + t / length * (b.second - a.second));
        };
        if (!is_dashed) draw_segment(a, b, width, color);
        for (double t = -std::fmod(begun, dash + gap); is_dashed && t < length; t += dash + gap)
            if (t + dash > 0)
                draw_segment(at(std::max(t, 0.0)), at(std::min(t + dash, length)), width, color);
        begun += length;
    }
}

void Raster::draw_text(const Point& at, const PlotDrawing::Text& text, const Color& color) {
    const int length = letter_scale * image::text_width(text.content);
    const int start = text.anchor == PlotDrawing::Anchor::Start    ? 0
                      : text.anchor == PlotDrawing::Anchor::Middle ? length / 2
                                                                   : length;
    const int x0 = int(std::lround(at.first)), y0 = int(std::lround(at.second));
    constexpr int base = image::capital_height * letter_scale;
    for (const image::LetterBox& box : image::letter_boxes(text.content)) {
        for (int v = letter_scale * box.y; v < letter_scale * (box.y + box.height); ++v) {
            for (int u = letter_scale * box.x; u < letter_scale * (box.x + box.width); ++u) {
                if (text.is_upright)
                    blend(x0 + v - base, y0 - u + start, color, 1);
                else
                    blend(x0 + u - start, y0 + v - base, color, 1);
            }
        }
    }
}

void Raster::draw(const PlotDrawing& drawing, double scale, double dx, double dy) {
    const auto placed = [&](double x, double y) {
        return Point(scale * (x + dx), scale * (y + dy));
    };
    for (const PlotDrawing::Line& l : drawing.lines) {
        std::vector<Point> points;
        for (const auto& [x, y] : l.points) points.push_back(placed(x, y));
        draw_line(points, scale * l.width * 0.7, l.is_dashed, color_of(l.color));
    }
    for (const PlotDrawing::Dot& d : drawing.dots)
        draw_segment(placed(d.x, d.y), placed(d.x, d.y), 2 * scale * d.radius, color_of(d.color));
    for (const PlotDrawing::Text& t : drawing.texts)
        draw_text(placed(t.x, t.y), t, color_of(t.color));
}

}  // namespace velatura::study
