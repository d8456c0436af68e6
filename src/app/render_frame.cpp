// SPDX-License-Identifier: Apache-2.0
#include "app/render_frame.h"

#include "app/accuracy.h"
#include "app/exit_codes.h"
#include "app/frame_settings.h"
#include "app/frame_writer.h"
#include "app/memory_needs.h"
#include "app/output_files.h"
#include "app/render_progress.h"
#include "app/render_report.h"
#include "app/render_settings.h"
#include "app/replay.h"
#include "app/resume.h"
#include "app/stats.h"
#include "app/stop_signals.h"
#include "base/output_lock.h"
#include "base/process/memory_limit.h"
#include "render/renderer.h"

#include <fmt/format.h>

#include <atomic>
#include <optional>
#include <string>
#include <utility>

namespace velatura::app {

namespace {

class FrameRenderer {
  public:
    FrameRenderer(const RenderJob& job,
                  const FrameInput& input,
                  FrameFacts facts,
                  Continuation from,
                  Diagnostics& diagnostics)
        : job_(job),
          input_(input),
          diagnostics_(diagnostics),
          from_(std::move(from)),
          facts_(std::move(facts)),
          renderer_(input.scene, from_.applied_to(render_settings(job, input))),
          progress_(job) {}

    int run() {
        renderer_.build(diagnostics_);
        const shading::TextureCache& textures = renderer_.world().materials.textures();
        const MemoryNeeds needs =
            allot_memory(job_, input_, textures,
                         from_.earlier ? from_.earlier->sums.memory_bytes() : 0, diagnostics_);
        const int refused =
            reject_frame(job_, needs, unread_textures(renderer_.world()), diagnostics_);
        if (refused != Done) return refused;
        renderer_.learn(&StopSignals::stop_flag());
        if (job_.replay) {
            if (renderer_.light_tracer())
                diagnostics_.warn("caustics", {}, {},
                                  "--replay traces the camera path alone; the sample also has "
                                  "caustics by light tracing");
            return replay_sample(renderer_.tracer(), renderer_.layers(), input_.scene,
                                 *job_.replay);
        }
        if (const int code = check_what_was_learned(); code != Done) return code;
        MemoryWatch memory(textures, needs.writing);
        facts_.part = unfinished_part();
        FrameWriter writer(job_, input_, renderer_, facts_, memory);
        const std::optional<integrator::TopUpCounts> top_up = start_film();
        MemoryLimit::watch();  // pixels take memory tile by tile
        const integrator::RenderResult result =
            renderer_.advance(callbacks(writer, memory), top_up ? &*top_up : nullptr);
        const film::NoiseEstimate noise = renderer_.film().noise();
        if (!memory.keeps_limit()) is_short_of_memory_ = true;
        progress_.finish(renderer_.film(), noise, result);
        report_bad_samples(renderer_.film(), result, diagnostics_);
        return finish(writer, needs, noise, result);
    }

  private:
    /// Whether paths are guided is known only now. Returns: an exit code.
    int check_what_was_learned() {
        facts_.settings.emplace_back("--guiding", renderer_.prepass().guide.is_used ? "on" : "off");
        // What was learned is not whole then: neither pixels nor a header may come from it
        if (StopSignals::stop_flag())
            return report_early_end(false, "the first sample", diagnostics_);
        report_prepass(job_, renderer_, diagnostics_);
        const std::string why = from_.difference(
            facts_.settings, settings_hash(facts_.settings, renderer_.layers(), renderer_.window()),
            job_);
        if (!why.empty()) return reject_resume(input_.output, why, diagnostics_);
        return Done;
    }

    /// Without samples: pixels begin where their rates say.
    accumulate::SampleSums sums_with_rates() const {
        const image::Window w = renderer_.window();
        accumulate::SampleSums sums(w, renderer_.layers());
        for (int y = w.y0; y < w.y1; ++y)
            for (int x = w.x0; x < w.x1; ++x)
                sums.set_rate(x, y, from_.rates->rates[w.index(x, y)]);
        return sums;
    }

    PartState unfinished_part() const {
        const integrator::RenderOptions& schedule = job_.settings.schedule;
        PartState part{schedule.first_sample, schedule.end_sample, false};
        if (schedule.is_open_ended) part.end.reset();
        return part;
    }

    /// Returns: the counts that a request asks for, from what the film has.
    std::optional<integrator::TopUpCounts> start_film() {
        if (from_.earlier) {
            facts_.top_ups = from_.earlier->state.top_ups;
            renderer_.start_film(std::move(from_.earlier->sums), std::move(from_.earlier->bad));
        } else if (from_.rates) {
            renderer_.start_film(sums_with_rates(), {});
        } else {
            // A file that can be merged or gone on from needs every node of the sums, also those
            // that the image alone would fold early
            const bool needs_all = keeps_sums(job_) || job_.settings.schedule.is_open_ended;
            renderer_.start_film(
                {.final_sample_end =
                     needs_all ? 0 : integrator::max_samples(job_.settings.schedule)});
        }
        if (!from_.request) return std::nullopt;
        const uint64_t end = job_.settings.schedule.end_sample;
        facts_.top_ups = with_request(facts_.top_ups, *from_.request, end);
        return integrator::TopUpCounts(
            renderer_.film(),
            layers::place_samples(renderer_.window(), from_.request->priority,
                                  from_.request->present, double(end)),
            end);
    }

