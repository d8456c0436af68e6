// SPDX-License-Identifier: Apache-2.0
#include "app/render_frame.h"

#include "app/exit_codes.h"
#include "app/frame_renderer.h"
#include "app/stop_signals.h"

#include <memory>

namespace velatura::app {

int render_frame(const RenderJob& job, const FrameInput& input, Diagnostics& diagnostics) {
    const FrameControl control{.stop = &StopSignals::stop_flag(), .snapshot_requested = [] {
                                   return StopSignals::take_snapshot_request();
                               }};
    std::unique_ptr<FrameRenderer> renderer;
    int code = FrameRenderer::make(job, input, control, diagnostics, renderer);
    if (code == Done) code = renderer->prepare();
    if (code != Done) return code;
    if (job.replay) return renderer->replay();
    renderer->render();
    return renderer->finish();
}

}  // namespace velatura::app
