// SPDX-License-Identifier: Apache-2.0
#include "app/frame_renderer.h"

#include "app/exit_codes.h"
#include "app/output_files.h"
#include "app/render_report.h"
#include "app/render_settings.h"
#include "app/replay.h"
#include "app/stats.h"
#include "app/stop_signals.h"
#include "base/input_guard.h"
#include "base/process/memory_limit.h"
#include "image/display.h"
#include "image/file_color.h"
#include "image/image.h"
#include "integrator/sample_placement.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <utility>

namespace velatura::app {

int FrameRenderer::make(const RenderJob& job,
                        const FrameInput& input,
                        const FrameControl& control,
                        Diagnostics& diagnostics,
                        std::unique_ptr<FrameRenderer>& renderer) {
    if (data_window(input.scene.settings, job.arguments.crop).is_empty()) {
        diagnostics.error("empty-window", {}, {},
                          "the crop or data window contains no pixel center");
        return UsageError;
    }
    std::vector<OutputLock> locks;
    FrameFacts facts;
    Continuation from;
    RenderJob wanted = job;
    if (!job.replay) {
        const bool has_output = !input.output.empty();
        if (has_output) {
            if (const int code = take_outputs(input, locks, diagnostics); code != Done) return code;
        }
        facts.files = scene_files(input.scene);
        facts.settings = frame_settings(job, input, facts.files);
        if (const Result<void> ok = check_output(job.arguments.preview); !ok) {
            diagnostics.error(ok.error().code, {}, {}, ok.error().message);
            return UsageError;
        }
        if (has_output) {
            // That has read all files of the scene
            if (const Result<void> ok = check_outputs(input); !ok) {
                diagnostics.error(ok.error().code, {}, {}, ok.error().message);
                return UsageError;
            }
            from = find_continuation(job, input, facts.settings, diagnostics);
            if (from.code != Done) return from.code;
        }
        if (const auto end = from.end_sample(job)) wanted.settings.schedule.end_sample = *end;
    }
    renderer.reset(new FrameRenderer(wanted, input, control, std::move(locks), std::move(facts),
                                     std::move(from), diagnostics));
    return Done;
}

FrameRenderer::FrameRenderer(const RenderJob& job,
                             const FrameInput& input,
                             const FrameControl& control,
                             std::vector<OutputLock> locks,
                             FrameFacts facts,
                             Continuation from,
                             Diagnostics& diagnostics)
    : job_(job),
      input_(input),
      control_(control),
      diagnostics_(diagnostics),
      locks_(std::move(locks)),
      from_(std::move(from)),
      facts_(std::move(facts)),
      renderer_(input.scene, from_.applied_to(render_settings(job, input))),
      progress_(job_) {}

int FrameRenderer::prepare() {
    renderer_.build(diagnostics_);
    const shading::TextureCache& textures = renderer_.world().materials.textures();
    needs_ = allot_memory(job_, input_, textures,
                          from_.earlier ? from_.earlier->sums.memory_bytes() : 0, diagnostics_);
    const int refused =
        reject_frame(job_, needs_, unread_textures(renderer_.world()), diagnostics_);
    if (refused != Done) return refused;
    renderer_.learn(control_.stop);
    if (job_.replay) return Done;
    renderer_.measure_truncation(control_.stop);
    if (const int code = check_what_was_learned(); code != Done) return code;
    memory_.emplace(textures, needs_.writing);
    facts_.part = unfinished_part();
    writer_.emplace(job_, input_, renderer_, facts_, *memory_);
    start_film();
    return Done;
}

int FrameRenderer::replay() {
    if (renderer_.light_tracer())
        diagnostics_.warn("caustics", {}, {},
                          "--replay traces the camera path alone; the sample also has caustics by "
                          "light tracing");
    const integrator::RenderOptions& schedule = job_.settings.schedule;
    ReplayedSamples what{job_.replay->x, job_.replay->y, schedule.first_sample,
                         schedule.end_sample};
    if (const auto sample = job_.replay->sample) {
        what.first = *sample;
        what.end = *sample + 1;
    } else if (schedule.adaptive && what.end > integrator::pilot_samples) {
        // How many the pixel has is known only after all its neighbors were rendered
        diagnostics_.note(
            "replay", {}, {},
            fmt::format("samples {} to {} are traced; with adaptive sampling a render takes fewer "
                        "or more of them in this pixel; with --adaptive off exactly these",
                        what.first, what.end - 1));
    }
    const std::vector<std::string>& files = job_.arguments.paths;
    if (files.empty())
        return print_paths(renderer_.tracer(), renderer_.layers(), input_.scene, what);
    PathsFileInfo info{input_.scene_name, input_.frame, job_.settings.tracer.seed, input_.up_axis,
                       input_.scene.meters_per_unit};
    const Box3 bounds = renderer_.world().accelerator->bounds();
    if (!bounds.isEmpty()) info.reach = (Vec3d(bounds.max) - Vec3d(bounds.min)).length();
    return write_paths(renderer_.tracer(), renderer_.layers(), renderer_.world(), what, info, files,
                       diagnostics_);
}

/// Whether paths are guided is known only now. Returns: an exit code.
int FrameRenderer::check_what_was_learned() {
    facts_.settings.emplace_back("--guiding", renderer_.prepass().guide.is_used ? "on" : "off");
    // What was learned is not whole then: neither pixels nor a header may come from it
    if (*control_.stop) return report_early_end(false, "the first sample", diagnostics_);
    report_prepass(job_, renderer_, diagnostics_);
    const std::string why =
        from_.difference(facts_.settings, settings_hash(facts_.settings, renderer_.layers()), job_);
    if (!why.empty()) return reject_resume(input_.output, why, diagnostics_);
    return Done;
}

PartState FrameRenderer::unfinished_part() const {
    const integrator::RenderOptions& schedule = job_.settings.schedule;
    PartState part{schedule.first_sample, schedule.end_sample, false};
    if (schedule.is_open_ended) part.end.reset();
    return part;
}

/// Without samples: pixels begin where their rates say.
accumulate::SampleSums FrameRenderer::sums_with_rates() const {
    const image::Window w = renderer_.window();
    accumulate::SampleSums sums(w, renderer_.layers());
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x) sums.set_rate(x, y, from_.rates->rates[w.index(x, y)]);
    return sums;
}

