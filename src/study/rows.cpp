// SPDX-License-Identifier: Apache-2.0
#include "study/rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::study {

namespace {

const CurvePoint* at(const SettingResult& r, uint64_t spp) {
    for (const CurvePoint& p : r.curve)
        if (p.spp == spp) return &p;
    return nullptr;
}

double joined(double noise, double bias) {
    return std::sqrt(noise * noise + bias * bias);
}

KnobRow samples_row(const Report& report) {
    const SettingResult& base = report.settings[0];
    KnobRow row{.knob = samples_knob, .now = fmt::format("{}", report.subject.spp), .advice = {}};
    row.cost_share = 1;
    row.verdict = Verdict::Now;
    const CurvePoint* now = at(base, report.subject.spp);
    const CurvePoint* twice = at(base, 2 * report.subject.spp);
    if (!now || !twice || base.rounds < 2) return row;
    row.buys = joined(twice->noise.value, base.bias) - joined(now->noise.value, base.bias);
    row.costs_s = twice->cpu_s - now->cpu_s;
    row.advice = base.bias > now->noise.value
                     ? "most of the error is bias, which more samples do not reduce"
                     : "reference: the same time spent on samples";
    return row;
}

/// Of the knob's other values, the one to look at: by what it does in equal time.
size_t next_of(const Report& report, const Knob& knob) {
    size_t next = 0;
    double best = 0;
    for (size_t s = 1; s < report.settings.size(); ++s) {
        const SettingResult& r = report.settings[s];
        if (r.setting.knob != knob.name || r.verdict == Verdict::Unknown) continue;
        // Nobody should miss a promise that was broken; another image is looked at for its time
        const double rank = r.verdict == Verdict::Suspect   ? -1.0
                            : r.verdict == Verdict::Changes ? r.time.value
                                                            : r.equal_time.value;
        if (next != 0 && rank >= best) continue;
        next = s;
        best = rank;
    }
    return next;
}

/// Exact values are at hand, so that the bias is known against them.
double bias_now(const Report& report, const Knob& knob, bool& is_biased) {
    for (size_t s = 1; s < report.settings.size(); ++s) {
        const SettingResult& r = report.settings[s];
        if (r.setting.knob != knob.name || r.setting.anchor != s) continue;
        is_biased = r.difference.is_seen;
        return is_biased ? r.difference.bias : r.difference.bias_limit;
    }
    return 0;
}

double cost_share(const Report& report, const Knob& knob) {
    double min = 1;
    for (const SettingResult& r : report.settings)
        if (r.setting.knob == knob.name && r.verdict != Verdict::Unknown)
            min = std::min(min, r.time.value);
    return 1 - min;
}

/// That no difference was seen says something only where a large one would have been.
std::string told_apart(const Estimate& ratio) {
    constexpr double close = 0.05;
    const double off = std::max(ratio.high - 1, 1 - ratio.low);
    if (off < close)
        return fmt::format("no difference at equal time, to {:.0f} %", std::ceil(off * 100));
    return fmt::format("{} at equal time: {:+.1f} % to {:+.1f} %",
                       ratio.low < 1 && ratio.high > 1
                           ? "no significant difference"
                           : "a difference, but by less than 3.5 standard errors,",
                       (ratio.low - 1) * 100, (ratio.high - 1) * 100);
}

std::string advice_of(const Report& report, const SettingResult& r) {
    const std::string at_equal =
        fmt::format("error {:+.0f} % at equal time", (r.equal_time.value - 1) * 100);
    switch (r.verdict) {
        case Verdict::Suspect:
            return fmt::format(
                "{} must have the same mean and differs by {}: possible bias, please report this",
                r.setting.value, percent(r.difference.bias));
        case Verdict::MostEfficient:
        case Verdict::Better:
            return r.bias > report.settings[0].bias * 1.001
                       ? at_equal + ", with a bias of " + percent(r.bias)
                       : at_equal;
        case Verdict::Cheaper:
            return fmt::format("time {:+.0f} %, the same image", (r.time.value - 1) * 100);
        case Verdict::Worse:
            return at_equal;
        case Verdict::NoDifference:
            return told_apart(r.equal_time);
        case Verdict::Changes:
            if (r.difference.is_same_image)
                return fmt::format("the beauty stays as it is, time {:+.0f} %",
                                   (r.time.value - 1) * 100);
            return fmt::format("changes the image by {}, time {:+.0f} %",
                               r.difference.is_seen
                                   ? percent(r.difference.bias)
                                   : "less than " + percent(r.difference.bias_limit),
                               (r.time.value - 1) * 100);
        default:
            return {};
    }
}

KnobRow row_of(const Report& report, const Knob& knob, const Facts& facts) {
    KnobRow row{.knob = knob.name, .now = {}, .advice = {}};
    if (const auto now = facts.now.find(knob.option); now != facts.now.end()) row.now = now->second;
    const bool is_effect = knob.option == "--effects";
    if (is_effect) row.now = "on";
    row.bias = bias_now(report, knob, row.is_biased);
    row.cost_share = std::max(cost_share(report, knob), 0.0);
    row.next = next_of(report, knob);
    if (row.next == 0) return row;
    const SettingResult& next = report.settings[row.next];
    row.verdict = next.verdict;
    row.buys = next.error - report.settings[0].error;
    row.costs_s = (next.time.value - 1) * report.settings[0].cpu_s;
    row.advice = advice_of(report, next);
    return row;
}

/// Rows by what a reader should do first.
int urgency(const KnobRow& row) {
    switch (row.verdict) {
        case Verdict::MostEfficient:
            return 0;
        case Verdict::Suspect:
            return 1;
        case Verdict::Cheaper:
        case Verdict::Better:
            return 2;
        case Verdict::Now:
            return 3;
        case Verdict::Changes:
            return 5;
        case Verdict::Unknown:
            return 6;
        default:
            return 4;
    }
}

}  // namespace

