// SPDX-License-Identifier: Apache-2.0
#include "app/stats.h"

#include "app/accuracy.h"
#include "app/build_id.h"
#include "app/plan_report.h"
#include "app/progress.h"
#include "base/process/memory_limit.h"
#include "base/process/process_times.h"
#include "base/tasks.h"
#include "layers/stated_stats.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace velatura::app {

using json = nlohmann::ordered_json;

size_t unread_textures(const integrator::World& world) {
    return world.materials.textures().failed_count() + world.lights.unread_textures();
}

json make_scene_stats(const FrameInput& input, const integrator::World& world) {
    const accel::AcceleratorStats stats = world.accelerator->stats();
    json j;
    j["path"] = input.scene_name;
    j["frame"] = input.frame;
    // Parts of one light, which filters tell apart, count once
    const auto copies = std::count_if(input.scene.lights.begin(), input.scene.lights.end(),
                                      [](const scene::Light& l) { return l.is_filter_copy; });
    j["lights"] = input.scene.lights.size() + input.scene.mesh_lights.size() - size_t(copies);
    j["volumes"] = input.scene.volumes.size();
    j["shapes"] = input.scene.shapes.size();
    j["prototypes"] = input.scene.prototypes.size();
    j["instances"] = input.scene.instances.size();
    j["materials"] = input.scene.materials.size();
    j["textures"] = input.scene.textures.size();
    j["unread_textures"] = unread_textures(world);
    j["triangles"] = stats.triangles;
    if (*stats.quality) j["bvh_quality"] = stats.quality;
    const geometry::RefinementStats& r = world.refinement;
    if (r.displaced > 0) j["displaced_meshes"] = r.displaced;
    if (r.meshes + r.polygon_meshes > 0) {
        json& s = j["subdivision"];
        s = {{"meshes", r.meshes},
             {"polygon_meshes", r.polygon_meshes},
             {"faces", r.faces},
             {"triangles", r.triangles},
             {"bytes", r.bytes}};
        if (r.level >= 0)
            s["level"] = r.level;
        else
            s["pixels_per_edge"] = r.rate;
    }
    j["primitives"] = json::object();
    for (const auto& [kind, count] : world.geometry.primitive_counts())
        j["primitives"][kind] = count;
    return j;
}

json make_estimator_stats(const RenderJob& job) {
    const RenderArguments& a = job.arguments;
    json j;
    j["integrator"] = a.integrator;
    j["light_sampling"] = job.light_sampling;
    j["light_selection"] = job.light_selection_name;
    j["roulette"] = a.roulette;
    if (job.settings.tracer.estimator.roulette == integrator::Roulette::Cutoff)
        j["cutoff"] = job.settings.tracer.estimator.cutoff;
    j["sampler"] = a.sampler;
    j["adaptive"] = job.settings.schedule.adaptive;
    j["accelerator"] = a.accel;
    j["guiding"] = a.guiding;
    j["splitting"] = a.splitting;
    j["caustics"] = a.caustics;
    j["texture_bias"] = a.texture_bias;
    j["volume_bounds"] = a.volume_bounds;
    return j;
}

json make_guiding_stats(const integrator::GuideTraining& training) {
    json j;
    j["used"] = training.is_used;
    j["trial_variance"] = training.trial_variance;
    j["wins"] = {training.wins, integrator::GuideTraining::group_count};
    j["paths"] = training.rays.paths;
    j["cells"] = training.field.cell_count();
    return j;
}

json make_splitting_stats(const integrator::SplittingTrial& trial) {
    return {{"mean_branches", trial.map.mean()}, {"trial_paths", trial.rays.paths}};
}

json make_roulette_stats(const integrator::RouletteTrial& trial) {
    return {{"gains", trial.gains.gains}, {"trial_paths", trial.rays.paths}};
}

json make_light_tracing_stats(const integrator::LightTrial& trial, bool is_used) {
    return {{"used", is_used},
            {"photons_per_pixel", trial.emission.photons_per_pixel},
            {"trial_variance",
             {{"other", trial.other_error},
              {"caustics_by_paths", trial.path_error},
              {"caustics_by_light_tracing", trial.light_error}}},
            {"trial_rays", trial.rays.total()}};
}

json make_firefly_stats(const integrator::FireflyTrial& trial) {
    json j;
    if (std::isfinite(trial.limit)) j["limit"] = std::stod(fmt::format("{}", trial.limit));
    j["samples"] = trial.samples;
    j["error_without"] = trial.error_without;
    j["error_with"] = trial.error_with;
    j["bias"] = trial.bias;
    j["trial_paths"] = trial.rays.paths;
    return j;
}

