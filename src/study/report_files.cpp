// SPDX-License-Identifier: Apache-2.0
#include "study/report.h"
#include "study/rows.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace velatura::study {

namespace {

using json = nlohmann::ordered_json;

json estimate(const Estimate& e) {
    return {{"value", e.value}, {"low", e.low}, {"high", e.high}};
}

const char* name_of(BiasClass bias_class) {
    return bias_class == BiasClass::Unbiased ? "same mean"
           : bias_class == BiasClass::Biased ? "approximates"
                                             : "changes";
}

json setting_json(const SettingResult& r) {
    json j = {{"knob", r.setting.knob},
              {"value", r.setting.value},
              {"options", r.setting.options},
              {"promise", name_of(r.setting.bias_class)},
              {"rounds", r.rounds}};
    if (!r.rejection.empty()) j["refused"] = r.rejection;
    j["verdict"] = text_of(r.verdict);
    j["noise"] = estimate(r.noise);
    j["bias"] = r.bias;
    j["error"] = r.error;
    j["difference"] = {{"same_picture", r.difference.is_same_image},
                       {"seen", r.difference.is_seen},
                       {"bias", r.difference.bias},
                       {"limit", r.difference.bias_limit},
                       {"shift", r.difference.shift},
                       {"shift_se", r.difference.shift_se}};
    j["cpu_s"] = r.cpu_s;
    j["setup_s"] = r.setup_s;
    j["rays_per_sample"] = r.rays_per_sample;
    if (r.outline_px > 0) j["outline_px"] = r.outline_px;
    j["time_ratio"] = estimate(r.time);
    j["error_ratio_at_equal_time"] = estimate(r.equal_time);
    if (r.slope.is_known)
        j["slope"] = {{"value", r.slope.value}, {"standard_error", r.slope.standard_error}};
    j["curve"] = json::array();
    for (const CurvePoint& p : r.curve)
        j["curve"].push_back({{"spp", p.spp}, {"cpu_s", p.cpu_s}, {"noise", estimate(p.noise)}});
    return j;
}

std::string quoted(const std::string& text) {
    std::string out = "\"";
    for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
    return out + "\"";
}

}  // namespace

std::string to_json(const Report& r) {
    json j;
    j["schema"] = "velatura.study/1";
    j["scene"] = r.subject.scene;
    j["options"] = r.subject.options;
    j["resolution"] = {r.subject.width, r.subject.height};
    j["spp"] = r.subject.spp;
    j["seed"] = r.subject.seed;
    j["threads"] = r.subject.threads;
    j["build"] = r.subject.build;
    j["machine"] = r.subject.machine;
    j["date"] = r.subject.date;
    j["grid"] = {r.grid.width, r.grid.height};
    j["rounds"] = r.rounds;
    j["elapsed_s"] = r.elapsed_s;
    j["metric"] = "sqrt(relMSE)";
    j["confidence"] = 0.95;
    j["error"] = r.error;
    j["noise"] = estimate(r.noise);
    j["bias"] = r.bias;
    j["half_rounding"] = r.half_error;
    j["pixels_with_half_of_error"] = r.concentration;
    j["pixels_with_half_of_time"] = r.time_concentration;
    j["rows"] = json::array();
    for (const KnobRow& row : r.rows) {
        const RowText t = text_of(r, row);
        j["rows"].push_back({{"knob", row.knob},
                             {"now", t.now},
                             {"error_left", t.leaves},
                             {"bias", row.bias},
                             {"bias_seen", row.is_biased},
                             {"cost_share", row.cost_share},
                             {"next", t.next},
                             {"buys", row.buys},
                             {"costs_cpu_s", row.costs_s},
                             {"verdict", t.verdict},
                             {"advice", row.advice},
                             {"options", advised_options(r, row)}});
    }
    j["settings"] = json::array();
    for (const SettingResult& s : r.settings) j["settings"].push_back(setting_json(s));
    j["layers"] = json::array();
    for (const LayerRow& l : r.layers)
        j["layers"].push_back({{"by", l.is_bounce ? "bounce" : "light"},
                               {"name", l.name},
                               {"energy", l.energy},
                               {"noise", l.noise}});
    j["files"] = json::array();
    for (const FileFormat& f : r.files)
        j["files"].push_back({{"options", f.options},
                              {"now", f.is_now},
                              {"bytes", f.bytes},
                              {"write_s", f.write_s},
                              {"rounding", f.error}});
    return j.dump(2) + "\n";
}

std::string to_csv(const Report& r) {
    std::string text =
        "knob,value,promise,spp,cpu_s,noise,noise_low,noise_high,bias,time_ratio,error_ratio_at_"
        "equal_time,verdict\n";
    for (const SettingResult& s : r.settings) {
        for (const CurvePoint& p : s.curve) {
            text += fmt::format("{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{}\n",
                                quoted(s.setting.knob), quoted(s.setting.value),
                                name_of(s.setting.bias_class), p.spp, p.cpu_s, p.noise.value,
                                p.noise.low, p.noise.high, s.bias, s.time.value, s.equal_time.value,
                                quoted(text_of(s.verdict)));
        }
    }
    return text;
}

}  // namespace velatura::study