std::vector<KnobRow> make_rows(const Report& report,
                               const std::vector<Knob>& knobs,
                               const Facts& facts) {
    std::vector<KnobRow> rows = {samples_row(report)};
    for (const Knob& knob : knobs) rows.push_back(row_of(report, knob, facts));
    std::stable_sort(rows.begin(), rows.end(), [&](const KnobRow& a, const KnobRow& b) {
        if (urgency(a) != urgency(b)) return urgency(a) < urgency(b);
        const auto rank = [&](const KnobRow& r) {
            return r.next == 0                     ? 1.0
                   : r.verdict == Verdict::Changes ? r.costs_s
                                                   : report.settings[r.next].equal_time.value;
        };
        return rank(a) < rank(b);
    });
    return rows;
}

std::string advised_options(const Report& report, const KnobRow& row) {
    const bool is_advised = row.verdict == Verdict::MostEfficient ||
                            row.verdict == Verdict::Better || row.verdict == Verdict::Cheaper;
    return is_advised ? report.settings[row.next].setting.options : std::string();
}

std::string percent(double value) {
    const double p = value * 100;
    if (p == 0) return "0 %";
    return std::abs(p) < 0.001 ? fmt::format("{:.1e} %", p) : fmt::format("{:.3g} %", p);
}

std::string points(double value) {
    return fmt::format("{:+.2g} pp", value * 100);
}

std::string duration(double seconds) {
    const double s = std::abs(seconds);
    if (s < 120) return fmt::format("{:.3g} s", seconds);
    return s < 7200 ? fmt::format("{:.3g} min", seconds / 60)
                    : fmt::format("{:.3g} h", seconds / 3600);
}

std::string signed_duration(double seconds) {
    return (seconds < 0 ? "" : "+") + duration(seconds);
}

RowText text_of(const Report& report, const KnobRow& row) {
    RowText t;
    t.knob = row.knob;
    t.now = row.now.empty() ? "default" : row.now;
    const bool is_samples = row.knob == samples_knob;
    const bool has_exact = row.bias > 0 || row.is_biased;
    t.leaves = is_samples      ? percent(report.noise.value) + " noise"
               : !has_exact    ? "none"
               : row.is_biased ? percent(row.bias) + " bias"
                               : "none seen, < " + percent(row.bias);
    const bool is_cut = row.knob == "dicing rate" || row.knob == "subdivision level";
    if (is_cut) t.leaves += fmt::format(", outlines {:.2g} px", report.settings[0].outline_px);
    t.cost = percent(std::round(row.cost_share * 1000) / 1000);
    t.verdict = text_of(row.verdict);
    t.advice = row.advice;
    if (row.next == 0 && !(is_samples && row.costs_s > 0)) {
        t.next = t.buys = t.costs = "-";
        return t;
    }
    t.next = is_samples ? fmt::format("{}", 2 * report.subject.spp)
             : report.settings[row.next].setting.options.starts_with("--effects")
                 ? "off"
                 : report.settings[row.next].setting.value;
    t.buys = row.verdict == Verdict::Changes ? "-" : points(row.buys);
    t.costs = signed_duration(row.costs_s);
    return t;
}

std::string to_text(const Report& report) {
    std::string text = fmt::format(
        "ERROR {} = noise {} [{}, {}] + bias {}; {} of CPU time at {} samples per pixel\n",
        percent(report.error), percent(report.noise.value), percent(report.noise.low),
        percent(report.noise.high), percent(report.bias), duration(report.settings[0].cpu_s),
        report.subject.spp);
    const auto line = [&text](const RowText& t) {
        text += fmt::format("{:20} {:16} {:22} {:9} {:16} {:10} {:10} {:22} {}\n", t.knob, t.now,
                            t.leaves, t.cost, t.next, t.buys, t.costs, t.verdict, t.advice);
    };
    line({"KNOB", "NOW", "ERROR IT LEAVES", "COST NOW", "NEXT VALUE", "BUYS", "COSTS", "VERDICT",
          ""});
    for (const KnobRow& row : report.rows) line(text_of(report, row));
    return text;
}

}  // namespace velatura::study
