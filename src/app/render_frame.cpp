// SPDX-License-Identifier: Apache-2.0
#include "app/render_frame.h"

#include "app/accuracy.h"
#include "app/exit_codes.h"
#include "app/frame_settings.h"
#include "app/light_images.h"
#include "app/memory_needs.h"
#include "app/output_files.h"
#include "app/plan_report.h"
#include "app/render_layers.h"
#include "app/replay.h"
#include "app/resume.h"
#include "app/stats.h"
#include "app/stop_signals.h"
#include "app/world_options.h"
#include "base/atomic_file.h"
#include "base/frames.h"
#include "base/memory_limit.h"
#include "base/output_lock.h"
#include "image/exr.h"
#include "integrator/schedule.h"
#include "integrator/world.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <new>
#include <optional>
#include <string>
#include <system_error>

namespace velatura::app {

namespace {

template <class Matrix>
image::Matrix44 to_floats(const Matrix& m) {
    image::Matrix44 out{};
    for (size_t r = 0; r < 4; ++r) {
        for (size_t c = 0; c < 4; ++c) out[4 * r + c] = float(m[int(r)][int(c)]);
    }
    return out;
}

image::FileInfo make_file_info(const RenderJob& job,
                               const FrameInput& input,
                               const integrator::World& world,
                               const integrator::GuideTraining& training,
                               const integrator::RouletteTrial* roulette,
                               const integrator::BranchTrial& branches,
                               const FrameSettings& settings,
                               const film::LayerSet& layers,
                               const image::Window& window,
                               const film::Film& film) {
    const scene::Scene& scene = input.scene;
    image::FileInfo info;
    info.display = {0, 0, scene.settings.width, scene.settings.height};
    info.layout = job.layout;
    info.compression = job.compression;
    info.store_sums = keeps_sums(job);
    info.seed = job.tracer.seed;
    info.scene_hash = fmt::format("{:016x}", input.content_hash);
    info.settings_hash = settings_hash(settings, layers, window);
    nlohmann::ordered_json scene_json;
    scene_json["name"] = input.scene_name;
    scene_json["hash"] = info.scene_hash;
    scene_json["frame"] = input.frame;
    scene_json["layers"] = input.layer_names;
    scene_json["camera"] = scene.camera.name;
    info.scene_json = scene_json.dump();
    nlohmann::ordered_json stats;
    stats["scene"] = make_scene_stats(input, world);
    stats["estimator"] = make_estimator_stats(job);
    stats["guiding"] = make_guiding_stats(training);
    stats["splitting"] = make_splitting_stats(branches);
    if (roulette) stats["roulette"] = make_roulette_stats(*roulette);
    stats["error"] = error_json(picture_error(job, film));
    stats["ledger"] = make_ledger(job, input, world, film);
    info.stats_json = stats.dump();
    info.light_values = input.light_values;
    info.software = fmt::format("velatura {}", VELATURA_VERSION);
    info.frames_per_second = scene.frames_per_second;
    info.pixel_aspect_ratio = scene.settings.pixel_aspect_ratio;
    info.world_to_camera = to_floats(world.camera.world_to_camera());
    info.world_to_ndc = to_floats(world.camera.world_to_ndc());
    return info;
}

constexpr const char* writing = "while the picture was written";

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
          window_(data_window(input.scene.settings, job.arguments.crop)),
          world_(input.scene,
                 world_options(job, input, input.scene, diagnostics),
                 make_light_image_loader(),
                 diagnostics),
          needs_(allot_memory()),
          caustics_(integrator::make_caustic_sampler(job.caustics, world_)),
          training_(integrator::train_guide(world_,
                                            tracer_options({}),
                                            is_refused() ? integrator::Guiding::Off : job.guiding,
                                            &StopSignals::stop_flag())),
          roulette_(try_roulette()),
          bounces_(try_bounces()),
          layers_(chosen_layers()),
          mattes_(layers_.has_mattes() ? std::make_unique<const integrator::MatteIds>(input.scene)
                                       : nullptr),
          branches_(job.splits && !is_refused()
                        ? integrator::try_branches(
                              world_,
                              tracer_options({.guide = guide(), .roulette = gains()}),
                              traced_window(),
                              &StopSignals::stop_flag())
                        : integrator::BranchTrial()),
          settings_(std::move(settings)),
          tracer_(world_, layers_, picture_options()),
          printer_(job.progress),
          memory_(world_.materials.textures(), needs_.writing) {
        settings_.emplace_back("--guiding", training_.is_used ? "on" : "off");
    }

