// SPDX-License-Identifier: Apache-2.0
#include "app/accuracy.h"

#include "app/exit_codes.h"
#include "app/progress.h"
#include "statistics/block_errors.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace velatura::app {

using statistics::ErrorForecast;
using json = nlohmann::ordered_json;

namespace {

/// Three digits, never more precise than that.
std::string rounded(double samples) {
    const double unit =
        std::pow(10.0, std::max(0.0, std::floor(std::log10(std::max(samples, 1.0))) - 2));
    return fmt::format("{:.0f}", std::round(samples / unit) * unit);
}

std::string percent(double fraction) {
    return fmt::format("{:.3g} %", 100 * fraction);
}

const char* state_name(ErrorForecast::Kind kind) {
    switch (kind) {
        case ErrorForecast::Kind::Reached:
            return "reached";
        case ErrorForecast::Kind::Known:
            return "forecast";
        case ErrorForecast::Kind::Rare:
            return "rare-light";
        case ErrorForecast::Kind::TooFar:
            break;
    }
    return "too-far";
}

}  // namespace

std::optional<ImageError> image_error(const RenderJob& job, const film::Film& film) {
    const integrator::RenderOptions& schedule = job.settings.schedule;
    return statistics::stated_error(
        film.sums(),
        {schedule.has_independent_halves, schedule.has_dependent_changes, film.hidden_light()});
}

std::optional<ImageError> image_error(const RenderJob& job,
                                      const film::Film& film,
                                      const film::NoiseEstimate& noise,
                                      const statistics::ErrorCurve& curve) {
    // What velatura-comp noise reports of the file: halves judge few bright pixels themselves
    const auto with_hidden = [&](ImageError error) {
        error.add_hidden(film.hidden_light(), noise.samples_mean,
                         double(film.window().pixel_count()));
        return error;
    };
    if (job.settings.schedule.has_independent_halves && noise.is_known)
        return with_hidden(
            {.error = noise.error, .is_lower = noise.error.is_lower || curve.is_rare()});
    if (!curve.is_empty())
        return with_hidden({curve.error_at(noise.samples_mean),
                            job.settings.schedule.has_dependent_changes, curve.is_lower()});
    return image_error(job, film);
}

std::string reached_text(const std::optional<ImageError>& error) {
    if (!error) return "not estimated yet";
    if (error->is_lower) return fmt::format("{:.3g} % or more", error->error.value * 100.0);
    return fmt::format("{:.3g} %, up to {:.3g} %", error->error.value * 100.0,
                       error->error.high * 100.0);
}

BudgetOutcome budget_outcome(const RenderJob& job,
                             const std::optional<ImageError>& error,
                             const integrator::RenderResult& result) {
    const RenderArguments& a = job.arguments;
    const double target = job.settings.schedule.target_error;
    const bool is_out_of_time = result.reason == integrator::StopReason::TimeBudget;
    const bool is_sure = error && !error->is_lower;
    const bool is_exact = result.reason == integrator::StopReason::TargetError ||
                          (is_sure && error->error.value <= target);
    // Without a target error the samples are the target
    const bool is_reached =
        target > 0 ? is_exact && (is_sure || !a.requires_target) : !is_out_of_time;
    BudgetOutcome outcome;
    if (is_reached) return outcome;
    outcome.is_missed = target > 0 || !job.settings.schedule.is_open_ended;
    if (is_out_of_time)
        outcome.text = fmt::format("stopped at --time {}", a.time);
    else if (is_exact)
        outcome.text = fmt::format("stopped at --target-error {}", a.target_error);
    else if (job.settings.schedule.is_open_ended)
        outcome.text = "stopped at the maximum samples without --spp";
    else
        outcome.text = a.samples.empty()
                           ? fmt::format("stopped at --spp {}", a.spp.value_or(default_spp))
                           : fmt::format("stopped at --samples {}", a.samples);
    if (target > 0 && !is_exact)
        outcome.text += fmt::format(" before --target-error {}", a.target_error);
    else if (outcome.is_missed && is_out_of_time)
        outcome.text +=
            fmt::format(" before all {} samples per pixel", job.settings.schedule.end_sample);
    const bool has_used_budget = is_out_of_time || a.spp || !a.samples.empty();
    if (outcome.is_missed && (a.requires_target || !has_used_budget)) outcome.code = TargetMissed;
    return outcome;
}

json blocks_json(const film::Film& film, const statistics::ErrorCurve& curve) {
    auto blocks = statistics::block_errors(film.sums(), curve.slope().value);
    if (!blocks) return nullptr;
    std::sort(blocks->begin(), blocks->end(),
              [](const statistics::BlockError& a, const statistics::BlockError& b) {
                  return a.relative() > b.relative();
              });
    double all = 0, so_far = 0, uncertain = 0;
    for (const statistics::BlockError& b : *blocks) {
        all += b.relative() * b.relative();
        uncertain += b.is_uncertain();
    }
    size_t half = 0;
    while (half < blocks->size() && so_far < 0.5 * all) {
        so_far += (*blocks)[half].relative() * (*blocks)[half].relative();
        ++half;
    }
    const auto count = double(blocks->size());
    json j = {{"size", statistics::BlockError::size},
              {"half_of_error_in", double(half) / count},
              {"uncertain", uncertain / count},
              {"worst", json::array()}};
    for (size_t i = 0; i < std::min<size_t>(5, blocks->size()); ++i) {
        const statistics::BlockError& b = (*blocks)[i];
        json low = json::array(), high = json::array();
        for (size_t c = 0; c < 3; ++c) {
            low.push_back(b.mean[c] - b.quantile(c) * b.error[c]);
            high.push_back(b.mean[c] + b.quantile(c) * b.error[c]);
        }
        j["worst"].push_back({{"x", b.window.x0},
                              {"y", b.window.y0},
                              {"error", b.relative()},
                              {"mean", b.mean},
                              {"low", low},
                              {"high", high},
                              {"uncertain", b.is_uncertain()}});
    }
    return j;
}

