// SPDX-License-Identifier: Apache-2.0
#include "study/raster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace velatura::study {

using canvas::Canvas;

namespace {

using Color = Canvas::Color;
using Point = Canvas::Point;

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

void draw_line(Canvas& canvas,
               const std::vector<Point>& points,
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
        if (!is_dashed) canvas.draw_segment(a, b, width, color);
        for (double t = -std::fmod(begun, dash + gap); is_dashed && t < length; t += dash + gap)
            if (t + dash > 0)
                canvas.draw_segment(at(std::max(t, 0.0)), at(std::min(t + dash, length)), width,
                                    color);
        begun += length;
    }
}

void draw_text(Canvas& canvas, const Point& at, const PlotDrawing::Text& text, const Color& color) {
    const int length = Canvas::text_width(text.content);
    const int start = text.anchor == PlotDrawing::Anchor::Start    ? 0
                      : text.anchor == PlotDrawing::Anchor::Middle ? length / 2
                                                                   : length;
    const int x = int(std::lround(at.first)), y = int(std::lround(at.second));
    if (text.is_upright)
        canvas.write_along(x, y + start, text.content, true, color);
    else
        canvas.write_along(x - start, y, text.content, false, color);
}

}  // namespace

Canvas plot_paper(int width, int height) {
    return {width, height, paper};
}

void draw_plot(Canvas& canvas, const PlotDrawing& drawing, double scale, double dx, double dy) {
    const auto placed = [&](double x, double y) {
        return Point(scale * (x + dx), scale * (y + dy));
    };
    for (const PlotDrawing::Line& l : drawing.lines) {
        std::vector<Point> points;
        for (const auto& [x, y] : l.points) points.push_back(placed(x, y));
        draw_line(canvas, points, scale * l.width * 0.7, l.is_dashed, color_of(l.color));
    }
    for (const PlotDrawing::Dot& d : drawing.dots)
        canvas.draw_segment(placed(d.x, d.y), placed(d.x, d.y), 2 * scale * d.radius,
                            color_of(d.color));
    for (const PlotDrawing::Text& t : drawing.texts)
        draw_text(canvas, placed(t.x, t.y), t, color_of(t.color));
}

}  // namespace velatura::study
