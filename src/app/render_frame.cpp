// SPDX-License-Identifier: Apache-2.0
#include "app/render_frame.h"

#include "app/accuracy.h"
#include "app/exit_codes.h"
#include "app/frame_settings.h"
#include "app/frame_writer.h"
#include "app/memory_needs.h"
#include "app/output_files.h"
#include "app/render_report.h"
#include "app/render_settings.h"
#include "app/replay.h"
#include "app/resume.h"
#include "app/stats.h"
#include "app/stop_signals.h"
#include "base/frames.h"
#include "base/memory_limit.h"
#include "base/output_lock.h"
#include "render/renderer.h"

#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

namespace velatura::app {

namespace {

render::Settings settings_of(const RenderJob& job,
                             const FrameInput& input,
                             const std::optional<EarlierPart>& earlier) {
    render::Settings settings = render_settings(job, input);
    if (!earlier) return settings;
    settings.schedule.curve = earlier->curve;
    // A render that goes on keeps the bounces of its file
    if (std::exchange(settings.least_bounce_share, std::nullopt))
        settings.layers.last_bounce = earlier->sums.layer_set().last_bounce;
    return settings;
}

class FrameRenderer {
  public:
    FrameRenderer(const RenderJob& job,
                  const FrameInput& input,
                  FrameSettings settings,
                  std::optional<EarlierPart> earlier,
                  std::optional<image::TopUpRequest> request,
                  Diagnostics& diagnostics)
        : job_(job),
          input_(input),
          diagnostics_(diagnostics),
          earlier_(std::move(earlier)),
          request_(std::move(request)),
          settings_(std::move(settings)),
          renderer_(input.scene, settings_of(job, input, earlier_)),
          printer_(job.progress) {}

    int run() {
        renderer_.build(diagnostics_);
        const MemoryNeeds needs = allot_memory();
        if (const int code = refuse(needs); code != Done) return code;
        renderer_.learn(&StopSignals::stop_flag());
        if (job_.replay)
            return replay_sample(renderer_.tracer(), renderer_.layers(), input_.scene,
                                 *job_.replay);
        if (const int code = check_what_was_learned(); code != Done) return code;
        MemoryWatch memory(renderer_.world().materials.textures(), needs.writing);
        FrameWriter writer(job_, input_, renderer_, settings_, top_ups_, memory);
        const std::optional<integrator::TopUpCounts> top_up = start_film();
        // Tile by tile
        MemoryLimit::watch();
        const integrator::RenderResult result =
            renderer_.advance(callbacks(writer, memory), top_up ? &*top_up : nullptr);
        const film::NoiseEstimate noise = renderer_.film().noise();
        finish_progress(noise, result, memory);
        report_bad_samples(renderer_.film(), result, diagnostics_);
        return finish(writer, needs, noise, result);
    }

  private:
    /// Of a world that is ready.
    MemoryNeeds allot_memory() const {
        MemoryLimit::enforce(
            "while trial paths were traced, which --guiding off and --splitting off do without");
        const size_t film_bytes = earlier_ ? earlier_->sums.memory_bytes() : 0;
        const shading::TextureCache& textures = renderer_.world().materials.textures();
        MemoryNeeds needs = expected_memory(job_, input_, textures, film_bytes);
        allot_textures(textures, needs);
        if (MemoryLimit::is_set() && needs.total() > MemoryLimit::allowed() &&
            needs.least() <= MemoryLimit::allowed())
            diagnostics_.warn("memory-limit", {}, {},
                              fmt::format("the render may take {}, and --memory-limit is {}: it "
                                          "stops with what it has where it comes near",
                                          needs.text(), format_bytes(MemoryLimit::allowed())));
        return needs;
    }

    bool misses_textures() const {
        return job_.arguments.texture_failure == "error" && unread_textures(renderer_.world()) > 0;
    }