    int run() {
        if (job_.replay) return replay_sample(tracer_, layers_, input_.scene, *job_.replay);
        if (is_refused()) return refuse();
        if (StopSignals::stop_flag()) {
            // What was learned before the first sample is not whole: neither pixels nor a header
            // may come from it
            diagnostics_.error("interrupted", {}, {},
                               "stopped before the first sample; nothing was written");
            return SignalBase + StopSignals::signal_number();
        }
        note_guiding();
        note_bounces();
        if (earlier_) {
            // Whether paths are guided is known only now
            const std::string why = difference(*earlier_, settings_);
            if (!why.empty()) return refuse_to_resume(input_.output, why, diagnostics_);
        }
        if (caustics_ && caustics_->is_empty())
            diagnostics_.note("caustics", {}, {},
                              "caustics are left to the paths: there is no smooth mirror or glass, "
                              "or no light that is wanted to shine through it");
        if (request_ && request_->settings_hash != settings_hash(settings_, layers_, window_))
            return refuse_to_resume(
                input_.output,
                fmt::format("{} was made for a render of other settings", job_.arguments.for_mix),
                diagnostics_);
        film::Film film = make_film();
        if (job_.deep) film.make_deep(*job_.deep);
        const std::optional<integrator::TopUpCounts> top_up = make_top_up(film);
        integrator::RenderCallbacks callbacks;
        callbacks.progress = [&](const integrator::RenderState& state) { show(state, false); };
        callbacks.snapshot = [&](const film::Film& f, const integrator::ErrorCurve& curve) {
            const Result<image::WriteReport> written = write_interim(f, curve);
            if (!written)
                diagnostics_.warn(
                    "snapshot", {}, {},
                    fmt::format("no {}: {}", keeps_sums(job_) ? "checkpoint" : "interim picture",
                                written.error().message));
        };
        callbacks.snapshot_requested = [] { return StopSignals::take_snapshot_request(); };
        callbacks.stop = &StopSignals::stop_flag();
        callbacks.give_up = &is_short_of_memory_;
        // Tile by tile
        MemoryLimit::watch();
        integrator::RenderResult result = integrator::run_schedule(
            film, schedule(),
            [&](int x, int y, uint64_t s, film::SampleRadiance& out,
                integrator::RayCounts& counts) { tracer_.trace(x, y, s, out, counts); },
            callbacks, top_up ? &*top_up : nullptr);
        result.rays.effects.count[size_t(scene::Effect::Subdivision)] += world_.refinement.meshes;
        result.rays.effects.count[size_t(scene::Effect::Displacement)] +=
            world_.refinement.displaced;
        const film::NoiseEstimate noise = film.noise();
        finish_progress(film, noise, result);
        report_bad_samples(film, result);
        return finish(film, noise, result);
    }

  private:
    film::Film make_film() {
        if (earlier_) return film::Film(std::move(earlier_->sums), std::move(earlier_->bad));
        // A file that can be merged or gone on from needs every node of the sums, also those that
        // the picture alone would fold early
        return film::Film(window_, layers_,
                          {.final_sample_end = keeps_sums(job_) || job_.is_open_ended
                                                   ? 0
                                                   : integrator::most_samples(job_.schedule)});
    }

