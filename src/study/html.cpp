// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "study/plots.h"
#include "study/png.h"
#include "study/report.h"
#include "study/rows.h"

namespace velatura::study {

namespace {

constexpr const char* style = R"css(
:root { color-scheme: light dark; --bg: #fcfcfb; --panel: #f1f0ee; --text: #1b1b1a; --soft: #5d5c58; --grid: #dddbd6; --good: #0a6b3d; --bad: #a3231c;
  --c0: #1b1b1a; --c1: #2a6fc9; --c2: #d1571f; --c3: #138a62; --c4: #9a5fc4; --c5: #b07d00; --c6: #c94b7d; }
@media (prefers-color-scheme: dark) { :root { --bg: #191918; --panel: #242422; --text: #eeede9; --soft: #aba9a2; --grid: #3a3936; --good: #5fce97; --bad: #ff8f86;
  --c0: #eeede9; --c1: #6aa8f5; --c2: #f08a55; --c3: #3fc295; --c4: #be92e6; --c5: #d9a93a; --c6: #ee86ae; } }
@media print { :root { --bg: #fff; --panel: #f4f4f4; --text: #000; --soft: #444; --grid: #ccc; --good: #064; --bad: #900; --c0: #000; --c1: #1d57a3; --c2: #a84110; --c3: #0c6a4a; --c4: #75419c; --c5: #7d5800; --c6: #9c2f5c; }
  figure, tr, .total { break-inside: avoid; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.2rem; max-width: 76rem; background: var(--bg); color: var(--text); font: 15px/1.45 system-ui, "Liberation Sans", sans-serif; }
h1 { font-size: 1.45rem; margin: 0 0 .2rem; } h2 { font-size: 1.12rem; margin: 2rem 0 .5rem; } h3 { font-size: 1rem; margin: 0 0 .3rem; }
p { margin: .3rem 0; max-width: 62rem; } .soft { color: var(--soft); } .small { font-size: .85rem; }
.total { display: flex; flex-wrap: wrap; gap: .6rem; margin: 1rem 0; padding: 0; }
.total div { background: var(--panel); border-radius: .4rem; padding: .5rem .8rem; } .total b { display: block; font-size: 1.25rem; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .32rem .55rem; border-bottom: 1px solid var(--grid); vertical-align: top; overflow-wrap: anywhere; } th { color: var(--soft); font-size: .78rem; letter-spacing: .03em; }
td.n { white-space: nowrap; } .good { color: var(--good); font-weight: 600; } .bad { color: var(--bad); font-weight: 600; }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 24rem), 1fr)); gap: 1rem; }
figure { margin: 0; background: var(--panel); border-radius: .4rem; padding: .7rem; min-width: 0; }
svg { width: 100%; height: auto; display: block; } svg text { fill: var(--soft); font-size: 12px; } .grid { stroke: var(--grid); stroke-width: 1; }
.curve { fill: none; stroke-width: 2; stroke-linejoin: round; } .dashed { stroke-dasharray: 5 4; stroke-width: 1.5; }
ul.key { list-style: none; margin: .3rem 0 0; padding: 0; display: flex; flex-wrap: wrap; gap: .1rem .9rem; font-size: .82rem; } .key i { display: inline-block; width: .75rem; height: .75rem; border-radius: .2rem; margin-right: .35rem; vertical-align: -.05rem; }
.bar { background: var(--grid); border-radius: .2rem; height: .65rem; min-width: 4rem; display: inline-block; width: calc(100% - 4.5rem); margin-right: .5rem; } .bar i { display: block; height: 100%; border-radius: .2rem; }
img { width: 100%; height: auto; image-rendering: pixelated; border-radius: .2rem; display: block; } figcaption { font-size: .82rem; color: var(--soft); margin-top: .3rem; }
@media (max-width: 46rem) { body { padding: .8rem; } table.cards thead { display: none; } table.cards tr { display: block; border-bottom: 2px solid var(--grid); padding: .5rem 0; }
  table.cards td { display: flex; gap: .8rem; border: 0; padding: .1rem 0; white-space: normal; } table.cards td.n { white-space: normal; } table.cards td::before { content: attr(data-name); color: var(--soft); font-size: .78rem; flex: 0 0 8.5rem; }
  table.cards td:empty { display: none; } }
)css";

const char* class_of(Verdict v) {
    switch (v) {
        case Verdict::BestBuy:
        case Verdict::Better:
        case Verdict::Cheaper: return " good";
        case Verdict::Suspect: return " bad";
        default: return "";
    }
}

std::string cell(const char* name, const std::string& content, const char* kind = "n") { return fmt::format("<td class=\"{}\" data-name=\"{}\">{}</td>", kind, name, escaped(content)); }

std::string header(const std::vector<const char*>& names) {
    std::string html = "<thead><tr>";
    for (const char* n : names) html += fmt::format("<th>{}</th>", n);
    return html + "</tr></thead>";
}

std::string between(const Estimate& e) { return fmt::format("{} [{}, {}]", percent(e.value), percent(e.low), percent(e.high)); }

std::string total(const Report& r) {
    const auto box = [](const std::string& name, const std::string& value, const std::string& note) { return fmt::format("<div><span class=\"soft small\">{}</span><b>{}</b><span class=\"soft small\">{}</span></div>", name, escaped(value), escaped(note)); };
    const SettingResult& base = r.settings[0];
    std::string html = "<div class=\"total\">";
    html += box("ERROR", percent(r.error), "relative, √relMSE");
    html += box("= NOISE", percent(r.noise.value), fmt::format("95 %: {} to {}", percent(r.noise.low), percent(r.noise.high)));
    html += box("+ BIAS", percent(r.bias), r.bias > 0 ? "by what is left out" : "none seen");
    html += box("CPU TIME", duration(base.cpu_s), fmt::format("and {} before the first sample", duration(base.setup_s)));
    if (base.slope.is_known) html += box("SLOPE", fmt::format("{:.2f}", base.slope.value), fmt::format("± {:.2f}; −0.50 is plain Monte Carlo", 1.96 * base.slope.standard_error));
    return html + "</div>";
}

std::string knob_table(const Report& r) {
    const std::vector<const char*> names = {"KNOB", "NOW", "ERROR IT LEAVES", "COST NOW", "NEXT VALUE", "BUYS", "COSTS", "VERDICT", ""};
    std::string html = "<table class=\"cards\">" + header(names) + "<tbody>";
    for (const KnobRow& row : r.rows) {
        const RowText t = text_of(r, row);
        html += "<tr>" + cell(names[0], t.knob, "") + cell(names[1], t.now, "") + cell(names[2], t.leaves, "") + cell(names[3], t.cost) + cell(names[4], t.next, "") + cell(names[5], t.buys) + cell(names[6], t.costs);
        html += cell(names[7], t.verdict, class_of(row.verdict)) + cell(names[8], t.advice, "soft small") + "</tr>";
    }
    return html + "</tbody></table>";
}

PlotCurve curve_of(const SettingResult& r, const std::string& label, int color) {
    PlotCurve c{label, color, {}};
    for (const CurvePoint& p : r.curve) {
        const double error = std::hypot(p.noise.value, r.bias);
        if (p.cpu_s <= 0 || error <= 0) continue;
        c.points.emplace_back(p.cpu_s, error);
        c.hints.push_back(fmt::format("{}: {} spp, {}, error {}", label, p.spp, duration(p.cpu_s), percent(error)));
    }
    return c;
}

std::string key_of(const std::vector<std::pair<PlotCurve, std::string>>& entries) {
    std::string html = "<ul class=\"key\">";
    for (const auto& [c, note] : entries) html += fmt::format("<li><i style=\"background:var(--c{})\"></i>{} <span class=\"soft\">{}</span></li>", c.color, escaped(c.label), escaped(note));
    return html + "</ul>";
}

std::string slope_text(const SettingResult& r) { return r.slope.is_known ? fmt::format("slope {:.2f}", r.slope.value) : std::string(); }

/// A plot for each knob whose values leave different error or take different time.
std::string knob_plots(const Report& r) {
    std::map<std::string, std::vector<const SettingResult*>> by_knob;
    std::vector<std::string> order;
    for (const KnobRow& row : r.rows) order.push_back(row.knob);
    for (const SettingResult& s : r.settings)
        if (s.setting.promise != Promise::Changes && s.rounds >= 2 && !s.setting.knob.empty()) by_knob[s.setting.knob].push_back(&s);
    std::string html;
    for (const std::string& knob : order) {
        const auto found = by_knob.find(knob);
        if (found == by_knob.end()) continue;
        std::string now;
        for (const KnobRow& row : r.rows)
            if (row.knob == knob) now = row.now;
        std::vector<PlotCurve> curves = {curve_of(r.settings[0], now + " (now)", 0)};
        std::vector<std::pair<PlotCurve, std::string>> key = {{curves[0], slope_text(r.settings[0])}};
        int color = 1;
        for (const SettingResult* s : found->second) {
            curves.push_back(curve_of(*s, s->setting.value, color));
            key.emplace_back(curves.back(), slope_text(*s));
            color = color % 6 + 1;
        }
        const std::string plot = log_plot(curves, "error against time by " + knob);
        if (!plot.empty()) html += fmt::format("<figure><h3>{}</h3>{}{}</figure>", escaped(knob), plot, key_of(key));
    }
    return html;
}

/// Every setting at the render's samples, and those that no other beats in both time and error.
std::string front_plot(const Report& r) {
    std::vector<PlotCurve> curves = {{"as it is", 0, {}, {}, true}, {"other settings", 1, {}, {}, true}, {"Pareto front", 2, {}, {}, false, true}};
    std::vector<std::pair<double, double>> all;
    for (const SettingResult& s : r.settings) {
        if (s.rounds < 2 || s.setting.promise == Promise::Changes || s.verdict == Verdict::Suspect || s.error <= 0 || s.cpu_s <= 0) continue;
        PlotCurve& c = curves[s.setting.knob.empty() ? 0 : 1];
        c.points.emplace_back(s.cpu_s, s.error);
        c.hints.push_back(fmt::format("{}: {}, error {}", s.setting.knob.empty() ? "as it is" : s.setting.options, duration(s.cpu_s), percent(s.error)));
        all.push_back(c.points.back());
    }
    std::sort(all.begin(), all.end());
    double least = 1e300;
    for (const auto& p : all) {
        if (p.second >= least) continue;
        least = p.second;
        curves[2].points.push_back(p);
    }
    const std::string plot = log_plot(curves, "all settings, error against time");
    if (plot.empty()) return {};
    return fmt::format("<figure><h3>All settings at {} samples, and the Pareto front</h3>{}{}</figure>", r.subject.spp, plot, key_of({{curves[0], ""}, {curves[1], "a mouse over a point says which"}, {curves[2], "nothing is both faster and better"}}));
}

std::string bar(double share, int color) {
    return fmt::format("<span class=\"bar\"><i style=\"width:{:.1f}%;background:var(--c{})\"></i></span>{:.1f} %", 100 * std::clamp(share, 0.0, 1.0), color, 100 * share);
}

std::string layer_tables(const Report& r) {
    std::string html;
    for (const bool is_bounce : {true, false}) {
        std::string rows;
        for (const LayerRow& l : r.layers) {
            if (l.is_bounce != is_bounce) continue;
            rows += fmt::format("<tr>{}<td data-name=\"energy\">{}</td><td data-name=\"noise\">{}</td></tr>", cell(is_bounce ? "bounce" : "light", l.name, ""), bar(l.energy, 1), bar(l.noise, 2));
        }
        if (rows.empty()) continue;
        html += fmt::format("<figure><h3>By {}</h3><table>{}<tbody>{}</tbody></table></figure>", is_bounce ? "bounce" : "light", header({is_bounce ? "BOUNCE" : "LIGHT", "SHARE OF THE LIGHT", "SHARE OF THE SQUARED NOISE"}), rows);
    }
    return html.empty() ? html : "<h2>Where the light comes from, and where the noise</h2><div class=\"plots\">" + html + "</div><p class=\"soft small\">Noises of parts make up for one another or add up: the shares need not come to 100 %. b0 is light seen directly, b1 light after one scattering.</p>";
}

std::string maps(const Report& r) {
    std::string html;
    for (const StudyMap& m : r.maps) {
        const std::string png = to_base64(to_png(r.grid.width, r.grid.height, m.rgb));
        html += fmt::format("<figure><h3>{}</h3><img alt=\"{}\" width=\"{}\" height=\"{}\" src=\"data:image/png;base64,{}\"><figcaption>{}</figcaption></figure>", escaped(m.name), escaped(m.name), r.grid.width, r.grid.height, png, escaped(m.caption));
    }
    if (html.empty()) return html;
    return fmt::format("<h2>Where the error is, and where the time goes</h2><p>{} of the pixels carry half of the squared noise, {} half of the time.</p><div class=\"plots\">{}</div>", percent(r.concentration), percent(r.time_concentration), html);
}

/// How far the mean of a setting is off that of its anchor.
std::string bias_text(const Report& r, const SettingResult& s) {
    const bool is_anchor = &s == &r.settings[s.setting.anchor];
    if (s.setting.knob.empty()) return percent(s.bias);
    if (is_anchor) return "exact";
    if (s.difference.is_same_picture) return "same picture";
    return s.difference.is_seen ? percent(s.difference.bias) : "none seen, < " + percent(s.difference.bias_limit);
}

std::string all_settings(const Report& r) {
    const std::vector<const char*> names = {"OPTIONS", "NOISE", "BIAS", "TIME", "ERROR AT EQUAL TIME", "SLOPE", "VERDICT"};
    std::string html = "<h2>Every setting</h2><table class=\"cards\">" + header(names) + "<tbody>";
    for (const SettingResult& s : r.settings) {
        html += "<tr>" + cell(names[0], s.setting.knob.empty() ? "as it is" : s.setting.options, "");
        if (s.rounds < 2) {
            html += fmt::format("<td colspan=\"6\" class=\"soft\">{}</td></tr>", escaped(s.refusal.empty() ? "not enough rounds" : s.refusal));
            continue;
        }
        const std::string bias = bias_text(r, s);
        const auto factor = [](const Estimate& e) { return fmt::format("× {:.3g} [{:.3g}, {:.3g}]", e.value, e.low, e.high); };
        html += cell(names[1], between(s.noise)) + cell(names[2], bias) + cell(names[3], factor(s.time));
        html += cell(names[4], s.setting.promise == Promise::Changes ? std::string("-") : factor(s.equal_time)) + cell(names[5], s.slope.is_known ? fmt::format("{:.2f} ± {:.2f}", s.slope.value, 1.96 * s.slope.standard_error) : "-");
        html += cell(names[6], text_of(s.verdict), class_of(s.verdict)) + "</tr>";
    }
    return html + "</tbody></table>";
}

std::string notes(const Report& r) {
    return fmt::format(
        "<h2>How this was found</h2><p>{} rounds, each of one render of every setting with one seed for all of them, of {} × {} pixels that lie one in each cell of a grid over the picture. "
        "Noise is the spread of independent seeds. Bias is the difference from the exact setting of the same seeds, less what noise adds to it. Intervals are 95 % and come from leaving out groups of pixels and from the spread over rounds. "
        "Times are CPU seconds of all threads, for the whole picture. <b>Error at equal time</b> is the error that a setting leaves when it renders for as long as the render takes as it is, over the error now: below 1 is better. "
        "A verdict needs 3.5 standard errors and 1.5 %. Errors are √relMSE: root of the mean of (x − ref)² / (ref² + 0.01). Stored as half floats, the picture is off by {} more. The study took {}.</p>",
        r.rounds, r.grid.width, r.grid.height, percent(r.half_error), duration(r.elapsed_s));
}

}  // namespace

std::string to_html(const Report& r) {
    const Subject& s = r.subject;
    std::string html = "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><link rel=\"icon\" href=\"data:,\">";
    html += fmt::format("<title>What accuracy costs: {}</title><style>{}</style></head><body>", escaped(s.scene), style);
    html += fmt::format("<h1>What accuracy costs: {}</h1><p class=\"soft\">{} × {} pixels, {} samples per pixel, {} threads, {}, build {}, seed {}, {}</p>", escaped(s.scene), s.width, s.height, s.spp, s.threads, escaped(s.machine), escaped(s.build), s.seed, escaped(s.date));
    html += total(r) + knob_table(r);
    const std::string front = front_plot(r), plots = knob_plots(r);
    if (!(front + plots).empty()) html += "<h2>Error against time</h2><div class=\"plots\">" + front + plots + "</div>";
    html += layer_tables(r) + maps(r) + all_settings(r) + notes(r);
    return html + "</body></html>\n";
}

}  // namespace velatura::study