/// With the counts that a request asks for, from what the film has.
void FrameRenderer::start_film() {
    if (from_.earlier) {
        facts_.top_ups = from_.earlier->state.top_ups;
        renderer_.start_film(std::move(from_.earlier->sums), std::move(from_.earlier->bad));
    } else if (from_.rates) {
        renderer_.start_film(sums_with_rates(), {});
    } else {
        // A file that can be merged or gone on from needs every node of the sums, also those that
        // the image alone would fold early
        const bool needs_all = keeps_sums(job_) || job_.settings.schedule.is_open_ended;
        renderer_.start_film(
            {.final_sample_end = needs_all ? 0 : integrator::max_samples(job_.settings.schedule)});
    }
    if (!from_.request) return;
    const uint64_t end = job_.settings.schedule.end_sample;
    facts_.top_ups = with_request(facts_.top_ups, *from_.request, end);
    top_up_.emplace(renderer_.film(),
                    layers::place_samples(renderer_.window(), from_.request->priority,
                                          from_.request->present, double(end)),
                    end);
}

/// A viewer that cannot be reached is no reason not to render.
void FrameRenderer::start_display() {
    if (!job_.display) return;
    display::DisplayOptions options;
    options.address = *job_.display;
    options.name = input_.output.empty() ? "velatura" : input_.output;
    options.display = {0, 0, input_.scene.settings.width, input_.scene.settings.height};
    auto layers = display::find_layers(renderer_.layers(), job_.display_layers);
    if (layers)
        options.layers = *std::move(layers);
    else
        diagnostics_.warn(
            "display", {}, {},
            "--display-layers: " + layers.error().message + "; only the beauty is sent");
    display_.emplace(std::move(options));
    if (const Result<void> started = display_->start(); !started)
        diagnostics_.warn("display", {}, {},
                          started.error().message + "; trying again during the render");
}

/// An image that cannot be made is no reason not to render.
void FrameRenderer::start_preview() {
    if (job_.arguments.preview.empty() && !job_.terminal) return;
    const scene::RenderSettings& settings = input_.scene.settings;
    layers::FileInfo info;
    render::state_color_space(settings, info);
    image::Image file;
    file.attributes["chromaticities"] = info.chromaticities;
    file.attributes["colorInteropID"] = info.color_space;
    const auto color = image::color_of(file);
    auto transform = color ? image::DisplayTransform::make("", "", *color)
                           : Result<image::DisplayTransform>(color.error());
    if (!transform) {
        diagnostics_.warn("preview", {}, {},
                          "--preview: " + transform.error().message + "; there is no preview");
        return;
    }
    display::PreviewOptions options;
    options.file = job_.arguments.preview;
    options.display = {0, 0, settings.width, settings.height};
    options.pixel_aspect = float(settings.pixel_aspect_ratio);
    options.interval = std::chrono::milliseconds(int64_t(1000 * job_.preview_interval_s));
    if (job_.terminal)
        options.show = [this](const display::PreviewImage& image) { progress_.show_image(image); };
    preview_.emplace(std::move(options), *std::move(transform));
}

