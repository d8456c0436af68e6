// SPDX-License-Identifier: Apache-2.0
#include "layers/stated_stats.h"

#include "accumulate/pixel_means.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace velatura::layers {

using Json = nlohmann::ordered_json;

namespace {

/// By the sampler that the statistics name and whether the sums have halves.
statistics::PointRelations relations_of(const std::string& sampler, bool has_halves) {
    return {.has_independent_halves = has_halves || sampler == "independent",
            .has_dependent_changes = !has_halves && sampler == "stratified"};
}

/// Of an error as error_json() has it.
statistics::HiddenLight hidden_of(const Json& error) {
    statistics::HiddenLight light;
    if (!error.is_object() || !error.contains("hidden")) return light;
    const Json& j = error["hidden"];
    const auto number = [&](const char* name) {
        return j.is_object() && j.contains(name) && j[name].is_number() ? j[name].get<double>()
                                                                        : 0.0;
    };
    return {number("square"), number("fourth")};
}

std::string text_at(const Json& j, const char* name) {
    return j.is_object() && j.contains(name) && j[name].is_string() ? j[name].get<std::string>()
                                                                    : std::string();
}

}  // namespace

Json error_json(const std::optional<statistics::StatedError>& error) {
    Json j;
    j["metric"] = "sqrt(relMSE)";
    if (!error) return j;
    j["mean"] = error->error.value;
    j["low"] = error->error.low;
    j["high"] = error->error.high;
    j["confidence"] = 0.95;
    j["is_upper"] = error->is_upper;
    j["is_lower"] = error->is_lower;
    if (error->error.is_lower) j["half_in_pixels"] = error->error.half_in;
    if (error->hidden.square > 0)
        j["hidden"] = {{"square", error->hidden.square},
                       {"fourth", error->hidden.fourth},
                       {"is_lower", error->is_hidden}};
    return j;
}

bool is_error_hidden(const std::string& stats_json) {
    const Json stats = Json::parse(stats_json, nullptr, false);
    const Json::json_pointer at("/error/hidden/is_lower");
    return stats.is_object() && stats.contains(at) && stats[at].is_boolean() &&
           stats[at].get<bool>();
}

Json clamp_entry(const Json& limits, const accumulate::SampleSums& sums) {
    const double share = accumulate::clamped_share(sums);
    return {{"approximation", "clamp"},
            {"value", limits},
            {"kind", "bias"},
            {"removed_share", share},
            {"effect",
             fmt::format("{:.3g} % of the light of the image is removed; clamp_ layers store it",
                         100 * share)}};
}

std::string stats_of_whole(const std::string& stats_of_part, const accumulate::SampleSums& sums) {
    Json stats = Json::parse(stats_of_part, nullptr, false);
    if (!stats.is_object()) return stats_of_part;
    const std::string sampler =
        stats.contains("estimator") ? text_at(stats["estimator"], "sampler") : std::string();
    if (!sampler.empty() && stats.contains("error")) {
        statistics::PointRelations points = relations_of(sampler, sums.layer_set().halves);
        points.hidden = hidden_of(stats["error"]);
        stats["error"] = error_json(statistics::stated_error(sums, points));
    }
    if (!stats.contains("ledger") || !stats["ledger"].is_array()) return stats.dump();
    for (Json& entry : stats["ledger"]) {
        const std::string name = text_at(entry, "approximation");
        if (name == "clamp" && entry.contains("value")) entry = clamp_entry(entry["value"], sums);
    }
    return stats.dump();
}

}  // namespace velatura::layers
