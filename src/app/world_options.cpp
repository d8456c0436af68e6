// SPDX-License-Identifier: Apache-2.0
#include "app/world_options.h"

#include "app/subdivider_choice.h"
#include "base/memory_limit.h"

#include <algorithm>

namespace velatura::app {

namespace {

/// Pixels times samples times a ray to the next surface and one to a light at each of a few
/// scatterings.
double expected_rays(const RenderJob& job, const scene::RenderSettings& settings) {
    constexpr int usual_depth = 4;
    const int depth =
        job.schedule.max_depth > 0 ? std::min(job.schedule.max_depth, usual_depth) : usual_depth;
    // Of a render that something else ends nobody knows how many there will be
    const double samples = job.is_open_ended
                               ? double(default_spp)
                               : double(job.schedule.end_sample - job.schedule.first_sample);
    return double(settings.width) * double(settings.height) * samples * double(1 + 2 * depth);
}

}  // namespace

integrator::WorldOptions world_options(const RenderJob& job,
                                       const FrameInput& input,
                                       const scene::Scene& scene,
                                       Diagnostics& diagnostics) {
    integrator::WorldOptions options;
    options.forced = input.plan.forced();
    options.width = scene.settings.width;
    options.height = scene.settings.height;
    options.light_selection = job.light_selection;
    options.accelerator = job.accelerator;
    options.bvh_quality = job.bvh_quality;
    options.expected_rays = expected_rays(job, scene.settings);
    options.subdivider = find_subdivider(scene, diagnostics);
    options.dicing = job.dicing;
    options.texture_bias = float(job.arguments.texture_bias);
    // Until it is known what the others need
    if (MemoryLimit::is_set())
        options.texture_bytes = std::min(options.texture_bytes, MemoryLimit::left() / 4);
    options.media.majorants =
        job.arguments.volume_bounds == "one" ? media::Majorants::One : media::Majorants::Bricks;
    options.samples_light_area = job.samples_light_area;
    options.compensate_mis = job.tracer.estimator.light_sampling == integrator::LightSampling::Mis;
    return options;
}

}  // namespace velatura::app