    /// Of a world that is ready.
    MemoryNeeds allot_memory() const {
        MemoryLimit::enforce(
            "while trial paths were traced, which --guiding off and --splitting off do without");
        const size_t film_bytes = earlier_ ? earlier_->sums.memory_bytes() : 0;
        MemoryNeeds needs = expected_memory(job_, input_, world_.materials.textures(), film_bytes);
        allot_textures(world_.materials.textures(), needs);
        if (MemoryLimit::is_set() && needs.total() > MemoryLimit::allowed() &&
            needs.least() <= MemoryLimit::allowed())
            diagnostics_.warn("memory-limit", {}, {},
                              fmt::format("the render may take {}, and --memory-limit is {}: it "
                                          "stops with what it has where it comes near",
                                          needs.text(), format_bytes(MemoryLimit::allowed())));
        return needs;
    }

    /// The counts that a request asks for, from what the film has.
    std::optional<integrator::TopUpCounts> make_top_up(const film::Film& film) {
        if (earlier_) top_ups_ = earlier_->top_ups;
        if (!request_) return std::nullopt;
        top_ups_ = with_request(top_ups_, *request_, job_.schedule.end_sample);
        const double mean = double(job_.schedule.end_sample);
        return integrator::TopUpCounts(
            film, image::place_samples(window_, request_->priority, request_->present, mean),
            job_.schedule.end_sample);
    }

    /// What was found out before the first sample, as far as it was by now.
    struct Learned {
        const guiding::GuidingField* guide = nullptr;
        const integrator::RouletteGains* roulette = nullptr;
        const integrator::BranchMap* branches = nullptr;
    };

    integrator::PathTracerOptions tracer_options(const Learned& learned) const {
        integrator::PathTracerOptions options = job_.tracer;
        options.guide = learned.guide;
        options.roulette = learned.roulette;
        options.branches = learned.branches;
        options.caustics = caustics_.get();
        options.disable_lens = input_.scene.settings.disable_depth_of_field;
        return options;
    }

    /// Those of the picture, for which trial paths did without what is only written.
    integrator::PathTracerOptions picture_options() const {
        integrator::PathTracerOptions options = tracer_options({guide(), gains(), &branches_.map});
        options.mattes = mattes_.get();
        options.deep = job_.deep.has_value();
        return options;
    }

    const guiding::GuidingField* guide() const {
        return training_.is_used ? &training_.field : nullptr;
    }

    std::optional<integrator::RouletteTrial> try_roulette() const {
        if (job_.tracer.estimator.roulette != integrator::Roulette::Efficiency || is_refused())
            return std::nullopt;
        return integrator::try_roulette(world_, tracer_options({.guide = guide()}),
                                        &StopSignals::stop_flag());
    }

    std::optional<integrator::BounceTrial> try_bounces() const {
        // A render that goes on keeps the bounces of its file
        if (!job_.least_bounce_share || earlier_ || is_refused() || job_.replay)
            return std::nullopt;
        return integrator::try_bounces(world_,
                                       tracer_options({.guide = guide(), .roulette = gains()}),
                                       job_.layers.last_bounce, &StopSignals::stop_flag());
    }

    film::LayerSet chosen_layers() const {
        film::LayerSet layers = layers_of(job_, input_.scene);
        if (bounces_)
            layers.last_bounce =
                bounces_->last_bounce(*job_.least_bounce_share, layers.last_bounce);
        else if (job_.least_bounce_share && earlier_)
            layers.last_bounce = earlier_->sums.layer_set().last_bounce;
        return layers;
    }

    const integrator::RouletteGains* gains() const {
        return roulette_ ? &roulette_->gains : nullptr;
    }

    const integrator::RouletteTrial* roulette() const { return roulette_ ? &*roulette_ : nullptr; }

