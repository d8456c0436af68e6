// SPDX-License-Identifier: Apache-2.0
#include "study/html_parts.h"

#include "base/base64.h"
#include "base/markup.h"
#include "study/plots.h"
#include "study/png.h"
#include "study/rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::study {

namespace {

/// Where time goes by the length of paths: what renders that cut them sooner take less.
std::string depth_table(const Report& r) {
    std::vector<std::pair<int, double>> shares;
    int now = 0;
    for (const KnobRow& row : r.rows)
        if (row.knob == "max bounces") now = std::atoi(row.now.c_str());
    for (const SettingResult& s : r.settings) {
        const int depth = std::atoi(s.setting.value.c_str());
        if (s.setting.knob == "max bounces" && s.rounds >= 2 && depth > 0 &&
            (now == 0 || depth < now))
            shares.emplace_back(depth, s.time.value);
    }
    if (shares.empty()) return {};
    std::sort(shares.begin(), shares.end());
    shares.emplace_back(now, 1.0);
    std::string rows;
    double before = 0;
    int depth_before = 0;
    for (const auto& [depth, measured] : shares) {
        // Times are known to some percent, and longer paths take no less
        const double share = std::clamp(measured, before, 1.0);
        const std::string name = depth == 0 ? fmt::format("b{} and on", depth_before + 1)
                                 : depth == depth_before + 1
                                     ? fmt::format("b{}", depth)
                                     : fmt::format("b{} to b{}", depth_before + 1, depth);
        rows += fmt::format("<tr>{}<td data-name=\"time\">{}</td></tr>",
                            cell("bounce", depth_before == 0 ? "b0, " + name : name, ""),
                            bar(share - before, 3));
        before = share;
        depth_before = depth;
    }
    return fmt::format(
        "<figure><h3>By bounce</h3><table>{}<tbody>{}</tbody></table><figcaption>Time saved by "
        "renders that terminate paths there (max bounces, above).</figcaption></figure>",
        header({"BOUNCE", "SHARE OF THE TIME"}), rows);
}

std::string effect_table(const Report& r) {
    std::string rows;
    for (const SettingResult& s : r.settings) {
        if (!s.setting.knob.starts_with("effect ") || s.rounds < 2) continue;
        const std::string interval =
            fmt::format("{:+.0f} % to {:+.0f} %", 100 * (1 - s.time.high), 100 * (1 - s.time.low));
        rows +=
            fmt::format("<tr>{}<td data-name=\"time\">{}</td>{}</tr>",
                        cell("effect", s.setting.knob.substr(7), ""),
                        bar(std::max(1 - s.time.value, 0.0), 3), cell("95 %", interval, "soft"));
    }
    if (rows.empty()) return {};
    return fmt::format(
        "<figure><h3>By effect</h3><table>{}<tbody>{}</tbody></table><figcaption>Time saved by "
        "renders without it.</figcaption></figure>",
        header({"EFFECT", "SHARE OF THE TIME", "95 %"}), rows);
}

}  // namespace

std::string cell(const char* name, const std::string& content, const char* kind) {
    // Lists are broken between their members, not within
    std::string html;
    for (const char c : escape_markup(content)) {
        html += c;
        if (c == ',') html += "<wbr>";
    }
    return fmt::format("<td class=\"{}\" data-name=\"{}\">{}</td>", kind, name, html);
}

std::string header(const std::vector<const char*>& names) {
    std::string html = "<thead><tr>";
    for (const char* n : names) html += fmt::format("<th>{}</th>", n);
    return html + "</tr></thead>";
}

std::string between(const Estimate& e) {
    return fmt::format("{} [{}, {}]", percent(e.value), percent(e.low), percent(e.high));
}

std::string bar(double share, int color) {
    return fmt::format(
        "<span class=\"bar\"><i style=\"width:{:.1f}%;background:var(--c{})\"></i></span>{:.1f} %",
        100 * std::clamp(share, 0.0, 1.0), color, 100 * share);
}

