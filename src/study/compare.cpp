// SPDX-License-Identifier: Apache-2.0
#include "study/compare.h"

#include "base/json_depth.h"
#include "study/rows.h"
#include "study/statistics.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace velatura::study {

namespace {

using json = nlohmann::json;

Result<json> parse(const std::string& text, const char* which) {
    json j = is_json_too_deep(text) ? json() : json::parse(text, nullptr, false);
    if (!j.is_object() || j.value("schema", json()) != "velatura.study/1")
        return Error{"study-json",
                     fmt::format("the {} file is not a report.json of velatura study", which)};
    return j;
}

Estimate estimate(const json& j, const char* name) {
    const json e = j.at(name);
    return {e.at("value"), e.at("low"), e.at("high")};
}

/// Whether two intervals leave room for the same truth.
const char* certainty(const Estimate& a, const Estimate& b) {
    return a.low <= b.high && b.low <= a.high ? "within the intervals" : "differs";
}

std::string line(const std::string& what,
                 const std::string& a,
                 const std::string& b,
                 double ratio,
                 const char* note) {
    return fmt::format("{:44} {:>14} {:>14} {:>9} {}\n", what, a, b,
                       ratio > 0 ? fmt::format("x {:.3g}", ratio) : "-", note);
}

std::string compare(const json& a, const json& b) {
    std::string text = line("", "A", "B", 0, "");
    for (const char* field : {"scene", "build", "date"})
        text += line(field, a.value(field, ""), b.value(field, ""), 0,
                     a.value(field, "") == b.value(field, "") ? "" : "differs");
    const Estimate na = estimate(a, "noise"), nb = estimate(b, "noise");
    const auto ratio = [](double x, double y) { return x > 0 ? y / x : 0.0; };
    text += line("noise", percent(na.value), percent(nb.value), ratio(na.value, nb.value),
                 certainty(na, nb));
    text += line("bias", percent(a.at("bias")), percent(b.at("bias")),
                 ratio(a.at("bias"), b.at("bias")), "");
    const json &base_a = a.at("settings").at(0), &base_b = b.at("settings").at(0);
    const double ta = base_a.at("cpu_s"), tb = base_b.at("cpu_s");
    text +=
        line("CPU time of the image", duration(ta), duration(tb), ratio(ta, tb), "on any machines");
    text += "error at equal time, relative to the render\n";
    for (const json& s : a.at("settings")) {
        for (const json& t : b.at("settings")) {
            if (s.at("knob") != t.at("knob") || s.at("value") != t.at("value") ||
                s.at("knob") == "" || s.at("verdict") == "not estimated yet" ||
                t.at("verdict") == "not estimated yet")
                continue;
            const Estimate ea = estimate(s, "error_ratio_at_equal_time"),
                           eb = estimate(t, "error_ratio_at_equal_time");
            text +=
                line("  " + s.at("options").get<std::string>(), fmt::format("{:.3g}", ea.value),
                     fmt::format("{:.3g}", eb.value), ratio(ea.value, eb.value), certainty(ea, eb));
        }
    }
    return text;
}

}  // namespace

Result<std::string> compare_reports(const std::string& a, const std::string& b) {
    const Result<json> ja = parse(a, "first"), jb = parse(b, "second");
    if (!ja) return ja.error();
    if (!jb) return jb.error();
    try {
        return compare(*ja, *jb);
    } catch (const json::exception& e) {
        return Error{"study-json", fmt::format("a report lacks something: {}", e.what())};
    }
}

}  // namespace velatura::study
