// SPDX-License-Identifier: Apache-2.0
#include "integrator/render_progress.h"

#include <algorithm>

namespace velatura::integrator {

RenderProgress::RenderProgress(const film::Film& film,
                               const RenderOptions& options,
                               const RenderCallbacks& callbacks)
    : callbacks_(callbacks),
      options_(options),
      pixels_(double(film.window().pixel_count())),
      samples_total_(pixels_ * double(options.end_sample - options.first_sample)),
      start_(Clock::now()) {
    const film::Window& w = film.window();
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x)
            samples_ += double(film.next_sample(x, y) - film.sums().record(x, y).first);
    }
    samples_before_ = samples_;
}

void RenderProgress::add(double samples, double pilot, const RayCounts& counts) {
    std::lock_guard lock(mutex_);
    samples_ += samples;
    pilot_done_ += pilot;
    rays_ += counts;
    rate_.add(elapsed_s(), work());
    report();
}

void RenderProgress::set_error(double error,
                               bool is_upper,
                               bool is_lower,
                               std::optional<statistics::ErrorForecast> forecast) {
    std::lock_guard lock(mutex_);
    error_ = error;
    is_upper_error_ = is_upper;
    is_lower_error_ = is_lower;
    forecast_ = forecast;
    report();
}

double RenderProgress::elapsed_s() const {
    return std::chrono::duration<double>(Clock::now() - start_).count();
}

std::optional<double> RenderProgress::expected_work() const {
    std::optional<double> samples;
    if (!options_.is_open_ended) samples = samples_total_;
    if (options_.target_error > 0 && forecast_ && forecast_->target == options_.target_error) {
        if (forecast_->kind == statistics::ErrorForecast::Kind::Known)
            samples = std::min(samples_total_, forecast_->samples * pixels_);
        if (forecast_->kind == statistics::ErrorForecast::Kind::Reached) samples = samples_;
    }
    if (!samples) return std::nullopt;
    return std::max(*samples, samples_) - samples_before_ + pilot_total_;
}

void RenderProgress::report() {
    if (!callbacks_.progress) return;
    RenderState state;
    state.samples_per_pixel = samples_ / pixels_;
    state.elapsed_s = elapsed_s();
    if (const std::optional<double> all = expected_work()) {
        // What the film came with counts as done, but says nothing of the time
        const double done = samples_before_ + work();
        fraction_ = std::max(fraction_, std::min(1.0, done / (samples_before_ + *all)));
        state.left_s = rate_.seconds_for(*all - work(), 0.25 * pixels_);
    }
    if (options_.time_budget_s > 0) {
        const double left_s = std::max(0.0, options_.time_budget_s - state.elapsed_s);
        fraction_ = std::max(fraction_, std::min(1.0, state.elapsed_s / options_.time_budget_s));
        state.left_s = std::min(state.left_s.value_or(left_s), left_s);
    }
    state.fraction = fraction_;
    state.error = error_;
    state.is_upper_error = is_upper_error_;
    state.is_lower_error = is_lower_error_;
    state.forecast = forecast_;
    state.rays = rays_;
    callbacks_.progress(state);
}

}  // namespace velatura::integrator