json layer_noise_json(const std::vector<statistics::LayerNoise>& layers, double image_error) {
    json j = json::array();
    for (const statistics::LayerNoise& layer : layers) {
        json one = {{"name", layer.layer}, {"error", layer.error}};
        if (image_error > 0) one["share"] = layer.error * layer.error / (image_error * image_error);
        j.push_back(std::move(one));
    }
    return j;
}

json error_curve_json(const statistics::ErrorCurve& curve) {
    json j = json::array();
    for (const statistics::ErrorPoint& p : curve.points())
        j.push_back({{"spp", p.samples_mean},
                     {"time_s", p.time_s},
                     {"error", p.error.value},
                     {"low", p.error.low},
                     {"high", p.error.high}});
    return j;
}

json observations_json(const statistics::ErrorCurve& curve) {
    json j = json::array();
    for (const statistics::ErrorObservation& o : curve.observations())
        j.push_back({{"min", o.samples_min},
                     {"max", o.samples_max},
                     {"mean", o.samples_mean},
                     {"change", o.change.value},
                     {"low", o.change.low},
                     {"high", o.change.high},
                     {"half_in", o.change.half_in},
                     {"is_lower", o.change.is_lower}});
    return j;
}

std::optional<statistics::ErrorCurve> curve_of(const json& observations) {
    statistics::ErrorCurve curve;
    if (!observations.is_array()) return std::nullopt;
    double last_mean = 0;
    for (const json& j : observations) {
        if (!j.is_object()) return std::nullopt;
        for (const char* name : {"min", "max", "mean", "change", "low", "high"})
            if (!j.contains(name) || !j[name].is_number()) return std::nullopt;
        if (!j["min"].is_number_unsigned() || !j["max"].is_number_unsigned()) return std::nullopt;
        if (!j.contains("half_in") || !j["half_in"].is_number_unsigned() ||
            !j.contains("is_lower") || !j["is_lower"].is_boolean())
            return std::nullopt;
        const auto number = [&j](const char* name) { return j[name].get<double>(); };
        if (!(number("change") > 0) || !(number("high") >= number("change")) ||
            !(number("mean") > last_mean))
            return std::nullopt;
        last_mean = number("mean");
        curve.add({j["min"].get<uint64_t>(),
                   j["max"].get<uint64_t>(),
                   number("mean"),
                   0,
                   {number("change"), number("low"), number("high"), j["half_in"].get<size_t>(),
                    j["is_lower"].get<bool>()}});
    }
    return curve;
}

json slope_json(const statistics::ErrorCurve& curve) {
    const statistics::ErrorSlope slope = curve.slope();
    return {{"value", -slope.value}, {"deviation", slope.deviation}};
}

json forecast_json(const ErrorForecast& f) {
    json j;
    j["target"] = f.target;
    j["state"] = state_name(f.kind);
    j["is_lower"] = f.is_lower;
    if (f.kind != ErrorForecast::Kind::Known) return j;
    j["spp"] = f.samples;
    j["spp_low"] = f.samples_low;
    j["spp_high"] = f.samples_high;
    j["time_s"] = f.time_s;
    j["time_low_s"] = f.time_low_s;
    j["time_high_s"] = f.time_high_s;
    return j;
}

double wanted_error(const RenderJob& job) {
    return job.settings.schedule.forecast_error > 0 ? job.settings.schedule.forecast_error
                                                    : job.settings.schedule.target_error;
}

std::string forecast_text(const statistics::ErrorCurve& curve, double samples_mean, double target) {
    const ErrorForecast f = curve.forecast(target);
    const std::string reached =
        fmt::format("{} spp reached {}{}", rounded(samples_mean),
                    percent(curve.error_at(samples_mean).value), f.is_lower ? " or more" : "");
    if (f.kind == ErrorForecast::Kind::Reached ||
        (f.kind == ErrorForecast::Kind::Known && f.samples <= 1.01 * samples_mean))
        return fmt::format("{}, target {}", reached, percent(target));
    if (f.kind == ErrorForecast::Kind::Rare)
        return fmt::format(
            "{}; no forecast: the error does not fall with more samples, because paths rarely "
            "reach some light",
            reached);
    if (f.kind == ErrorForecast::Kind::TooFar)
        return fmt::format(
            "{}; {} needs more than {:g} times these samples, beyond the range of a forecast",
            reached, percent(target), statistics::ErrorCurve::farthest);
    // Of what is a lower bound the intervals are of no use
    if (f.is_lower)
        return fmt::format("{}; {} needs {} spp or more, {}", reached, percent(target),
                           rounded(f.samples), format_duration(f.time_s));
    return fmt::format("{}; {} needs about {} spp ({} to {}), {} ({} to {})", reached,
                       percent(target), rounded(f.samples), rounded(f.samples_low),
                       rounded(f.samples_high), format_duration(f.time_s),
                       format_duration(f.time_low_s), format_duration(f.time_high_s));
}

std::string short_forecast(const ErrorForecast& f) {
    switch (f.kind) {
        case ErrorForecast::Kind::Reached:
            return fmt::format("{} reached", percent(f.target));
        case ErrorForecast::Kind::TooFar:
            return fmt::format("{} is far", percent(f.target));
        case ErrorForecast::Kind::Rare:
            return "rare light";
        case ErrorForecast::Kind::Known:
            break;
    }
    return fmt::format("{} at {}{} spp, {}", percent(f.target), f.is_lower ? ">" : "",
                       rounded(f.samples), format_duration(f.time_s));
}

}  // namespace velatura::app