    /// The pixels that paths start from.
    image::Window traced_window() const {
        if (!job_.replay) return window_;
        // A pixel outside of the picture is refused later
        const scene::RenderSettings& s = input_.scene.settings;
        const int x = int(std::min((*job_.replay)[0], uint64_t(s.width - 1))),
                  y = int(std::min((*job_.replay)[1], uint64_t(s.height - 1)));
        return {x, y, x + 1, y + 1};
    }

    double seconds_before() const {
        return training_.seconds + branches_.seconds + (roulette_ ? roulette_->seconds : 0.0) +
               (bounces_ ? bounces_->seconds : 0.0);
    }

    /// What is left of the time after training and trial.
    integrator::RenderOptions schedule() const {
        integrator::RenderOptions options = job_.schedule;
        if (options.time_budget_s > 0)
            options.time_budget_s = std::max(options.time_budget_s - seconds_before(), 1e-6);
        if (earlier_) options.curve = earlier_->curve;
        return options;
    }

    /// Of a scene that memory does not suffice for, of one with errors, strict, or with pictures
    /// that cannot be read where that is not to be: no picture is made, and no training either; a
    /// replay goes on.
    bool is_refused() const {
        return !job_.replay && (is_too_large() || is_strict_and_wrong() || misses_textures());
    }

    bool is_too_large() const {
        return MemoryLimit::is_set() && needs_.least() > MemoryLimit::allowed();
    }

    bool is_strict_and_wrong() const {
        return job_.arguments.strict && diagnostics_.error_count() > 0;
    }

    bool misses_textures() const {
        return job_.arguments.texture_failure == "error" && unread_textures(world_) > 0;
    }

    int refuse() {
        if (is_too_large()) {
            diagnostics_.error(
                "memory-limit", {}, {},
                fmt::format(
                    "the render would take {}, and --memory-limit is {}: nothing is rendered",
                    needs_.text(), format_bytes(MemoryLimit::allowed())));
            return MemoryReached;
        }
        if (is_strict_and_wrong())
            diagnostics_.error("strict", {}, {},
                               fmt::format("{} errors and --strict: nothing is rendered",
                                           diagnostics_.error_count()));
        else
            diagnostics_.error("texture-failure", {}, {},
                               fmt::format("pictures of {} textures cannot be read and "
                                           "--texture-failure error: nothing is rendered",
                                           unread_textures(world_)));
        return RenderError;
    }

    /// What auto decided: -v prints it.
    void note_guiding() {
        if (job_.guiding != integrator::Guiding::Auto) return;
        const std::string why =
            training_.field.is_empty()
                ? std::string("indirect light makes little noise here")
                : fmt::format("guided trial paths were the better ones in {} of {} groups",
                              training_.wins, integrator::GuideTraining::group_count);
        diagnostics_.note(
            "guiding", {}, {},
            fmt::format("paths are {}guided: {}; --guiding on or off decides otherwise",
                        training_.is_used ? "" : "not ", why));
    }

    /// What --bounces auto decided: -v prints it.
    void note_bounces() {
        if (!bounces_) return;
        diagnostics_.note("bounces", {}, {}, text_of(*bounces_, layers_.last_bounce));
    }

    void show(const integrator::RenderState& state, bool is_last) {
        ProgressState p;
        p.fraction = is_last ? 1.0 : state.fraction;
        p.samples = state.samples_per_pixel;
        if (!job_.is_open_ended)
            p.samples_target = double(job_.schedule.end_sample - job_.schedule.first_sample);
        p.elapsed_s = state.elapsed_s;
        p.left_s = is_last ? std::optional<double>(0.0) : state.left_s;
        p.error = state.error;
        p.is_upper_error = state.is_upper_error;
        p.is_lower_error = state.is_lower_error;
        p.forecast = state.forecast;
        p.rays_per_s = state.elapsed_s > 0 ? double(state.rays.total()) / state.elapsed_s : 0.0;
        p.memory_bytes = resident_bytes();
        if (!memory_.keeps_limit()) is_short_of_memory_ = true;
        p.is_last = is_last;
        printer_.show(p);
    }