std::string image_tag(const std::string& name,
                      int width,
                      int height,
                      const std::vector<float>& rgb) {
    return fmt::format(
        "<img alt=\"{}\" width=\"{}\" height=\"{}\" src=\"data:image/png;base64,{}\">",
        escape_markup(name), width, height, to_base64(to_png(width, height, rgb)));
}

std::string images_section(const Report& r) {
    std::string html;
    for (const ShownImage& i : r.images)
        html += fmt::format("<figure><h3>{}</h3>{}<figcaption>{}</figcaption></figure>",
                            escape_markup(i.name), image_tag(i.name, i.width, i.height, i.rgb),
                            escape_markup(i.caption));
    if (html.empty()) return html;
    return "<h2>At equal render time</h2><p class=\"soft\">The noisiest part of the image, "
           "rendered with each of the top settings of the table at equal render time.</p><div "
           "class=\"plots\">" +
           html + "</div>";
}

std::string layers_section(const Report& r) {
    std::string html;
    for (const bool is_bounce : {true, false}) {
        std::string rows;
        for (const LayerRow& l : r.layers) {
            if (l.is_bounce != is_bounce) continue;
            rows += fmt::format(
                "<tr>{}<td data-name=\"energy\">{}</td><td data-name=\"noise\">{}</td></tr>",
                cell(is_bounce ? "bounce" : "light", l.name, ""), bar(l.energy, 1),
                bar(l.noise, 2));
        }
        if (rows.empty()) continue;
        html += fmt::format("<figure><h3>By {}</h3><table>{}<tbody>{}</tbody></table></figure>",
                            is_bounce ? "bounce" : "light",
                            header({is_bounce ? "BOUNCE" : "LIGHT", "SHARE OF THE LIGHT",
                                    "SHARE OF THE SQUARED NOISE"}),
                            rows);
    }
    return html.empty()
               ? html
               : "<h2>Light and noise by bounce and light group</h2><div class=\"plots\">" + html +
                     "</div><p class=\"soft small\">Noise of different parts can cancel or add: "
                     "shares need not sum to 100 %. b0 is light seen directly, b1 light after one "
                     "bounce.</p>";
}

std::string time_section(const Report& r) {
    const std::string html = depth_table(r) + effect_table(r);
    return html.empty()
               ? html
               : "<h2>Where the render time goes</h2><div class=\"plots\">" + html + "</div>";
}

std::string maps_section(const Report& r) {
    std::string html;
    for (const StudyMap& m : r.maps) {
        html += fmt::format(
            "<figure><h3>{}</h3>{}<figcaption>{}</figcaption></figure>", escape_markup(m.name),
            image_tag(m.name, r.grid.width, r.grid.height, m.rgb), escape_markup(m.caption));
    }
    if (html.empty()) return html;
    return fmt::format(
        "<h2>Where the error is, and where the time goes</h2><p>{} of the pixels have half of the "
        "squared noise, {} half of the time.</p><div class=\"plots\">{}</div>",
        percent(r.concentration), percent(r.time_concentration), html);
}

std::string files_section(const Report& r) {
    if (r.files.empty()) return {};
    const std::vector<const char*> names = {"FILE", "SIZE", "WRITING", "ROUNDING OF THE BEAUTY"};
    std::string rows;
    for (const FileFormat& f : r.files)
        rows += "<tr>" + cell(names[0], f.is_now ? f.options + " (now)" : f.options, "") +
                cell(names[1], fmt::format("{:.3g} MB", f.bytes * 1e-6)) +
                cell(names[2], duration(f.write_s)) +
                cell(names[3], f.error > 0 ? percent(f.error) : "none") + "</tr>";
    return fmt::format(
        "<h2>The file</h2><table class=\"cards\">{}<tbody>{}</tbody></table><p class=\"soft "
        "small\">Of the noisiest part of the image with all of its layers, scaled to the whole "
        "image;  writing in CPU time, with the check of what was written.</p>",
        header(names), rows);
}

}  // namespace velatura::study
