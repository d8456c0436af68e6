// SPDX-License-Identifier: Apache-2.0
#include "app/accuracy.h"

#include "app/progress.h"

#include <fmt/format.h>

#include <cmath>

namespace velatura::app {

using integrator::ErrorForecast;
using json = nlohmann::ordered_json;

namespace {

/// Three digits, never more precise than that.
std::string rounded(double samples) {
    const double unit = std::pow(10.0, std::max(0.0, std::floor(std::log10(std::max(samples, 1.0))) - 2));
    return fmt::format("{:.0f}", std::round(samples / unit) * unit);
}

std::string percent(double fraction) {
    return fmt::format("{:.3g} %", 100 * fraction);
}

}  // namespace

std::optional<PictureError> picture_error(const RenderJob& job, const film::NoiseEstimate& noise) {
    if (!noise.is_known) return std::nullopt;
    return PictureError{{noise.relative_error, noise.low, noise.high}, !job.schedule.has_independent_halves};
}

std::optional<PictureError> picture_error(const RenderJob& job, const film::NoiseEstimate& noise, const integrator::ErrorCurve& curve) {
    const std::optional<PictureError> halves = picture_error(job, noise);
    if (!halves || curve.is_empty()) return halves;
    return PictureError{curve.error_at(noise.samples_mean), false};
}

json error_json(const std::optional<PictureError>& error) {
    json j;
    j["metric"] = "sqrt(relMSE)";
    if (!error) return j;
    j["mean"] = error->error.value;
    j["low"] = error->error.low;
    j["high"] = error->error.high;
    j["confidence"] = 0.95;
    j["is_upper"] = error->is_upper;
    return j;
}

json error_curve_json(const integrator::ErrorCurve& curve) {
    json j = json::array();
    for (const integrator::ErrorPoint& p : curve.points())
        j.push_back({{"spp", p.samples_mean}, {"time_s", p.time_s}, {"error", p.error.value}, {"low", p.error.low}, {"high", p.error.high}});
    return j;
}

json slope_json(const integrator::ErrorCurve& curve) {
    const integrator::ErrorSlope slope = curve.slope();
    return {{"value", -slope.value}, {"deviation", slope.deviation}};
}

json forecast_json(const ErrorForecast& f) {
    json j;
    j["target"] = f.target;
    j["state"] = f.kind == ErrorForecast::Kind::Reached ? "reached" : f.kind == ErrorForecast::Kind::Known ? "forecast" : "too-far";
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
    return job.schedule.forecast_error > 0 ? job.schedule.forecast_error : job.schedule.target_error;
}

std::string forecast_text(const integrator::ErrorCurve& curve, double target) {
    const integrator::ErrorPoint last = curve.points().back();
    const ErrorForecast f = curve.forecast(target);
    const std::string reached = fmt::format("{} spp reached {}", rounded(last.samples_mean), percent(last.error.value));
    switch (f.kind) {
        case ErrorForecast::Kind::Reached: return fmt::format("{}: no more than {}", reached, percent(target));
        case ErrorForecast::Kind::TooFar: return fmt::format("{}; {} needs more than {:g} times that, further than can be forecast", reached, percent(target), integrator::ErrorCurve::farthest);
        case ErrorForecast::Kind::Known: break;
    }
    return fmt::format("{}; {} needs about {} spp ({} to {}), {} ({} to {})", reached, percent(target), rounded(f.samples), rounded(f.samples_low), rounded(f.samples_high),
                       format_duration(f.time_s), format_duration(f.time_low_s), format_duration(f.time_high_s));
}

std::string short_forecast(const ErrorForecast& f) {
    switch (f.kind) {
        case ErrorForecast::Kind::Reached: return fmt::format("{} reached", percent(f.target));
        case ErrorForecast::Kind::TooFar: return fmt::format("{} is far", percent(f.target));
        case ErrorForecast::Kind::Known: break;
    }
    return fmt::format("{} at {} spp, {}", percent(f.target), rounded(f.samples), format_duration(f.time_s));
}

}  // namespace velatura::app