    void finish_progress(const film::Film& film,
                         const film::NoiseEstimate& noise,
                         const integrator::RenderResult& result) {
        integrator::RenderState state;
        state.samples_per_pixel = noise.samples_mean;
        state.elapsed_s = result.seconds;
        state.rays = result.rays;
        if (const std::optional<PictureError> error =
                picture_error(job_, film, noise, result.curve)) {
            state.error = error->error.value;
            state.is_upper_error = error->is_upper;
            state.is_lower_error = error->is_lower;
        }
        if (wanted_error(job_) > 0 && !result.curve.is_empty())
            state.forecast = result.curve.forecast(wanted_error(job_));
        show(state, true);
    }

    void report_bad_samples(const film::Film& film, const integrator::RenderResult& result) {
        for (const film::BadSample& b : film.bad_samples()) {
            diagnostics_.warn("bad-sample", {}, {},
                              fmt::format("pixel ({}, {}) sample {}: radiance is {}; left out; see "
                                          "it with --replay {},{},{}",
                                          b.x, b.y, b.sample, b.reason, b.x, b.y, b.sample));
        }
        if (film.invalid_count() > 16)
            diagnostics_.warn(
                "bad-sample", {}, {},
                fmt::format("{} bad samples in all were left out; layer `invalid` shows where",
                            film.invalid_count()));
        if (result.rays.caustics_capped > 0) {
            diagnostics_.warn(
                "caustics", {}, {},
                fmt::format(
                    "{} of {} caustic chains were so hard to find again that they count too little",
                    result.rays.caustics_capped, result.rays.caustics_found));
        }
        const media::TrackingCounts& tracking = result.rays.tracking;
        if (tracking.violations > 0)
            diagnostics_.error(
                "volume-majorant", {}, {},
                fmt::format(
                    "{} lookups in volumes were above their bound: this is a bug of Velatura",
                    tracking.violations));
        if (tracking.capped > 0)
            diagnostics_.warn(
                "volume-cap", {}, {},
                fmt::format("{} ways through volumes were cut because light met too much on them",
                            tracking.capped));
        if (result.rays.walks_given_up > 0)
            diagnostics_.warn(
                "subsurface", {}, {},
                fmt::format("{} walks below surfaces were given up after {} scatterings: a white "
                            "body is very large for its subsurfaceRadius, or not closed",
                            result.rays.walks_given_up, integrator::SubsurfaceWalk::most_steps));
        if (result.rays.bodies_unmatched > 0)
            diagnostics_.warn("nested-bodies", {}, {},
                              fmt::format("rays left bodies {} times without having entered them: "
                                          "some body with or beside a priority is not closed",
                                          result.rays.bodies_unmatched));
        if (result.rays.bodies_too_deep > 0)
            diagnostics_.warn("nested-bodies", {}, {},
                              fmt::format("rays were within more bodies than can be told apart, {} "
                                          "times: the last ones did not count",
                                          result.rays.bodies_too_deep));
        if (result.rays.depth_limited > 0)
            diagnostics_.warn("depth-limit", {}, {},
                              fmt::format("{} paths were cut after {} scatterings",
                                          result.rays.depth_limited, integrator::hard_depth_limit));
    }

    /// Where a render is to stop follows from the curve: one that goes on must not have to find it
    /// again. Without a target no file is to depend on how samples came.
    nlohmann::ordered_json kept_curve(const integrator::ErrorCurve& curve) const {
        return job_.schedule.target_error > 0 ? observations_json(curve)
                                              : nlohmann::ordered_json::array();
    }

    image::FileInfo file_info(const film::Film& film,
                              const integrator::ErrorCurve& curve,
                              const std::vector<scene::Effect>& broken) {
        image::FileInfo info = make_file_info(job_, input_, world_, training_, roulette(),
                                              branches_, settings_, layers_, window_, film);
        info.plan_json = plan_json(input_.plan, broken).dump();
        info.bad_samples = film.bad_samples();
        if (mattes_) info.matte_names = mattes_->names();
        info.settings_json =
            settings_json(settings_, job_.schedule.first_sample, top_ups_, kept_curve(curve));
        return info;
    }

