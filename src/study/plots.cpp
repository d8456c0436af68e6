// SPDX-License-Identifier: Apache-2.0
#include "study/plots.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "study/rows.h"

namespace velatura::study {

namespace {

constexpr double width = 520, height = 330, left = 62, right = 14, top = 14, bottom = 44;

/// One axis: a range of logarithms onto a range of the drawing.
class Axis {
  public:
    Axis(double low, double high, double from, double to) : from_(from), to_(to) {
        // A little air, and never less than a factor of two
        const double middle = 0.5 * (std::log10(low) + std::log10(high)), half = std::max(0.5 * (std::log10(high) - std::log10(low)) + 0.06, 0.15);
        low_ = middle - half;
        high_ = middle + half;
    }

    double at(double v) const { return from_ + (std::log10(v) - low_) / (high_ - low_) * (to_ - from_); }

    /// Round numbers, as many of them as can be read.
    std::vector<double> ticks() const {
        static const std::vector<double> tens = {1}, few = {1, 2, 5}, more = {1, 1.5, 2, 3, 4, 5, 7}, many = {1, 1.2, 1.4, 1.6, 1.8, 2, 2.5, 3, 3.5, 4, 4.5, 5, 6, 7, 8, 9};
        std::vector<double> all;
        const double decades = high_ - low_;
        for (int e = int(std::floor(low_)) - 1; e <= int(std::ceil(high_)); ++e) {
            for (const double m : decades > 2.5 ? tens : decades > 1.2 ? few : decades > 0.5 ? more : many) {
                const double v = m * std::pow(10.0, e);
                if (std::log10(v) >= low_ && std::log10(v) <= high_) all.push_back(v);
            }
        }
        return all;
    }

  private:
    double low_, high_, from_, to_;
};

std::string text(double x, double y, const char* anchor, const std::string& content) {
    return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>", x, y, anchor, escaped(content));
}

std::string axes(const Axis& x, const Axis& y) {
    std::string svg;
    for (const double v : x.ticks()) {
        svg += fmt::format("<line class=\"grid\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/>", x.at(v), top, height - bottom);
        svg += text(x.at(v), height - bottom + 16, "middle", duration(v));
    }
    for (const double v : y.ticks()) {
        svg += fmt::format("<line class=\"grid\" y1=\"{0:.1f}\" y2=\"{0:.1f}\" x1=\"{1}\" x2=\"{2}\"/>", y.at(v), left, width - right);
        svg += text(left - 6, y.at(v) + 4, "end", percent(v));
    }
    svg += text(0.5 * (left + width - right), height - 8, "middle", "CPU time of the picture");
    svg += fmt::format("<text transform=\"translate(13 {:.0f}) rotate(-90)\" text-anchor=\"middle\">relative error</text>", 0.5 * (top + height - bottom));
    return svg;
}

std::string curve(const PlotCurve& c, const Axis& x, const Axis& y) {
    std::string svg, path;
    for (const auto& [px, py] : c.points) path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : " L", x.at(px), y.at(py));
    if (!c.is_dots) svg += fmt::format("<path class=\"curve{}\" style=\"stroke:var(--c{})\" d=\"{}\"/>", c.is_dashed ? " dashed" : "", c.color, path);
    for (size_t i = 0; i < c.points.size() && !c.is_dashed; ++i) {
        const std::string hint = i < c.hints.size() ? c.hints[i] : c.label;
        svg += fmt::format("<circle style=\"fill:var(--c{})\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\"><title>{}</title></circle>", c.color, x.at(c.points[i].first), y.at(c.points[i].second), c.color == 0 ? 4.5 : 3.5, escaped(hint));
    }
    return svg;
}

}  // namespace

std::string log_plot(const std::vector<PlotCurve>& curves, const std::string& title) {
    double x0 = 1e300, x1 = 0, y0 = 1e300, y1 = 0;
    for (const PlotCurve& c : curves) {
        for (const auto& [x, y] : c.points) {
            x0 = std::min(x0, x);
            x1 = std::max(x1, x);
            y0 = std::min(y0, y);
            y1 = std::max(y1, y);
        }
    }
    if (!(x0 > 0 && y0 > 0 && x1 >= x0 && y1 >= y0)) return {};
    const Axis x(x0, x1, left, width - right), y(y0, y1, height - bottom, top);
    std::string svg = fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">", width, height, escaped(title));
    svg += axes(x, y);
    // The render as it is lies on top
    for (size_t i = curves.size(); i-- > 0;) svg += curve(curves[i], x, y);
    return svg + "</svg>";
}

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&': out += "&amp;"; break;
            case '<': out += "&lt;"; break;
            case '>': out += "&gt;"; break;
            case '"': out += "&quot;"; break;
            default: out += c;
        }
    }
    return out;
}

}  // namespace velatura::study
