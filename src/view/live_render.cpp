// SPDX-License-Identifier: Apache-2.0
#include "view/live_render.h"

#include "app/exit_codes.h"
#include "app/prepare_frame.h"
#include "base/frames.h"
#include "view/live_frame.h"

#include <fmt/format.h>

#include <exception>
#include <new>
#include <utility>

namespace velatura::view {

Result<void> check_live_arguments(const app::RenderArguments& a) {
    const std::pair<const char*, bool> unused[] = {{"--checkpoint", !a.checkpoint.empty()},
                                                   {"--snapshot", !a.snapshot.empty()},
                                                   {"--resume", a.resume},
                                                   {"--for-mix", !a.for_mix.empty()},
                                                   {"--samples", !a.samples.empty()},
                                                   {"--replay", !a.replay.empty()},
                                                   {"--paths", !a.paths.empty()},
                                                   {"--stats", !a.stats.empty()},
                                                   {"--display", !a.display.empty()},
                                                   {"--preview", !a.preview.empty()},
                                                   {"--every", !a.every.empty()},
                                                   {"--deep", a.deep},
                                                   {"--time", !a.time.empty()},
                                                   {"--mode tile", a.mode == "tile"},
                                                   {"--progress", a.progress != "bar"}};
    for (const auto& [name, is_given] : unused) {
        if (is_given)
            return Error{"usage",
                         fmt::format("{} has no effect in the live view; remove it", name)};
    }
    if (a.frames.empty() || a.frames == "default") return {};
    const auto frames = parse_frames(a.frames);
    if (frames && frames->size() > 1)
        return Error{"usage", fmt::format("--frames: the live view shows one frame, found {}",
                                          frames->size())};
    return {};
}

LiveRender::LiveRender(app::RenderArguments arguments, std::function<void()> wake)
    : arguments_(std::move(arguments)), control_(std::move(wake)), thread_([this] {
          int code = app::RenderError;
          try {
              code = app::for_each_frame(arguments_, [this](const app::RenderJob& job,
                                                            const app::FrameInput& input,
                                                            Diagnostics& diagnostics) {
                  return LiveFrame(job, input, !arguments_.output.empty(), control_, diagnostics)
                      .run();
              });
          } catch (const std::bad_alloc&) {
              control_.report("out of memory", true);
          } catch (const std::exception& e) {
              control_.report(e.what(), true);
          }
          exit_code_ = code;
          control_.set_status([](LiveStatus& s) { s.phase = LiveStatus::Phase::Ended; });
          control_.wake();
      }) {}

LiveRender::~LiveRender() {
    control_.request([](LiveRequests& r) { r.ends = true; });
}

bool LiveRender::is_settled() const {
    using Phase = LiveStatus::Phase;
    const Phase phase = status().phase;
    if (phase == Phase::Ended) return true;
    return control_.is_waiting() && (phase == Phase::Finished || phase == Phase::Paused);
}

void LiveRender::pause(bool is_paused) {
    control_.request([&](LiveRequests& r) { r.is_paused = is_paused; });
}

void LiveRender::edit(LiveEdits edits) {
    control_.request([&](LiveRequests& r) {
        if (edits.values) r.edits.values = std::move(edits.values);
        if (edits.camera_prim) {
            // The place is that of the prim, unless these edits say another
            r.edits.camera_prim = std::move(edits.camera_prim);
            r.edits.camera.reset();
            r.edits.is_camera_reset = false;
        }
        if (edits.camera || edits.is_camera_reset) {
            r.edits.camera = std::move(edits.camera);
            r.edits.is_camera_reset = edits.is_camera_reset;
        }
        r.edits.is_moving = edits.is_moving;
    });
}

void LiveRender::rest() {
    control_.request([](LiveRequests& r) { r.edits.is_moving = false; });
}

void LiveRender::set_region(const std::optional<image::Window>& region) {
    control_.request([&](LiveRequests& r) {
        r.region = region.value_or(image::Window{0, 0, 0, 0});
    });
}

void LiveRender::pick(const std::array<int, 2>& pixel) {
    control_.request([&](LiveRequests& r) { r.pick = pixel; });
}

void LiveRender::save(const std::string& path) {
    control_.request([&](LiveRequests& r) { r.save_as = path; });
}

}  // namespace velatura::view