    Result<image::WriteReport> write(const film::Film& film,
                                     const integrator::ErrorCurve& curve,
                                     const std::vector<scene::Effect>& broken = {}) {
        return film.write(input_.output, file_info(film, curve, broken));
    }

    /// Where the picture cannot be had in its folder after hours it is put into that for temporary
    /// files, as one file. Says where.
    std::string rescue(const film::Film& film,
                       const integrator::ErrorCurve& curve,
                       const std::vector<scene::Effect>& broken) {
        std::error_code failed;
        const std::filesystem::path folder = std::filesystem::temp_directory_path(failed);
        const std::string path =
            (folder / fmt::format("velatura-{}-{}", ::getpid(),
                                  std::filesystem::path(input_.output).filename().string()))
                .string();
        image::FileInfo info = file_info(film, curve, broken);
        info.layout = image::Layout::MultiPart;
        const Result<image::WriteReport> written =
            failed ? Error{"io-write", failed.message()} : film.write(path, info);
        if (!written)
            return fmt::format("nor can it be put elsewhere: {}", written.error().message);
        return fmt::format(
            "it is in {} instead{}", path,
            info.store_sums ? ", which --resume goes on from once it is in its place" : "");
    }

    /// What was rendered for hours is not lost for some megabytes: the second try takes less, and
    /// longer.
    Result<image::WriteReport> write_in_memory(const film::Film& film,
                                               const integrator::ErrorCurve& curve,
                                               const std::vector<scene::Effect>& broken = {}) {
        if (!memory_.has_plenty_to_write()) image::use_one_exr_thread();
        MemoryLimit::enforce(writing);
        try {
            Result<image::WriteReport> written = write(film, curve, broken);
            // OpenEXR's threads leave rows out that they have no memory for
            if (written || !MemoryLimit::is_set() || written.error().code != "verify-failed")
                return written;
        } catch (const std::bad_alloc&) {
            if (!MemoryLimit::is_set()) throw;
        }
        memory_.make_room();
        MemoryLimit::enforce(writing);
        return write(film, curve, broken);
    }

    /// One that there is no memory for is left out, and the render goes on.
    Result<image::WriteReport> write_interim(const film::Film& film,
                                             const integrator::ErrorCurve& curve) {
        const auto written = [&]() -> Result<image::WriteReport> {
            try {
                return write_in_memory(film, curve);
            } catch (const std::bad_alloc&) {
                return Error{"memory-limit", "there is not enough memory"};
            }
        }();
        MemoryLimit::watch();
        return written;
    }

