// SPDX-License-Identifier: Apache-2.0
#include "compositor/cli/noise_report.h"

#include "base/atomic_file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <charconv>
#include <cmath>
#include <string_view>

namespace velatura::compositor::cli {

namespace {

std::string rows_text(const char* title, const std::vector<noise::RowNoise>& rows) {
    if (rows.empty()) return {};
    std::string text = fmt::format("{}\n", title);
    for (const noise::RowNoise& row : rows)
        text += fmt::format("  {:<24} {:6.1f} %\n", row.name, 100 * row.share);
    return text;
}

}  // namespace

Result<double> parse_amount(const std::string& text,
                            const char* option,
                            const std::vector<std::pair<char, double>>& units) {
    std::string_view number = text;
    double unit = 1;
    for (const auto& [letter, value] : units) {
        if (!number.ends_with(letter)) continue;
        number.remove_suffix(1);
        unit = value;
        break;
    }
    double value = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
    const bool is_good = error == std::errc() && end == number.data() + number.size() &&
                         std::isfinite(value) && value > 0;
    if (is_good) return value * unit;
    std::string letters;
    for (const auto& [letter, factor] : units) letters += fmt::format(", {}", letter);
    return Error{"bad-target",
                 fmt::format("{}: cannot read '{}'; expected a number above 0, plain{}", option,
                             text, letters)};
}

Result<double> parse_target(const std::string& text) {
    return parse_amount(text, "--target", {{'%', 0.01}});
}

Result<double> render_seconds(const std::string& path) {
    const auto text = read_file(path);
    if (!text) return text.error();
    const auto j = nlohmann::json::parse(*text, nullptr, false);
    const auto at = nlohmann::json::json_pointer("/phases_s/render");
    if (!j.is_object() || !j.contains(at) || !j[at].is_number() || j[at].get<double>() <= 0)
        return Error{"bad-stats",
                     path + ": no phases_s.render, as velatura render --stats writes it"};
    return j[at].get<double>();
}

std::string percent(double value) {
    return fmt::format("{:.3g} %", 100 * value);
}

std::string interval(const statistics::RelativeError& error) {
    if (error.is_lower && error.half_in == 0)
        return fmt::format("> {} (a lower bound: caustics in mirrors or glass are too rare)",
                           percent(error.value));
    if (error.is_lower)
        return fmt::format("> {} (a lower bound: {} pixel{} half of the squared error)",
                           percent(error.value), error.half_in,
                           error.half_in == 1 ? " holds" : "s hold");
    return fmt::format("{} ({:.3g} to {:.3g})", percent(error.value), 100 * error.low,
                       100 * error.high);
}

std::string shares_text(const noise::NoiseForecast& forecast) {
    return rows_text("share of the squared error, by group", forecast.groups) +
           rows_text("by bounce", forecast.bounces) + rows_text("by lobe", forecast.lobes) +
           rows_text("by lifted shadow", forecast.shadows);
}

}  // namespace velatura::compositor::cli