    /// Of a scene that memory does not suffice for, of one with errors, strict, or with pictures
    /// that cannot be read where that is not to be: no picture is made, and no training either; a
    /// replay goes on. Returns: an exit code.
    int refuse(const MemoryNeeds& needs) {
        if (job_.replay) return Done;
        if (MemoryLimit::is_set() && needs.least() > MemoryLimit::allowed()) {
            diagnostics_.error(
                "memory-limit", {}, {},
                fmt::format(
                    "the render would take {}, and --memory-limit is {}: nothing is rendered",
                    needs.text(), format_bytes(MemoryLimit::allowed())));
            return MemoryReached;
        }
        if (job_.arguments.strict && diagnostics_.error_count() > 0)
            diagnostics_.error("strict", {}, {},
                               fmt::format("{} errors and --strict: nothing is rendered",
                                           diagnostics_.error_count()));
        else if (misses_textures())
            diagnostics_.error("texture-failure", {}, {},
                               fmt::format("pictures of {} textures cannot be read and "
                                           "--texture-failure error: nothing is rendered",
                                           unread_textures(renderer_.world())));
        else
            return Done;
        return RenderError;
    }

    /// Returns: an exit code.
    int check_what_was_learned() {
        settings_.emplace_back("--guiding", renderer_.learned().guide.is_used ? "on" : "off");
        if (StopSignals::stop_flag()) {
            // What was learned before the first sample is not whole: neither pixels nor a header
            // may come from it
            diagnostics_.error("interrupted", {}, {},
                               "stopped before the first sample; nothing was written");
            return SignalBase + StopSignals::signal_number();
        }
        note_what_was_learned(job_, renderer_, diagnostics_);
        if (earlier_) {
            // Whether paths are guided is known only now
            const std::string why = difference(*earlier_, settings_);
            if (!why.empty()) return refuse_to_resume(input_.output, why, diagnostics_);
        }
        if (renderer_.caustics() && renderer_.caustics()->is_empty())
            diagnostics_.note("caustics", {}, {},
                              "caustics are left to the paths: there is no smooth mirror or glass, "
                              "or no light that is wanted to shine through it");
        if (request_ && request_->settings_hash !=
                            settings_hash(settings_, renderer_.layers(), renderer_.window()))
            return refuse_to_resume(
                input_.output,
                fmt::format("{} was made for a render of other settings", job_.arguments.for_mix),
                diagnostics_);
        return Done;
    }

    /// Returns: the counts that a request asks for, from what the film has.
    std::optional<integrator::TopUpCounts> start_film() {
        if (earlier_) {
            top_ups_ = earlier_->top_ups;
            renderer_.start_film(std::move(earlier_->sums), std::move(earlier_->bad));
        } else {
            // A file that can be merged or gone on from needs every node of the sums, also those
            // that the picture alone would fold early
            const bool needs_all = keeps_sums(job_) || job_.settings.schedule.is_open_ended;
            renderer_.start_film(
                {.final_sample_end =
                     needs_all ? 0 : integrator::most_samples(job_.settings.schedule)});
        }
        if (!request_) return std::nullopt;
        const uint64_t end = job_.settings.schedule.end_sample;
        top_ups_ = with_request(top_ups_, *request_, end);
        return integrator::TopUpCounts(renderer_.film(),
                                       image::place_samples(renderer_.window(), request_->priority,
                                                            request_->present, double(end)),
                                       end);
    }

    integrator::RenderCallbacks callbacks(FrameWriter& writer, MemoryWatch& memory) {
        integrator::RenderCallbacks callbacks;
        callbacks.progress = [&](const integrator::RenderState& state) {
            if (!memory.keeps_limit()) is_short_of_memory_ = true;
            show(state, false);
        };
        callbacks.snapshot = [&](const film::Film&, const integrator::ErrorCurve& curve) {
            const Result<image::WriteReport> written = writer.write_interim(curve);
            if (!written)
                diagnostics_.warn(
                    "snapshot", {}, {},
                    fmt::format("no {}: {}", keeps_sums(job_) ? "checkpoint" : "interim picture",
                                written.error().message));
        };
        callbacks.snapshot_requested = [] { return StopSignals::take_snapshot_request(); };
        callbacks.stop = &StopSignals::stop_flag();
        callbacks.give_up = &is_short_of_memory_;
        return callbacks;
    }