    int finish(const film::Film& film,
               const film::NoiseEstimate& noise,
               const integrator::RenderResult& result) {
        // A file to go on from may have holes
        const uint64_t fewest = keeps_sums(job_) ? noise.samples_max : noise.samples_min;
        if (result.reason == integrator::StopReason::Interrupted && fewest == 0) {
            diagnostics_.error(
                is_short_of_memory_ ? "memory-limit" : "interrupted", {}, {},
                fmt::format("{} before {} pixel had a sample; nothing was written",
                            is_short_of_memory_ ? "the memory limit was reached" : "stopped",
                            keeps_sums(job_) ? "any" : "every"));
            return is_short_of_memory_ ? int(MemoryReached)
                                       : SignalBase + StopSignals::signal_number();
        }
        const std::vector<scene::Effect> broken =
            integrator::broken_promises(input_.plan, result.rays.effects);
        const Result<image::WriteReport> written = write_in_memory(film, result.curve, broken);
        if (!written) {
            const std::string where = written.error().code == "io-write"
                                          ? "; " + rescue(film, result.curve, broken)
                                          : std::string();
            diagnostics_.error(written.error().code, {}, {}, written.error().message + where);
            const bool is_check =
                written.error().code == "closure-failed" || written.error().code == "verify-failed";
            return is_check ? CheckFailed : RenderError;
        }
        if (film.deep() && !write_deep(*film.deep())) return RenderError;
        if (!write_stats(film, noise, result, *written)) return RenderError;
        if (!job_.arguments.quiet) {
            fmt::print("{}: {} layers, {} channels, closure {:.3g} of its bound, {}\n",
                       input_.output, written->layers, written->channels, written->closure_measured,
                       format_duration(result.seconds));
        }
        if (const size_t unread = unread_textures(world_); !job_.arguments.quiet && unread > 0)
            fmt::print(
                "pictures of {} textures could not be read: their fallbacks are in the picture\n",
                unread);
        if (!job_.arguments.quiet && wanted_error(job_) > 0 && !result.curve.is_empty())
            fmt::print("{}\n", forecast_text(result.curve, noise.samples_mean, wanted_error(job_)));
        warn_of_lower_bound(picture_error(job_, film, noise, result.curve),
                            !result.curve.is_empty() && result.curve.is_rare());
        if (result.reason == integrator::StopReason::Interrupted && is_short_of_memory_) {
            diagnostics_.warn(
                "memory-limit", {}, {},
                fmt::format(
                    "--memory-limit {} ended the render after {:g}{} samples per pixel; all of it "
                    "was expected to take {}",
                    format_bytes(MemoryLimit::allowed()), noise.samples_mean,
                    job_.is_open_ended ? std::string()
                                       : fmt::format(" of {}", job_.schedule.end_sample),
                    needs_.text()));
            return TargetMissed;
        }
        if (result.reason == integrator::StopReason::Interrupted)
            return SignalBase + StopSignals::signal_number();
        if (misses_textures()) {
            diagnostics_.error("texture-failure", {}, {},
                               fmt::format("pictures of {} textures could not be read and "
                                           "--texture-failure error: {} has their fallbacks",
                                           unread_textures(world_), input_.output));
            return RenderError;
        }
        for (const scene::Effect e : broken)
            diagnostics_.error("effect-plan", {}, {},
                               fmt::format("the plan has {} off, and its code ran {} times: the "
                                           "plan is wrong, which the file says in velatura/plan",
                                           scene::info(e).name, result.rays.effects.of(e)));
        if (!broken.empty() || result.rays.tracking.violations > 0 ||
            (job_.arguments.strict && film.invalid_count() > 0))
            return CheckFailed;
        return finish_budget(noise, result, picture_error(job_, film, noise, result.curve));
    }

    /// Says which budget ended the render, and what was reached.
    int finish_budget(const film::NoiseEstimate& noise,
                      const integrator::RenderResult& result,
                      const std::optional<PictureError>& error) {
        const BudgetOutcome outcome = budget_outcome(job_, error, result);
        if (outcome.text.empty()) return Done;
        const std::string text = fmt::format("{} after {:.4g} samples per pixel: the error is {}",
                                             outcome.text, noise.samples_mean, reached_text(error));
        if (outcome.is_missed)
            diagnostics_.warn("budget", {}, {}, text);
        else if (!job_.arguments.quiet)
            fmt::print("{}\n", text);
        return outcome.code;
    }

    void warn_of_lower_bound(const std::optional<PictureError>& error, bool is_rare) {
        if (!error || !error->is_lower) return;
        const image::RelativeError& e = error->error;
        // The few pixels of an image that is exact elsewhere are its edges
        constexpr double negligible = 0.005;
        if (e.is_lower && e.value >= negligible)
            diagnostics_.warn(
                "rare-light", {}, {},
                fmt::format("rare bright samples: the error of {:.3g} % is a lower bound; {} of {} "
                            "pixels hold{} half of the squared error",
                            100 * e.value, e.half_in, window_.pixel_count(),
                            e.half_in == 1 ? "s" : ""));
        if (is_rare)
            diagnostics_.warn(
                "rare-light", {}, {},
                fmt::format(
                    "the error does not fall as samples grow, some light is met too rarely: "
                    "the error of {:.3g} % is a lower bound",
                    100 * e.value));
    }