json make_bounce_stats(const integrator::BounceTrial& trial, int last_bounce) {
    return {{"last", last_bounce}, {"shares", trial.shares}, {"trial_paths", trial.rays.paths}};
}

json make_ledger(const RenderJob& job, const FrameInput& input, const render::Renderer& renderer) {
    const integrator::World& world = renderer.world();
    const film::Film& film = renderer.film();
    json ledger = json::array();
    for (size_t i = 0; i < scene::effect_count; ++i) {
        if (input.plan.entries[i].state != integrator::EffectState::Omitted) continue;
        ledger.push_back({{"approximation", "effect-left-out"},
                          {"value", scene::info(scene::Effect(i)).name},
                          {"kind", "bias"},
                          {"effect", "the scene uses it; not measured"}});
    }
    if (const size_t unread = unread_textures(world); unread > 0) {
        ledger.push_back(
            {{"approximation", "texture-fallback"},
             {"value", unread},
             {"kind", "bias"},
             {"effect", "unreadable textures are replaced by their fallbacks; not measured"}});
    }
    if (job.settings.tracer.max_depth > 0) {
        json entry = {{"approximation", "max-depth"},
                      {"value", job.settings.tracer.max_depth},
                      {"kind", "bias"}};
        if (const auto& cut = renderer.prepass().truncation) {
            entry["missing_share"] = cut->share;
            entry["low"] = cut->low;
            entry["high"] = cut->high;
            entry["effect"] = text_of(*cut);
        } else {
            entry["effect"] = "light of longer paths is missing; not measured";
        }
        ledger.push_back(std::move(entry));
    }
    if (job.settings.tracer.estimator.roulette == integrator::Roulette::Cutoff) {
        ledger.push_back({{"approximation", "throughput-cutoff"},
                          {"value", job.settings.tracer.estimator.cutoff},
                          {"kind", "bias"},
                          {"effect",
                           "light of paths is missing below this throughput, relative to their "
                           "start; not measured"}});
    }
    if (job.settings.tracer.estimator.specular_chains_only) {
        ledger.push_back({{"approximation", "whitted"},
                          {"value", "paths end at the first non-specular hit"},
                          {"kind", "bias"},
                          {"effect", "indirect light is missing; not measured"}});
    }
    const film::LayerSet& layers = film.layer_set();
    if (layers.has_clamp()) {
        json limits;
        const RenderArguments& a = job.arguments;
        if (a.clamp_direct) limits["direct"] = *a.clamp_direct;
        if (a.clamp_indirect)
            limits["indirect"] = *a.clamp_indirect;
        else if (std::isfinite(layers.clamp_indirect))
            limits["indirect"] = std::stod(fmt::format("{}", layers.clamp_indirect));
        ledger.push_back(layers::clamp_entry(limits, film.sums()));
    }
    if (job.settings.tracer.filter == sampling::FilterKind::Mitchell) {
        ledger.push_back({{"approximation", "mitchell-ratio"},
                          {"value", "filter weights are normalized per pixel"},
                          {"kind", "consistent"},
                          {"effect", "vanishes with more samples; not measured"}});
    }
    if (job.settings.caustics == integrator::Caustics::Manifold ||
        job.settings.caustics == integrator::Caustics::SmallLights) {
        ledger.push_back({{"approximation", "caustic-trial-cap"},
                          {"value", integrator::CausticSampler::trial_cap},
                          {"kind", "bias"},
                          {"effect",
                           "probability estimates that hit this trial cap make caustics too dark; "
                           "count: numerics.caustics_capped of caustics_found in the statistics"}});
    }
    if (world.geometry.tessellated_quadrics() > 0) {
        ledger.push_back(
            {{"approximation", "tessellated-gprims"},
             {"value", world.geometry.tessellated_quadrics()},
             {"kind", "bias"},
             {"effect",
              "spheres, cylinders, cones and capsules that are emissive or strongly non-uniform "
              "are tessellated with smooth normals: silhouettes differ; not measured"}});
    }
    return ledger;
}

