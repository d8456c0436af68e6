// SPDX-License-Identifier: Apache-2.0
#include "app/render_settings.h"

#include "app/frame_settings.h"
#include "app/render_layers.h"
#include "base/process/memory_limit.h"

#include <algorithm>
#include <cstdint>

namespace velatura::app {

namespace {

image::Window traced_window(const RenderJob& job, const FrameInput& input) {
    if (!job.replay) return data_window(input.scene.settings, job.arguments.crop);
    // A pixel outside of the image is refused later
    const scene::RenderSettings& s = input.scene.settings;
    const int x = int(std::min(job.replay->x, uint64_t(s.width - 1))),
              y = int(std::min(job.replay->y, uint64_t(s.height - 1)));
    return {x, y, x + 1, y + 1};
}

}  // namespace

render::Settings render_settings(const RenderJob& job, const FrameInput& input) {
    render::Settings settings = job.settings;
    settings.layers = layers_of(job, input.scene);
    settings.window = traced_window(job, input);
    settings.world.forced = input.plan.forced();
    if (MemoryLimit::is_set())
        settings.world.texture_bytes =
            std::min(settings.world.texture_bytes, MemoryLimit::left() / 4);
    if (job.replay) {
        settings.min_bounce_share.reset();
        settings.firefly_guard.reset();
    }
    return settings;
}

}  // namespace velatura::app