    void show(const integrator::RenderState& state, bool is_last) {
        const integrator::RenderOptions& schedule = job_.settings.schedule;
        ProgressState p;
        p.fraction = is_last ? 1.0 : state.fraction;
        p.samples = state.samples_per_pixel;
        if (!schedule.is_open_ended)
            p.samples_target = double(schedule.end_sample - schedule.first_sample);
        p.elapsed_s = state.elapsed_s;
        p.left_s = is_last ? std::optional<double>(0.0) : state.left_s;
        p.error = state.error;
        p.is_upper_error = state.is_upper_error;
        p.is_lower_error = state.is_lower_error;
        p.forecast = state.forecast;
        p.rays_per_s = state.elapsed_s > 0 ? double(state.rays.total()) / state.elapsed_s : 0.0;
        p.memory_bytes = resident_bytes();
        p.is_last = is_last;
        printer_.show(p);
    }

    void finish_progress(const film::NoiseEstimate& noise,
                         const integrator::RenderResult& result,
                         MemoryWatch& memory) {
        integrator::RenderState state;
        state.samples_per_pixel = noise.samples_mean;
        state.elapsed_s = result.seconds;
        state.rays = result.rays;
        if (const std::optional<PictureError> error =
                picture_error(job_, renderer_.film(), noise, result.curve)) {
            state.error = error->error.value;
            state.is_upper_error = error->is_upper;
            state.is_lower_error = error->is_lower;
        }
        if (wanted_error(job_) > 0 && !result.curve.is_empty())
            state.forecast = result.curve.forecast(wanted_error(job_));
        if (!memory.keeps_limit()) is_short_of_memory_ = true;
        show(state, true);
    }

    int finish(FrameWriter& writer,
               const MemoryNeeds& needs,
               const film::NoiseEstimate& noise,
               const integrator::RenderResult& result) {
        const bool is_stopped = result.reason == integrator::StopReason::Interrupted;
        // A file to go on from may have holes
        const uint64_t fewest = keeps_sums(job_) ? noise.samples_max : noise.samples_min;
        if (is_stopped && fewest == 0) {
            diagnostics_.error(
                is_short_of_memory_ ? "memory-limit" : "interrupted", {}, {},
                fmt::format("{} before {} pixel had a sample; nothing was written",
                            is_short_of_memory_ ? "the memory limit was reached" : "stopped",
                            keeps_sums(job_) ? "any" : "every"));
            return is_short_of_memory_ ? int(MemoryReached)
                                       : SignalBase + StopSignals::signal_number();
        }
        if (!is_stopped) writer.set_finished();
        const std::vector<scene::Effect> broken =
            integrator::broken_promises(input_.plan, result.rays.effects);
        const Result<image::WriteReport> written = writer.write(result.curve, broken);
        if (!written) {
            const std::string where = written.error().code == "io-write"
                                          ? "; " + writer.rescue(result.curve, broken)
                                          : std::string();
            diagnostics_.error(written.error().code, {}, {}, written.error().message + where);
            const bool is_check =
                written.error().code == "closure-failed" || written.error().code == "verify-failed";
            return is_check ? CheckFailed : RenderError;
        }
        if (!writer.write_deep(diagnostics_)) return RenderError;
        if (!writer.write_stats(needs, noise, result, *written, diagnostics_)) return RenderError;
        const std::optional<PictureError> error =
            picture_error(job_, renderer_.film(), noise, result.curve);
        if (!job_.arguments.quiet) print_summary(*written, noise, result);
        warn_of_lower_bound(error, !result.curve.is_empty() && result.curve.is_rare(),
                            renderer_.window(), diagnostics_);
        if (is_stopped && is_short_of_memory_) {
            warn_of_memory(needs, noise);
            return TargetMissed;
        }
        if (is_stopped) return SignalBase + StopSignals::signal_number();
        if (misses_textures()) {
            diagnostics_.error("texture-failure", {}, {},
                               fmt::format("pictures of {} textures could not be read and "
                                           "--texture-failure error: {} has their fallbacks",
                                           unread_textures(renderer_.world()), input_.output));
            return RenderError;
        }
        for (const scene::Effect e : broken)
            diagnostics_.error("effect-plan", {}, {},
                               fmt::format("the plan has {} off, and its code ran {} times: the "
                                           "plan is wrong, which the file says in velatura/plan",
                                           scene::info(e).name, result.rays.effects.of(e)));
        if (!broken.empty() || result.rays.tracking.violations > 0 ||
            (job_.arguments.strict && renderer_.film().invalid_count() > 0))
            return CheckFailed;
        return report_budget(job_, noise, result, error, diagnostics_);
    }

