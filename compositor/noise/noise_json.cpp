// SPDX-License-Identifier: Apache-2.0
#include "compositor/noise/noise_json.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <vector>

namespace velatura::compositor::noise {

namespace {

nlohmann::ordered_json json_of(const statistics::RelativeError& error) {
    return {{"value", error.value},
            {"low", error.low},
            {"high", error.high},
            {"isLower", error.is_lower}};
}

nlohmann::ordered_json json_of(const std::vector<RowNoise>& rows) {
    auto j = nlohmann::ordered_json::array();
    for (const RowNoise& row : rows) j.push_back({{"name", row.name}, {"share", row.share}});
    return j;
}

}  // namespace

double mean_samples(const LayerStack& stack) {
    const layers::SampleInfo& s = stack.header().samples;
    const image::Channel* counts = stack.image().find("sampleCount");
    if (!counts || counts->size() == 0) return double(s.end - s.first);
    double sum = 0;
    image::for_each_value(*counts, [&](size_t, float n) { sum += double(n); });
    return sum / double(counts->size());
}

nlohmann::ordered_json noise_json(const NoiseForecast& f,
                                  double samples,
                                  std::optional<double> seconds,
                                  std::optional<int> frame) {
    nlohmann::ordered_json j;
    j["schema"] = "velatura.noise/1";
    if (frame) j["frame"] = *frame;
    j["rendered"] = json_of(f.rendered);
    j["mix"] = json_of(f.mix);
    j["storage"] = f.error.storage;
    const NoiseAdvice& a = f.advice;
    auto& advice = j["advice"];
    advice["target"] = a.target;
    advice["sampleFactor"] = a.sample_factor;
    advice["samples"] = std::ceil(a.sample_factor * samples);
    if (seconds) advice["seconds"] = a.sample_factor * *seconds;
    advice["caps"] = nlohmann::ordered_json::array();
    for (const ControlCap& cap : a.caps) {
        const bool is_gain = cap.control.kind == Control::Kind::Gain;
        advice["caps"].push_back(
            {{"do", is_gain ? "gain" : "shadow"},
             {"name", cap.control.target},
             {"most", cap.max ? nlohmann::ordered_json(*cap.max) : nlohmann::ordered_json()}});
    }
    j["groups"] = json_of(f.groups);
    j["bounces"] = json_of(f.bounces);
    if (!f.lobes.empty()) j["lobes"] = json_of(f.lobes);
    j["shadows"] = json_of(f.shadows);
    return j;
}

}  // namespace velatura::compositor::noise