    integrator::RenderCallbacks callbacks(FrameWriter& writer, MemoryWatch& memory) {
        integrator::RenderCallbacks callbacks;
        callbacks.progress = [&](const integrator::RenderState& state) {
            if (!memory.keeps_limit()) is_short_of_memory_ = true;
            progress_.show(state);
        };
        callbacks.snapshot = [&](const film::Film&, const statistics::ErrorCurve& curve) {
            writer.write_snapshot(curve, diagnostics_);
        };
        callbacks.snapshot_requested = [] { return StopSignals::take_snapshot_request(); };
        callbacks.stop = &StopSignals::stop_flag();
        callbacks.give_up = &is_short_of_memory_;
        return callbacks;
    }

    int finish(FrameWriter& writer,
               const MemoryNeeds& needs,
               const film::NoiseEstimate& noise,
               const integrator::RenderResult& result) {
        const bool is_stopped = result.reason == integrator::StopReason::Interrupted;
        // A file to go on from may have holes
        const uint64_t fewest = keeps_sums(job_) ? noise.samples_max : noise.samples_min;
        if (is_stopped && fewest == 0)
            return report_early_end(
                is_short_of_memory_,
                keeps_sums(job_) ? "any pixel had a sample" : "every pixel had a sample",
                diagnostics_);
        if (!is_stopped) {
            facts_.part = from_.part_of(job_, result);
            writer.set_finished();
        }
        const std::vector<scene::Effect> broken =
            integrator::broken_promises(input_.plan, result.rays.effects);
        int code = Done;
        const auto written = writer.write_or_rescue(result.curve, broken, code, diagnostics_);
        if (!written) return code;
        if (!writer.write_deep(diagnostics_)) return RenderError;
        if (!writer.write_stats(needs, noise, result, *written, diagnostics_)) return RenderError;
        const std::optional<ImageError> error =
            image_error(job_, renderer_.film(), noise, result.curve);
        const size_t unread = unread_textures(renderer_.world());
        if (!job_.arguments.quiet)
            print_summary(job_, input_.output, *written, unread, noise, result);
        warn_of_lower_bound(error, !result.curve.is_empty() && result.curve.is_rare(), renderer_,
                            diagnostics_);
        if (is_stopped && is_short_of_memory_) {
            warn_of_memory(job_, needs, noise, diagnostics_);
            return TargetMissed;
        }
        if (is_stopped) return SignalBase + StopSignals::signal_number();
        if (report_missing_textures(job_, input_.output, unread, diagnostics_)) return RenderError;
        report_broken_plan(broken, result, diagnostics_);
        if (!broken.empty() || result.rays.tracking.violations > 0 ||
            (job_.arguments.strict && renderer_.film().invalid_count() > 0))
            return CheckFailed;
        return report_budget(job_, noise, result, error, diagnostics_);
    }

    const RenderJob& job_;
    const FrameInput& input_;
    Diagnostics& diagnostics_;
    Continuation from_;  ///< its sums move into the film
    FrameFacts facts_;
    render::Renderer renderer_;
    RenderProgress progress_;
    std::atomic<bool> is_short_of_memory_ = false;
};

}  // namespace

int render_frame(const RenderJob& job, const FrameInput& input, Diagnostics& diagnostics) {
    if (data_window(input.scene.settings, job.arguments.crop).is_empty()) {
        diagnostics.error("empty-window", {}, {},
                          "the crop or data window contains no pixel center");
        return UsageError;
    }
    if (job.replay) return FrameRenderer(job, input, {}, {}, diagnostics).run();
    std::optional<OutputLock> lock;
    if (const int code = take_output(input.output, lock, diagnostics); code != Done) return code;
    FrameFacts facts;
    facts.files = scene_files(input.scene);
    facts.settings = frame_settings(job, input, facts.files);
    // That has read all files of the scene
    if (const Result<void> ok = check_outputs(input); !ok) {
        diagnostics.error(ok.error().code, {}, {}, ok.error().message);
        return UsageError;
    }
    Continuation from = find_continuation(job, input, facts.settings, diagnostics);
    if (from.code != Done) return from.code;
    RenderJob wanted = job;
    if (const auto end = from.end_sample(job)) wanted.settings.schedule.end_sample = *end;
    return FrameRenderer(wanted, input, std::move(facts), std::move(from), diagnostics).run();
}

}  // namespace velatura::app