namespace {

std::string host_name() {
    std::array<char, 256> name{};
    return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

/// What the frame cost: since the process was started or, of several frames, since the statistics
/// of the one before.
json process_json() {
    static ProcessTimes before;
    const ProcessTimes now = process_times();
    const json j = {{"wall", now.wall_s - before.wall_s}, {"cpu", now.cpu_s - before.cpu_s}};
    before = now;
    return j;
}

json samples_json(const film::NoiseEstimate& noise,
                  const integrator::RenderResult& result,
                  const RenderJob& job) {
    json j;
    j["spp_min"] = noise.samples_min;
    j["spp_mean"] = noise.samples_mean;
    j["spp_max"] = noise.samples_max;
    j["total"] = result.rays.paths;
    j["ranges"] =
        json::array({json::array({job.settings.schedule.first_sample, result.end_sample})});
    return j;
}

json numerics_json(const film::Film& film) {
    json j;
    j["rejected"] = film.invalid_count();
    j["worst"] = json::array();
    for (const film::BadSample& b : film.bad_samples()) {
        j["worst"].push_back({{"x", b.x},
                              {"y", b.y},
                              {"s", b.sample},
                              {"reason", b.reason},
                              {"replay", std::to_string(b.x) + "," + std::to_string(b.y) + "," +
                                             std::to_string(b.sample)}});
    }
    return j;
}

}  // namespace

json make_stats(const RenderJob& job,
                const FrameInput& input,
                const integrator::World& world,
                const integrator::GuideTraining& training,
                const integrator::SplittingTrial& branches,
                const json& ledger,
                const film::Film& film,
                const film::NoiseEstimate& noise,
                const integrator::RenderResult& result) {
    const accel::AcceleratorStats accelerator = world.accelerator->stats();
    json j;
    j["header"] = {{"schema", "velatura.stats/1"}, {"app", "velatura"},
                   {"version", VELATURA_VERSION},  {"build", build_id()},
                   {"host", host_name()},          {"threads", thread_count()}};
    j["process_s"] = process_json();
    j["scene"] = make_scene_stats(input, world);
    j["phases_s"] = {{"open", input.open_s},
                     {"sync", input.translate_s},
                     {"tessellate", world.times.tessellate_s},
                     {"subdivide", world.refinement.seconds},
                     {"bvh", world.times.accelerator_s},
                     {"lights", world.times.lights_s},
                     {"guiding", training.seconds},
                     {"splitting", branches.seconds},
                     {"render", result.seconds}};
    j["memory_bytes"] = {{"peak", peak_resident_bytes()},
                         {"geometry", world.geometry.bytes()},
                         {"bvh", accelerator.bytes},
                         {"guiding", training.field.memory_bytes()},
                         {"film", film.memory_bytes()}};
    j["estimator"] = make_estimator_stats(job);
    j["guiding"] = make_guiding_stats(training);
    j["splitting"] = make_splitting_stats(branches);
    j["samples"] = samples_json(noise, result, job);
    j["rays"] = {{"camera", result.rays.camera},
                 {"shadow", result.rays.shadow},
                 {"indirect", result.rays.indirect},
                 {"caustic", result.rays.caustic}};
    j["rays_per_s"] = result.seconds > 0 ? double(result.rays.total()) / result.seconds : 0.0;
    j["paths_per_s"] = result.seconds > 0 ? double(result.rays.paths) / result.seconds : 0.0;
    const std::optional<ImageError> stated = image_error(job, film, noise, result.curve);
    json error = layers::error_json(stated);
    if (!result.layer_noise.empty())
        error["layers"] = layer_noise_json(result.layer_noise, stated ? stated->error.value : 0.0);
    error["target"] = job.settings.schedule.target_error;
    error["blocks"] = blocks_json(film, result.curve);
    error["reached"] = !budget_outcome(job, stated, result).is_missed;
    j["error"] = error;
    if (!result.curve.is_empty()) {
        j["error_curve"] = error_curve_json(result.curve);
        j["error_slope"] = slope_json(result.curve);
        if (wanted_error(job) > 0)
            j["forecast"] = forecast_json(result.curve.forecast(wanted_error(job)));
    }
    j["effects"] = effect_calls_json(input.plan, result.rays.effects);
    j["ledger"] = ledger;
    j["numerics"] = numerics_json(film);
    j["numerics"]["walks_given_up"] = result.rays.walks_abandoned;
    j["numerics"]["bodies_unmatched"] = result.rays.dielectrics_unmatched;
    j["numerics"]["bodies_too_deep"] = result.rays.dielectrics_too_deep;
    j["numerics"]["depth_limited"] = result.rays.depth_limited;
    j["numerics"]["caustics_found"] = result.rays.caustics_found;
    j["numerics"]["caustics_capped"] = result.rays.caustics_capped;
    return j;
}

}  // namespace velatura::app
