// SPDX-License-Identifier: Apache-2.0
#include "study/plots.h"

#include "base/markup.h"
#include "study/rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::study {

namespace {

constexpr double width = 520, height = 330, left = 62, right = 14, top = 14, bottom = 44;

/// One axis: a range of logarithms onto a range of the drawing.
class Axis {
  public:
    Axis(double low, double high, double from, double to) : from_(from), to_(to) {
        // A little air, and never less than a factor of two
        const double middle = 0.5 * (std::log10(low) + std::log10(high)),
                     half = std::max(0.5 * (std::log10(high) - std::log10(low)) + 0.06, 0.15);
        low_ = middle - half;
        high_ = middle + half;
    }

    double at(double v) const {
        return from_ + (std::log10(v) - low_) / (high_ - low_) * (to_ - from_);
    }

    /// Round numbers, as many of them as can be read.
    std::vector<double> ticks() const {
        static const std::vector<double> tens = {1}, few = {1, 2, 5},
                                         more = {1, 1.5, 2, 3, 4, 5, 7},
                                         many = {1,   1.2, 1.4, 1.6, 1.8, 2, 2.5, 3,
                                                 3.5, 4,   4.5, 5,   6,   7, 8,   9};
        std::vector<double> all;
        const double decades = high_ - low_;
        for (int e = int(std::floor(low_)) - 1; e <= int(std::ceil(high_)); ++e) {
            for (const double m : decades > 2.5   ? tens
                                  : decades > 1.2 ? few
                                  : decades > 0.5 ? more
                                                  : many) {
                const double v = m * std::pow(10.0, e);
                if (std::log10(v) >= low_ && std::log10(v) <= high_) all.push_back(v);
            }
        }
        return all;
    }

  private:
    double low_, high_, from_, to_;
};

using Anchor = PlotDrawing::Anchor;

void draw_axes(PlotDrawing& drawing, const Axis& x, const Axis& y) {
    for (const double v : x.ticks()) {
        drawing.lines.push_back({{{x.at(v), top}, {x.at(v), height - bottom}}});
        drawing.texts.push_back({x.at(v), height - bottom + 16, duration(v), Anchor::Middle});
    }
    for (const double v : y.ticks()) {
        drawing.lines.push_back({{{left, y.at(v)}, {width - right, y.at(v)}}});
        drawing.texts.push_back({left - 6, y.at(v) + 4, percent(v), Anchor::End});
    }
    drawing.texts.push_back(
        {0.5 * (left + width - right), height - 8, "CPU time of the image", Anchor::Middle});
    drawing.texts.push_back(
        {13, 0.5 * (top + height - bottom), "relative error", Anchor::Middle, true});
}

void draw_curve(PlotDrawing& drawing, const PlotCurve& c, const Axis& x, const Axis& y) {
    PlotDrawing::Line line{{}, c.color, c.is_dashed ? 1.5 : 2.0, c.is_dashed};
    for (const auto& [px, py] : c.points) line.points.emplace_back(x.at(px), y.at(py));
    for (size_t i = 0; i < c.points.size() && !c.is_dashed; ++i)
        drawing.dots.push_back({line.points[i].first, line.points[i].second,
                                c.color == 0 ? 4.5 : 3.5, c.color,
                                i < c.hints.size() ? c.hints[i] : c.label});
    if (!c.is_dots) drawing.lines.push_back(std::move(line));
}

std::string color_of(int color) {
    return color == PlotDrawing::grid_color   ? "var(--grid)"
           : color == PlotDrawing::text_color ? "var(--soft)"
                                              : fmt::format("var(--c{})", color);
}

}  // namespace

PlotDrawing log_plot(const std::vector<PlotCurve>& curves) {
    double x0 = 1e300, x1 = 0, y0 = 1e300, y1 = 0;
    for (const PlotCurve& c : curves) {
        for (const auto& [x, y] : c.points) {
            x0 = std::min(x0, x);
            x1 = std::max(x1, x);
            y0 = std::min(y0, y);
            y1 = std::max(y1, y);
        }
    }
    PlotDrawing drawing{.width = width, .height = height, .lines = {}, .dots = {}, .texts = {}};
    if (!(x0 > 0 && y0 > 0 && x1 >= x0 && y1 >= y0)) return drawing;
    const Axis x(x0, x1, left, width - right), y(y0, y1, height - bottom, top);
    draw_axes(drawing, x, y);
    // The render as it is lies on top
    for (size_t i = curves.size(); i-- > 0;) draw_curve(drawing, curves[i], x, y);
    return drawing;
}

std::string to_svg(const PlotDrawing& drawing, const std::string& title) {
    static constexpr const char* anchors[] = {"start", "middle", "end"};
    std::string svg = fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">",
                                  drawing.width, drawing.height, escape_markup(title));
    for (const PlotDrawing::Line& l : drawing.lines) {
        std::string path;
        for (const auto& [x, y] : l.points)
            path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : " L", x, y);
        svg += fmt::format("<path class=\"curve{}\" style=\"stroke:{};stroke-width:{}\" d=\"{}\"/>",
                           l.is_dashed ? " dashed" : "", color_of(l.color), l.width, path);
    }
    for (const PlotDrawing::Dot& d : drawing.dots)
        svg += fmt::format(
            "<circle style=\"fill:{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" "
            "r=\"{}\"><title>{}</title></circle>",
            color_of(d.color), d.x, d.y, d.radius, escape_markup(d.hint));
    for (const PlotDrawing::Text& t : drawing.texts) {
        const std::string place =
            t.is_upright
                ? fmt::format("transform=\"translate({:.1f} {:.1f}) rotate(-90)\"", t.x, t.y)
                : fmt::format("x=\"{:.1f}\" y=\"{:.1f}\"", t.x, t.y);
        svg += fmt::format("<text {} text-anchor=\"{}\">{}</text>", place, anchors[int(t.anchor)],
                           escape_markup(t.content));
    }
    return svg + "</svg>";
}

}  // namespace velatura::study
