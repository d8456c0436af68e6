// SPDX-License-Identifier: Apache-2.0
#include "study/report_plots.h"

#include "study/png.h"
#include "study/raster.h"
#include "study/rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

namespace velatura::study {

namespace {

PlotCurve curve_of(const SettingResult& r, const std::string& label, int color) {
    PlotCurve c{label, color, {}};
    for (const CurvePoint& p : r.curve) {
        const double error = std::hypot(p.noise.value, r.bias);
        if (p.cpu_s <= 0 || error <= 0) continue;
        c.points.emplace_back(p.cpu_s, error);
        c.hints.push_back(fmt::format("{}: {} spp, {}, error {}", label, p.spp, duration(p.cpu_s),
                                      percent(error)));
    }
    return c;
}

std::string slope_text(const SettingResult& r) {
    return r.slope.is_known ? fmt::format("slope {:.2f}", r.slope.value) : std::string();
}

/// Every setting at the render's samples, and those that no other beats in both time and error.
ReportPlot plot_of_all(const Report& r) {
    ReportPlot plot{"all",
                    fmt::format("All settings at {} samples, and the Pareto front", r.subject.spp),
                    {},
                    {"", "", "no setting is both faster and better"}};
    plot.curves = {{"as it is", 0, {}, {}, true},
                   {"other settings", 1, {}, {}, true},
                   {"Pareto front", 2, {}, {}, false, true}};
    std::vector<std::pair<double, double>> all;
    for (const SettingResult& s : r.settings) {
        if (s.rounds < 2 || s.setting.bias_class == BiasClass::Changes ||
            s.verdict == Verdict::Suspect || s.error <= 0 || s.cpu_s <= 0)
            continue;
        PlotCurve& c = plot.curves[s.setting.knob.empty() ? 0 : 1];
        c.points.emplace_back(s.cpu_s, s.error);
        c.hints.push_back(fmt::format("{}: {}, error {}",
                                      s.setting.knob.empty() ? "as it is" : s.setting.options,
                                      duration(s.cpu_s), percent(s.error)));
        all.push_back(c.points.back());
    }
    std::sort(all.begin(), all.end());
    double min = 1e300;
    for (const auto& p : all) {
        if (p.second >= min) continue;
        min = p.second;
        plot.curves[2].points.push_back(p);
    }
    return plot;
}

ReportPlot plot_of_knob(const Report& r,
                        const KnobRow& row,
                        const std::vector<const SettingResult*>& settings) {
    ReportPlot plot{{},
                    row.knob,
                    {curve_of(r.settings[0], row.now + " (now)", 0)},
                    {slope_text(r.settings[0])}};
    for (const char c : row.knob)
        plot.name += std::isalnum(static_cast<unsigned char>(c)) ? c : '-';
    for (const SettingResult* s : settings) {
        plot.curves.push_back(curve_of(*s, s->setting.value, int(plot.curves.size() - 1) % 6 + 1));
        plot.notes.push_back(slope_text(*s));
    }
    return plot;
}

}  // namespace

std::vector<ReportPlot> report_plots(const Report& r) {
    std::map<std::string, std::vector<const SettingResult*>> by_knob;
    for (const SettingResult& s : r.settings)
        if (s.setting.bias_class != BiasClass::Changes && s.rounds >= 2 && !s.setting.knob.empty())
            by_knob[s.setting.knob].push_back(&s);
    std::vector<ReportPlot> plots = {plot_of_all(r)};
    for (const KnobRow& row : r.rows)
        if (const auto found = by_knob.find(row.knob); found != by_knob.end())
            plots.push_back(plot_of_knob(r, row, found->second));
    std::erase_if(plots, [](const ReportPlot& p) { return p.drawing().is_empty(); });
    return plots;
}

std::string to_png(const ReportPlot& plot) {
    // Title above, key below, a line for each curve
    constexpr double scale = 1200.0 / 520.0, title_height = 24, line_height = 15, left = 62;
    PlotDrawing drawing = plot.drawing();
    const double key_top = title_height + drawing.height;
    for (size_t i = 0; i < plot.curves.size(); ++i) {
        const double y = key_top + line_height * (double(i) + 0.7) - title_height;
        drawing.dots.push_back({left + 4, y - 4, 4, plot.curves[i].color, {}});
        drawing.texts.push_back(
            {left + 14, y,
             plot.curves[i].label + (plot.notes[i].empty() ? "" : ", " + plot.notes[i]),
             PlotDrawing::Anchor::Start, false, 0});
    }
    drawing.texts.push_back({left, -8, plot.title, PlotDrawing::Anchor::Start, false, 0});
    canvas::Canvas canvas = plot_paper(
        1200, int(std::ceil(scale * (key_top + line_height * double(plot.curves.size()) + 8))));
    draw_plot(canvas, drawing, scale, 0, title_height);
    return to_png(canvas.width(), canvas.height(), canvas.rgb());
}

}  // namespace velatura::study