    bool write_deep(const film::DeepFilm& film) {
        const Result<image::DeepImage> written = film::write_deep_picture(film, input_.output);
        if (!written)
            diagnostics_.error(written.error().code, {}, {}, written.error().message);
        else if (!job_.arguments.quiet)
            fmt::print("{}: {} deep samples, {:.3g} a pixel\n", film::deep_path(input_.output),
                       written->samples.size(),
                       double(written->samples.size()) / double(written->counts.size()));
        return written.has_value();
    }

    void add_memory_stats(nlohmann::ordered_json& memory) const {
        if (MemoryLimit::is_set()) memory["limit"] = MemoryLimit::allowed();
        memory["before_first_sample"] = needs_.now;
        memory["textures_expected"] = needs_.textures;
        memory["writing_expected"] = needs_.writing;
        memory["peak_expected"] = needs_.total();
    }

    bool write_stats(const film::Film& film,
                     const film::NoiseEstimate& noise,
                     const integrator::RenderResult& result,
                     const image::WriteReport& written) {
        if (input_.stats_file.empty()) return true;
        nlohmann::ordered_json stats =
            make_stats(job_, input_, world_, training_, branches_, film, noise, result);
        if (roulette_) {
            stats["roulette"] = make_roulette_stats(*roulette_);
            stats["phases_s"]["roulette"] = roulette_->seconds;
        }
        if (bounces_) {
            stats["bounces"] = make_bounce_stats(*bounces_, layers_.last_bounce);
            stats["phases_s"]["bounces"] = bounces_->seconds;
        }
        add_memory_stats(stats["memory_bytes"]);
        stats["error"]["storage"] = written.storage_error;
        stats["closure"] = {{"family", written.closure_family},
                            {"layers", written.layers},
                            {"bound", 1.0},
                            {"measured", written.closure_measured}};
        stats["files"] = nlohmann::ordered_json::array();
        for (const std::string& file : written.files)
            stats["files"].push_back({{"path", std::filesystem::path(file).filename().string()},
                                      {"sha256", written.sha256}});
        if (film.deep())
            stats["files"].push_back(
                {{"path",
                  std::filesystem::path(film::deep_path(input_.output)).filename().string()}});
        const Result<void> ok = write_file_atomically(input_.stats_file, stats.dump(2) + "\n");
        if (!ok) diagnostics_.error(ok.error().code, {}, {}, ok.error().message);
        return ok.has_value();
    }

    const RenderJob& job_;
    const FrameInput& input_;
    Diagnostics& diagnostics_;
    std::optional<EarlierPart>
        earlier_;  ///< what the render goes on from; its sums move into the film
    std::optional<image::TopUpRequest> request_;
    std::string top_ups_ = "[]";
    image::Window window_;
    integrator::World world_;
    MemoryNeeds needs_;
    std::unique_ptr<const integrator::CausticSampler> caustics_;  ///< null = by paths
    integrator::GuideTraining training_;
    std::optional<integrator::RouletteTrial> roulette_;
    std::optional<integrator::BounceTrial> bounces_;  ///< of --bounces auto
    film::LayerSet layers_;
    std::unique_ptr<const integrator::MatteIds> mattes_;  ///< null = no Cryptomattes
    integrator::BranchTrial branches_;
    FrameSettings settings_;
    integrator::PathTracer tracer_;
    ProgressPrinter printer_;
    MemoryWatch memory_;
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
        topped.schedule.end_sample = uint64_t(std::llround(request->samples));
    return FrameRenderer(topped, input, std::move(settings), std::move(*earlier),
                         std::move(*request), diagnostics)
        .run();
}

}  // namespace velatura::app
