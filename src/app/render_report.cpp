// SPDX-License-Identifier: Apache-2.0
#include "app/render_report.h"

#include "app/exit_codes.h"
#include "app/missing_assets.h"
#include "app/progress.h"
#include "app/replay.h"
#include "app/stop_signals.h"
#include "integrator/subsurface_walk.h"
#include "plugin/registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

namespace velatura::app {

namespace {

void note_guiding(const integrator::GuideTraining& training, Diagnostics& diagnostics) {
    const std::string why =
        training.field.is_empty()
            ? std::string("indirect light causes little noise")
            : fmt::format("guided trial paths had less noise in {} of {} groups", training.wins,
                          integrator::GuideTraining::group_count);
    diagnostics.note("guiding", {}, {},
                     fmt::format("path guiding is {}used: {}; override with --guiding on or off",
                                 training.is_used ? "" : "not ", why));
}

/// Says that light tracing is used, or why it is not though it was asked for.
void note_light_tracing(const RenderJob& job,
                        const render::Renderer& renderer,
                        Diagnostics& diagnostics) {
    if (renderer.light_tracer()) {
        diagnostics.note("caustics", {}, {},
                         text_of(*renderer.prepass().light) + "; override with --caustics path");
        return;
    }
    const bool is_manifold = job.settings.caustics == integrator::Caustics::Manifold ||
                             job.settings.caustics == integrator::Caustics::SmallLights;
    if (is_manifold && renderer.world().has_ray_visibility)
        diagnostics.warn("caustics", {}, {},
                         "manifold sampling is not used, because some geometry is invisible to "
                         "some kinds of rays");
    if (job.settings.caustics != integrator::Caustics::Light) return;
    const std::string why =
        integrator::CausticPaths::why_not(renderer.world(), job.settings.tracer);
    diagnostics.warn(
        "caustics", {}, {},
        "--caustics light: light tracing is not used, because " +
            (why.empty()
                 ? std::string("no glass, mirror or glossy surface has a light other than a dome")
                 : why));
}

/// Why an error that few pixels hold is a lower bound, and which of them to look at.
std::string few_pixels_text(const statistics::RelativeError& e, const render::Renderer& renderer) {
    const std::string held = fmt::format(
        "the error of {:.3g} % is a lower bound; {} of {} pixels hold{} half of the "
        "squared error",
        100 * e.value, e.half_in, renderer.window().pixel_count(), e.half_in == 1 ? "s" : "");
    if (e.worst_x < 0) return "few pixels hold most of the error: " + held;
    const BrightestSample brightest = brightest_sample(renderer.tracer(), renderer.layers(),
                                                       renderer.film(), e.worst_x, e.worst_y);
    if (brightest.cause == BrightestSample::Cause::LightTracing)
        return fmt::format(
            "few pixels, with caustics by light tracing, hold most of the error: {}; the worst is "
            "pixel ({}, {}), of whose light --replay shows less than half; use more samples",
            held, e.worst_x, e.worst_y);
    return fmt::format("{}: {}; trace the worst, pixel ({}, {}) sample {}, with --replay {},{},{}",
                       brightest.cause == BrightestSample::Cause::Firefly
                           ? "rare bright samples (fireflies)"
                           : "few pixels, at edges of something bright, hold most of the error",
                       held, e.worst_x, e.worst_y, brightest.sample, e.worst_x, e.worst_y,
                       brightest.sample);
}

/// "texture a.png, texture b.png and 3 more".
std::string first_of(const std::vector<std::string>& names) {
    constexpr size_t most = 5;
    const size_t shown = std::min(names.size(), most);
    const std::string text =
        fmt::format("{}", fmt::join(names.begin(), names.begin() + std::ptrdiff_t(shown), ", "));
    return shown < names.size() ? fmt::format("{} and {} more", text, names.size() - shown) : text;
}

}  // namespace

int reject_frame(const RenderJob& job,
                 const MemoryNeeds& needs,
                 size_t unread_textures,
                 Diagnostics& diagnostics) {
    if (job.replay) return Done;
    if (!fits_limit(needs, diagnostics)) return MemoryReached;
    const std::vector<std::string> plugins = plugin::unavailable_plugin_names();
    if (const size_t errors = diagnostics.error_count(); job.arguments.strict && errors > 0)
        diagnostics.error("strict", {}, {},
                          format_count(errors, "error") + "; --strict renders nothing");
    else if (job.arguments.strict && !plugins.empty())
        diagnostics.error("strict", {}, {},
                          fmt::format("plugin {} is missing; --strict renders nothing",
                                      fmt::join(plugins, ", ")));
    else if (job.arguments.missing_textures == "error" && unread_textures > 0)
        diagnostics.error("texture-failure", {}, {},
                          format_count(unread_textures, "unreadable texture") +
                              "; --missing-textures error renders nothing");
    else if (const std::vector<std::string> missing = missing_asset_names();
             job.arguments.requires_assets && !missing.empty())
        diagnostics.error("require-assets", {}, {},
                          fmt::format("missing: {}; --require-assets renders nothing "
                                      "(--missing-assets ignore renders without them)",
                                      first_of(missing)));
    else
        return Done;
    return RenderError;
}

int report_early_end(bool is_short_of_memory, const std::string& before, Diagnostics& diagnostics) {
    diagnostics.error(
        is_short_of_memory ? "memory-limit" : "interrupted", {}, {},
        fmt::format("{} before {}; nothing was written",
                    is_short_of_memory ? "the memory limit was reached" : "stopped", before));
    return is_short_of_memory ? int(MemoryReached) : SignalBase + StopSignals::signal_number();
}

void report_prepass(const RenderJob& job,
                    const render::Renderer& renderer,
                    Diagnostics& diagnostics) {
    const render::PrepassResults& prepass = renderer.prepass();
    if (job.settings.guiding == integrator::Guiding::Auto) note_guiding(prepass.guide, diagnostics);
    if (prepass.bounces)
        diagnostics.note("bounces", {}, {},
                         text_of(*prepass.bounces, renderer.layers().last_bounce));
    if (prepass.fireflies) diagnostics.note("firefly-guard", {}, {}, text_of(*prepass.fireflies));
    note_light_tracing(job, renderer, diagnostics);
    if (renderer.caustics() && renderer.caustics()->is_empty())
        diagnostics.note("caustics", {}, {},
                         "caustics: manifold sampling is not used, because the scene has no smooth "
                         "mirror or glass, or no light selected for it");
}

void report_bad_samples(const film::Film& film,
                        const integrator::RenderResult& result,
                        Diagnostics& diagnostics) {
    for (const film::BadSample& b : film.bad_samples()) {
        diagnostics.warn("bad-sample", {}, {},
                         fmt::format("pixel ({}, {}) sample {}: radiance is {}; sample skipped; "
                                     "trace it with --replay {},{},{}",
                                     b.x, b.y, b.sample, b.reason, b.x, b.y, b.sample));
    }
    if (film.invalid_count() > 16)
        diagnostics.warn(
            "bad-sample", {}, {},
            fmt::format("{} bad samples skipped in total; layer `invalid` counts them per pixel",
                        film.invalid_count()));
    if (result.rays.caustics_capped > 0) {
        diagnostics.warn("caustics", {}, {},
                         fmt::format("{} of {} manifold-sampling estimates hit the trial cap; "
                                     "the caustics they belong to are too dark",
                                     result.rays.caustics_capped, result.rays.caustics_found));
    }
    const media::TrackingCounts& tracking = result.rays.tracking;
    if (tracking.violations > 0)
        diagnostics.error(
            "volume-majorant", {}, {},
            fmt::format(
                "{} volume lookups exceeded the majorant; please report this bug of Velatura",
                tracking.violations));
    if (tracking.capped > 0)
        diagnostics.warn(
            "volume-cap", {}, {},
            fmt::format(
                "{} volume walks were terminated at the collision limit; their light is missing",
                tracking.capped));
    if (result.rays.walks_abandoned > 0)
        diagnostics.warn(
            "subsurface", {}, {},
            fmt::format("{} subsurface walks were terminated after {} scattering events: a white "
                        "mesh is very large for its subsurfaceRadius, or not watertight",
                        result.rays.walks_abandoned, integrator::SubsurfaceWalk::max_steps));
    if (result.rays.dielectrics_unmatched > 0)
        diagnostics.warn("nested-bodies", {}, {},
                         fmt::format("{} unmatched exits from dielectrics: a mesh with a "
                                     "dielectric priority, or next to one, is not watertight",
                                     result.rays.dielectrics_unmatched));
    if (result.rays.dielectrics_too_deep > 0)
        diagnostics.warn("nested-bodies", {}, {},
                         fmt::format("{} times rays were inside more nested dielectrics than are "
                                     "tracked; the last entered were ignored",
                                     result.rays.dielectrics_too_deep));
    if (result.rays.depth_limited > 0)
        diagnostics.warn("depth-limit", {}, {},
                         fmt::format("{} paths were terminated after {} bounces",
                                     result.rays.depth_limited, integrator::hard_depth_limit));
}

void warn_of_lower_bound(const std::optional<ImageError>& error,
                         bool is_rare,
                         const render::Renderer& renderer,
                         Diagnostics& diagnostics) {
    if (!error || !error->is_lower) return;
    const statistics::RelativeError& e = error->error;
    // The few pixels of an image that is exact elsewhere are its edges
    constexpr double negligible = 0.005;
    if (e.is_lower && e.value >= negligible)
        diagnostics.warn("rare-light", {}, {}, few_pixels_text(e, renderer));
    if (error->is_hidden) {
        const film::NoiseEstimate noise = renderer.film().noise();
        diagnostics.warn(
            "hidden-caustics", {}, {},
            fmt::format(
                "caustics that the camera sees in mirrors or through glass are too rare for "
                "{:.4g} samples per pixel to measure their noise: the error of {:.3g} % is "
                "a lower bound; about {:.3g} % is expected of them",
                noise.samples_mean, 100 * e.value,
                100 * std::sqrt(error->hidden.square / noise.samples_mean)));
    }
    if (is_rare)
        diagnostics.warn(
            "rare-light", {}, {},
            fmt::format("the error does not fall with more samples, because paths rarely reach "
                        "some light: the error of {:.3g} % is a lower bound",
                        100 * e.value));
}

void report_broken_plan(const std::vector<scene::Effect>& broken,
                        const integrator::RenderResult& result,
                        Diagnostics& diagnostics) {
    for (const scene::Effect e : broken)
        diagnostics.error(
            "effect-plan", {}, {},
            fmt::format("the effect plan has {} off, but its code ran {} times; the plan is wrong, "
                        "and velatura/plan in the file states it; please report this bug",
                        scene::info(e).name, result.rays.effects.of(e)));
}

bool report_missing_textures(const RenderJob& job,
                             const std::string& output,
                             size_t unread_textures,
                             Diagnostics& diagnostics) {
    if (job.arguments.missing_textures != "error" || unread_textures == 0) return false;
    diagnostics.error("texture-failure", {}, {},
                      fmt::format("{} missing or unreadable; fallbacks used in {}; "
                                  "--missing-textures error makes this an error",
                                  format_count(unread_textures, "texture"), output));
    return true;
}

void print_summary(const RenderJob& job,
                   const std::string& output,
                   const layers::WriteReport& written,
                   size_t unread_textures,
                   const film::NoiseEstimate& noise,
                   const integrator::RenderResult& result) {
    fmt::print("{}: {} layers, {} channels{}, {}\n", output, written.layers, written.channels,
               written.closure_family == "none" ? "" : ", AOVs sum to the beauty: OK",
               format_duration(result.seconds));
    if (unread_textures > 0)
        fmt::print("{} missing or unreadable; fallback{} used\n",
                   format_count(unread_textures, "texture"), unread_textures == 1 ? "" : "s");
    if (wanted_error(job) > 0 && !result.curve.is_empty())
        fmt::print("{}\n", forecast_text(result.curve, noise.samples_mean, wanted_error(job)));
}

int report_budget(const RenderJob& job,
                  const film::NoiseEstimate& noise,
                  const integrator::RenderResult& result,
                  const std::optional<ImageError>& error,
                  Diagnostics& diagnostics) {
    const BudgetOutcome outcome = budget_outcome(job, error, result);
    if (outcome.text.empty()) return Done;
    const std::string text = fmt::format("{} after {:.4g} samples per pixel: the error is {}",
                                         outcome.text, noise.samples_mean, reached_text(error));
    if (outcome.is_missed)
        diagnostics.warn("budget", {}, {}, text);
    else if (!job.arguments.quiet)
        fmt::print("{}\n", text);
    return outcome.code;
}

}  // namespace velatura::app