    void print_summary(const image::WriteReport& written,
                       const film::NoiseEstimate& noise,
                       const integrator::RenderResult& result) const {
        fmt::print("{}: {} layers, {} channels, closure {:.3g} of its bound, {}\n", input_.output,
                   written.layers, written.channels, written.closure_measured,
                   format_duration(result.seconds));
        if (const size_t unread = unread_textures(renderer_.world()); unread > 0)
            fmt::print(
                "pictures of {} textures could not be read: their fallbacks are in the picture\n",
                unread);
        if (wanted_error(job_) > 0 && !result.curve.is_empty())
            fmt::print("{}\n", forecast_text(result.curve, noise.samples_mean, wanted_error(job_)));
    }

    void warn_of_memory(const MemoryNeeds& needs, const film::NoiseEstimate& noise) {
        const integrator::RenderOptions& schedule = job_.settings.schedule;
        diagnostics_.warn(
            "memory-limit", {}, {},
            fmt::format(
                "--memory-limit {} ended the render after {:g}{} samples per pixel; all of "
                "it was expected to take {}",
                format_bytes(MemoryLimit::allowed()), noise.samples_mean,
                schedule.is_open_ended ? std::string() : fmt::format(" of {}", schedule.end_sample),
                needs.text()));
    }

    const RenderJob& job_;
    const FrameInput& input_;
    Diagnostics& diagnostics_;
    std::optional<EarlierPart>
        earlier_;  ///< what the render goes on from; its sums move into the film
    std::optional<image::TopUpRequest> request_;
    std::string top_ups_ = "[]";
    FrameSettings settings_;
    render::Renderer renderer_;
    ProgressPrinter printer_;
    std::atomic<bool> is_short_of_memory_ = false;
};

}  // namespace

int render_frame(const RenderJob& job, const FrameInput& input, Diagnostics& diagnostics) {
    const image::Window window = data_window(input.scene.settings, job.arguments.crop);
    if (window.is_empty()) {
        diagnostics.error("empty-window", {}, {}, "the crop or data window holds no pixel centre");
        return UsageError;
    }
    std::optional<OutputLock> lock;
    if (!job.replay) {
        if (const int code = take_output(input.output, lock, diagnostics); code != Done)
            return code;
    }
    FrameSettings settings;
    if (!job.replay) {
        settings = frame_settings(job, input);
        // That has read all files of the scene
        if (const Result<void> ok = check_outputs(input); !ok) {
            diagnostics.error(ok.error().code, {}, {}, ok.error().message);
            return UsageError;
        }
    }
    if (!job.arguments.resume)
        return FrameRenderer(job, input, std::move(settings), std::nullopt, std::nullopt,
                             diagnostics)
            .run();

    Result<std::optional<EarlierPart>> earlier = read_earlier_part(input.output);
    if (!earlier) return refuse_to_resume(input.output, earlier.error().message, diagnostics);
    const std::string why = *earlier ? difference(**earlier, job, input, settings) : std::string();
    if (!why.empty()) return refuse_to_resume(input.output, why, diagnostics);
    if (job.arguments.for_mix.empty()) {
        if (!*earlier)
            diagnostics.note(
                "resume", {}, {},
                fmt::format("there is no {} yet: the render starts from its first sample",
                            input.output));
        return FrameRenderer(job, input, std::move(settings), std::move(*earlier), std::nullopt,
                             diagnostics)
            .run();
    }
    if (!*earlier)
        return refuse_to_resume(input.output, "there is no such file, and --for-mix adds to one",
                                diagnostics);
    Result<image::TopUpRequest> request =
        read_request(frame_path(job.arguments.for_mix, input.frame), input, window);
    if (!request && request.error().code == "resume-refused")
        return refuse_to_resume(input.output, request.error().message, diagnostics);
    if (!request) {
        diagnostics.error(request.error().code, {}, {}, request.error().message);
        return RenderError;
    }
    RenderJob topped = job;
    if (!job.arguments.spp && request->samples >= 1.0)
        topped.settings.schedule.end_sample = uint64_t(std::llround(request->samples));
    return FrameRenderer(topped, input, std::move(settings), std::move(*earlier),
                         std::move(*request), diagnostics)
        .run();
}

}  // namespace velatura::app
