// SPDX-License-Identifier: Apache-2.0
#include "base/markup.h"
#include "study/html_parts.h"
#include "study/report_plots.h"
#include "study/rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::study {

namespace {

constexpr const char* style = R"css(
:root { color-scheme: light dark; --bg: #fcfcfb; --panel: #f1f0ee; --text: #1b1b1a; --soft: #5d5c58;
  --grid: #dddbd6; --good: #0a6b3d; --bad: #a3231c;
  --c0: #1b1b1a; --c1: #2a6fc9; --c2: #d1571f; --c3: #138a62; --c4: #9a5fc4; --c5: #b07d00;
  --c6: #c94b7d; }
@media (prefers-color-scheme: dark) { :root { --bg: #191918; --panel: #242422; --text: #eeede9;
  --soft: #aba9a2; --grid: #3a3936; --good: #5fce97; --bad: #ff8f86;
  --c0: #eeede9; --c1: #6aa8f5; --c2: #f08a55; --c3: #3fc295; --c4: #be92e6; --c5: #d9a93a;
  --c6: #ee86ae; } }
@media print { :root { --bg: #fff; --panel: #f4f4f4; --text: #000; --soft: #444; --grid: #ccc;
  --good: #064; --bad: #900; --c0: #000; --c1: #1d57a3; --c2: #a84110; --c3: #0c6a4a; --c4: #75419c;
  --c5: #7d5800; --c6: #9c2f5c; }
  figure, tr, .total { break-inside: avoid; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.2rem; max-width: 76rem; background: var(--bg); color: var(--text);
  font: 15px/1.45 system-ui, "Liberation Sans", sans-serif; }
h1 { font-size: 1.45rem; margin: 0 0 .2rem; } h2 { font-size: 1.12rem; margin: 2rem 0 .5rem; } h3 {
  font-size: 1rem; margin: 0 0 .3rem; }
p { margin: .3rem 0; max-width: 62rem; } .soft { color: var(--soft); } .small { font-size: .85rem; }
.total { display: flex; flex-wrap: wrap; gap: .6rem; margin: 1rem 0; padding: 0; }
.total div { background: var(--panel); border-radius: .4rem; padding: .5rem .8rem; } .total b {
  display: block; font-size: 1.25rem; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .32rem .55rem; border-bottom: 1px solid var(--grid);
  vertical-align: top; overflow-wrap: break-word; } figure td, figure th { overflow-wrap: normal;
  padding: .32rem .3rem; } th { color: var(--soft); font-size: .78rem; letter-spacing: .03em; }
td.n { white-space: nowrap; } .good { color: var(--good); font-weight: 600; } .bad {
  color: var(--bad); font-weight: 600; }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 24rem), 1fr));
  gap: 1rem; }
figure { margin: 0; background: var(--panel); border-radius: .4rem; padding: .7rem; min-width: 0; }
svg { width: 100%; height: auto; display: block; } svg text { fill: var(--soft); font-size: 12px; }
  .grid { stroke: var(--grid); stroke-width: 1; }
.curve { fill: none; stroke-width: 2; stroke-linejoin: round; } .dashed { stroke-dasharray: 5 4;
  stroke-width: 1.5; }
ul.key { list-style: none; margin: .3rem 0 0; padding: 0; display: flex; flex-wrap: wrap;
  gap: .1rem .9rem; font-size: .82rem; } .key i { display: inline-block; width: .75rem;
  height: .75rem; border-radius: .2rem; margin-right: .35rem; vertical-align: -.05rem; }
.bar { background: var(--grid); border-radius: .2rem; height: .65rem; min-width: 4rem;
  display: inline-block; width: calc(100% - 4.5rem); margin-right: .5rem; } .bar i { display: block;
  height: 100%; border-radius: .2rem; }
img { width: 100%; height: auto; image-rendering: pixelated; border-radius: .2rem; display: block; }
  figcaption { font-size: .82rem; color: var(--soft); margin-top: .3rem; }
@media (max-width: 46rem) { body { padding: .8rem; } table.cards thead { display: none; }
  table.cards tr { display: block; border-bottom: 2px solid var(--grid); padding: .5rem 0; }
  table.cards td { display: flex; gap: .8rem; border: 0; padding: .1rem 0; white-space: normal; }
  table.cards td.n { white-space: normal; } table.cards td::before { content: attr(data-name);
  color: var(--soft); font-size: .78rem; flex: 0 0 8.5rem; }
  table.cards td:empty { display: none; } }
)css";

const char* class_of(Verdict v) {
    switch (v) {
        case Verdict::MostEfficient:
        case Verdict::Better:
        case Verdict::Cheaper:
            return " good";
        case Verdict::Suspect:
            return " bad";
        default:
            return "";
    }
}

std::string total(const Report& r) {
    const auto box = [](const std::string& name, const std::string& value,
                        const std::string& note) {
        return fmt::format(
            "<div><span class=\"soft small\">{}</span><b>{}</b><span class=\"soft "
            "small\">{}</span></div>",
            name, escape_markup(value), escape_markup(note));
    };
    const SettingResult& base = r.settings[0];
    std::string html = "<div class=\"total\">";
    html += box("ERROR", percent(r.error), "relative, √relMSE");
    html += box("= NOISE", percent(r.noise.value),
                fmt::format("95 %: {} to {}", percent(r.noise.low), percent(r.noise.high)));
    html += box("+ BIAS", percent(r.bias), r.bias > 0 ? "by omission" : "none seen");
    html += box("CPU TIME", duration(base.cpu_s),
                fmt::format("and {} before the first sample", duration(base.setup_s)));
    if (base.slope.is_known)
        html += box(
            "SLOPE", fmt::format("{:.2f}", base.slope.value),
            fmt::format("± {:.2f}; −0.50 is plain Monte Carlo", 1.96 * base.slope.standard_error));
    return html + "</div>";
}

std::string knob_table(const Report& r) {
    const std::vector<const char*> names = {
        "KNOB", "NOW", "ERROR IT LEAVES", "COST NOW", "NEXT VALUE", "BUYS", "COSTS", "VERDICT", ""};
    std::string html = "<table class=\"cards\">" + header(names) + "<tbody>";
    for (const KnobRow& row : r.rows) {
        const RowText t = text_of(r, row);
        html += "<tr>" + cell(names[0], t.knob, "") + cell(names[1], t.now, "") +
                cell(names[2], t.leaves, "") + cell(names[3], t.cost) + cell(names[4], t.next, "") +
                cell(names[5], t.buys) + cell(names[6], t.costs);
        html += cell(names[7], t.verdict, class_of(row.verdict)) +
                cell(names[8], t.advice, "soft small") + "</tr>";
    }
    return html + "</tbody></table>";
}

std::string plots(const Report& r) {
    std::string html;
    for (const ReportPlot& plot : report_plots(r)) {
        std::string key = "<ul class=\"key\">";
        for (size_t i = 0; i < plot.curves.size(); ++i)
            key += fmt::format(
                "<li><i style=\"background:var(--c{})\"></i>{} <span class=\"soft\">{}</span></li>",
                plot.curves[i].color, escape_markup(plot.curves[i].label),
                escape_markup(plot.notes[i]));
        html += fmt::format("<figure><h3>{}</h3>{}{}</ul></figure>", escape_markup(plot.title),
                            to_svg(plot.drawing(), "error against time, " + plot.title), key);
    }
    return html.empty() ? html
                        : "<h2>Error against time</h2><div class=\"plots\">" + html +
                              "</div><p class=\"soft small\">Hover a point to see its setting.</p>";
}

/// How far the mean of a setting is off that of its anchor.
std::string bias_text(const Report& r, const SettingResult& s) {
    const bool is_anchor = &s == &r.settings[s.setting.anchor];
    if (s.setting.knob.empty()) return percent(s.bias);
    if (is_anchor) return "exact";
    if (s.difference.is_same_image) return "same image";
    return s.difference.is_seen ? percent(s.difference.bias)
                                : "none seen, < " + percent(s.difference.bias_limit);
}

std::string all_settings(const Report& r) {
    const std::vector<const char*> names = {
        "OPTIONS", "NOISE", "BIAS", "TIME", "ERROR AT EQUAL TIME", "SLOPE", "VERDICT"};
    std::string html = "<h2>Every setting</h2><table class=\"cards\">" + header(names) + "<tbody>";
    for (const SettingResult& s : r.settings) {
        html +=
            "<tr>" + cell(names[0], s.setting.knob.empty() ? "as it is" : s.setting.options, "");
        if (s.rounds < 2) {
            html +=
                fmt::format("<td colspan=\"6\" class=\"soft\">{}</td></tr>",
                            escape_markup(s.rejection.empty() ? "not enough rounds" : s.rejection));
            continue;
        }
        const std::string bias = bias_text(r, s);
        const auto factor = [](const Estimate& e) {
            return fmt::format("× {:.3g} [{:.3g}, {:.3g}]", e.value, e.low, e.high);
        };
        html += cell(names[1], between(s.noise)) + cell(names[2], bias) +
                cell(names[3], factor(s.time));
        html += cell(names[4], s.setting.bias_class == BiasClass::Changes ? std::string("-")
                                                                          : factor(s.equal_time)) +
                cell(names[5], s.slope.is_known ? fmt::format("{:.2f} ± {:.2f}", s.slope.value,
                                                              1.96 * s.slope.standard_error)
                                                : "-");
        html += cell(names[6], text_of(s.verdict), class_of(s.verdict)) + "</tr>";
    }
    return html + "</tbody></table>";
}

std::string notes(const Report& r) {
    return fmt::format(
        "<h2>How this was measured</h2><p>{} rounds, each of one render of every setting with one "
        "seed for all of them, of {} × {} pixels, one in each cell of a grid over the "
        "image. "
        "Noise is the spread of independent seeds. Bias is the difference from the exact setting "
        "of the same seeds, minus the part that noise adds. Intervals are 95 %, from the "
        "jackknife over groups of pixels and from the spread over rounds. "
        "Times are CPU seconds of all threads, for the whole image. <b>Error at equal time</b> "
        "is the error of a setting at the render time of the render, relative to the error of the "
        "render: below 1 is better. "
        "A verdict needs 3.5 standard errors and 1.5 %. Errors are √relMSE: root of the mean of (x "
        "− ref)² / (ref² + 0.01). Half-float storage adds an error of {}. The study "
        "took {}.</p>",
        r.rounds, r.grid.width, r.grid.height, percent(r.half_error), duration(r.elapsed_s));
}

}  // namespace

std::string to_html(const Report& r) {
    const Subject& s = r.subject;
    std::string html =
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
        "content=\"width=device-width, initial-scale=1\"><link rel=\"icon\" href=\"data:,\">";
    html += fmt::format("<title>What accuracy costs: {}</title><style>{}</style></head><body>",
                        escape_markup(s.scene), style);
    html += fmt::format(
        "<h1>What accuracy costs: {}</h1><p class=\"soft\">{} × {} pixels, {} samples per pixel, "
        "{} threads, {}, build {}, seed {}, {}</p>",
        escape_markup(s.scene), s.width, s.height, s.spp, s.threads, escape_markup(s.machine),
        escape_markup(s.build), s.seed, escape_markup(s.date));
    html += total(r) + knob_table(r);
    html += plots(r) + images_section(r) + layers_section(r) + time_section(r) + maps_section(r) +
            files_section(r) + all_settings(r) + notes(r);
    return html + "</body></html>\n";
}

}  // namespace velatura::study
