// SPDX-License-Identifier: Apache-2.0
#include "app/render_progress.h"

#include "app/accuracy.h"
#include "base/process/memory_limit.h"

namespace velatura::app {

void RenderProgress::show(const integrator::RenderState& state, bool is_last) {
    const integrator::RenderOptions& schedule = job_.settings.schedule;
    ProgressState p;
    p.fraction = state.fraction;
    p.samples = state.samples_per_pixel;
    if (!schedule.is_open_ended)
        p.samples_target = double(schedule.end_sample - schedule.first_sample);
    p.elapsed_s = state.elapsed_s;
    p.left_s = state.left_s;
    p.error = state.error;
    p.is_upper_error = state.is_upper_error;
    p.is_lower_error = state.is_lower_error;
    p.forecast = state.forecast;
    p.rays_per_s = state.elapsed_s > 0 ? double(state.rays.total()) / state.elapsed_s : 0.0;
    p.memory_bytes = resident_bytes();
    p.is_last = is_last;
    printer_.show(p);
}

void RenderProgress::finish(const film::Film& film,
                            const film::NoiseEstimate& noise,
                            const integrator::RenderResult& result) {
    integrator::RenderState state;
    const bool is_stopped = result.reason == integrator::StopReason::Interrupted;
    state.fraction = is_stopped ? last_fraction_ : 1.0;
    // When the rest of a stopped render comes is not known
    if (!is_stopped) state.left_s = 0.0;
    state.samples_per_pixel = noise.samples_mean;
    state.elapsed_s = result.seconds;
    state.rays = result.rays;
    if (const std::optional<ImageError> error = image_error(job_, film, noise, result.curve)) {
        state.error = error->error.value;
        state.is_upper_error = error->is_upper;
        state.is_lower_error = error->is_lower;
    }
    if (wanted_error(job_) > 0 && !result.curve.is_empty())
        state.forecast = result.curve.forecast(wanted_error(job_));
    show(state, true);
}

}  // namespace velatura::app