integrator::RenderCallbacks FrameRenderer::callbacks() {
    integrator::RenderCallbacks callbacks;
    if (display_ || preview_)
        callbacks.tile_done = [&](const film::Film& film, const film::Window& tile) {
            if (display_) display_->add_tile(film, tile);
            if (preview_) preview_->add_tile(film, tile);
        };
    callbacks.progress = [&](const integrator::RenderState& state) {
        if (!memory_->keeps_limit()) is_short_of_memory_ = true;
        progress_.show(state);
        if (control_.progress) control_.progress(state);
    };
    callbacks.snapshot = [&](const film::Film&, const statistics::ErrorCurve& curve) {
        writer_->write_snapshot(curve, diagnostics_);
    };
    callbacks.snapshot_requested = control_.snapshot_requested;
    callbacks.stop = control_.stop;
    callbacks.give_up = &is_short_of_memory_;
    return callbacks;
}

void FrameRenderer::render() {
    MemoryLimit::watch();  // pixels take memory tile by tile
    start_display();
    start_preview();
    result_ = renderer_.advance(callbacks(), top_up_ ? &*top_up_ : nullptr);
    noise_ = renderer_.film().noise();
    if (!memory_->keeps_limit()) is_short_of_memory_ = true;
    end_views();
    progress_.finish(renderer_.film(), noise_, result_);
    report_bad_samples(renderer_.film(), result_, diagnostics_);
}

/// Viewers and previews show what a continued render began with, and what others added, as well.
void FrameRenderer::end_views() {
    constexpr int rows = 64;
    const image::Window w = renderer_.film().window();
    for (int y = w.y0; (display_ || preview_) && y < w.y1; y += rows) {
        const image::Window strip = {w.x0, y, w.x1, std::min(y + rows, w.y1)};
        if (display_) display_->add_tile(renderer_.film(), strip);
        if (preview_) preview_->add_tile(renderer_.film(), strip);
    }
    if (display_) display_->finish();
    display_.reset();
    if (!preview_) return;
    if (const Result<void> written = preview_->finish(); !written)
        diagnostics_.warn("preview", {}, {}, "--preview: " + written.error().message);
    preview_.reset();
}

int FrameRenderer::finish() {
    // A file to go on from may have holes
    const uint64_t fewest = keeps_sums(job_) ? noise_.samples_max : noise_.samples_min;
    if (is_stopped() && fewest == 0)
        return report_early_end(
            is_short_of_memory_,
            keeps_sums(job_) ? "any pixel had a sample" : "every pixel had a sample", diagnostics_);
    if (!is_stopped()) {
        facts_.part = from_.part_of(job_, result_);
        writer_->set_finished();
    }
    if (control_.owns_process)
        broken_ = integrator::broken_promises(input_.plan, result_.rays.effects);
    if (int code = Done; !input_.output.empty() && !write_files(code)) return code;
    const std::optional<ImageError> of_image = error();
    warn_of_lower_bound(of_image, !result_.curve.is_empty() && result_.curve.is_rare(), renderer_,
                        diagnostics_);
    if (is_stopped() && is_short_of_memory_) {
        warn_of_memory(job_, needs_, noise_, diagnostics_);
        return TargetMissed;
    }
    if (is_stopped()) return SignalBase + StopSignals::signal_number();
    if (report_missing_textures(job_, input_.output, unread_textures(renderer_.world()),
                                diagnostics_))
        return RenderError;
    report_broken_plan(broken_, result_, diagnostics_);
    if (!broken_.empty() || result_.rays.tracking.violations > 0 ||
        (job_.arguments.strict && renderer_.film().invalid_count() > 0))
        return CheckFailed;
    return report_budget(job_, noise_, result_, of_image, diagnostics_);
}

bool FrameRenderer::write_files(int& code) {
    const auto written = writer_->write_or_rescue(result_.curve, broken_, code, diagnostics_);
    if (!written) return false;
    code = RenderError;
    if (!writer_->write_deep(diagnostics_)) return false;
    if (!writer_->write_stats(needs_, noise_, result_, *written, diagnostics_)) return false;
    if (!job_.arguments.quiet)
        print_summary(job_, input_.output, *written, unread_textures(renderer_.world()), noise_,
                      result_);
    if (!write_others()) return false;
    locks_.clear();
    return true;
}

/// Files of other products hold the same.
bool FrameRenderer::write_others() {
    for (const std::string& path : input_.other_outputs) {
        const Result<layers::WriteReport> written = write(path);
        if (!written) {
            diagnostics_.error(written.error().code, {}, {}, written.error().message);
            return false;
        }
        if (!job_.arguments.quiet) fmt::print("{}: the same layers\n", path);
    }
    return true;
}

std::optional<ImageError> FrameRenderer::error() const {
    return image_error(job_, renderer_.film(), noise_, result_.curve);
}

Result<layers::LayerImage> FrameRenderer::image() const {
    return writer_->image(result_.curve, broken_);
}

Result<layers::WriteReport> FrameRenderer::write(const std::string& path) const {
    return writer_->write_to(path, result_.curve, broken_);
}

}  // namespace velatura::app
