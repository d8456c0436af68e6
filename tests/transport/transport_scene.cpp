// SPDX-License-Identifier: Apache-2.0
#include "transport/transport_scene.h"

#include "app/light_images.h"
#include "base/check.h"
#include "base/tasks.h"
#include "image/pixel_means.h"
#include "integrator/branch_trial.h"
#include "integrator/roulette_trial.h"
#include "integrator/schedule.h"
#include "translate/translate.h"
#include "usd/stage/stage.h"

#include <fmt/format.h>

#include <array>

namespace velatura::test {

const std::vector<Technique>& techniques() {
    using integrator::LightSampling;
    using integrator::PathTracerOptions;
    using integrator::Roulette;
    using integrator::WorldOptions;
    static const std::vector<Technique> table = {
        {"default", "", [](WorldOptions&, PathTracerOptions&) {}, integrator::Caustics::Path},
        {"light sampling alone", "MIS",
         [](WorldOptions& w, PathTracerOptions& p) {
             p.estimator.light_sampling = LightSampling::Light;
             w.compensate_mis = false;
         }},
        {"BSDF sampling alone", "light sampling",
         [](WorldOptions& w, PathTracerOptions& p) {
             p.estimator.light_sampling = LightSampling::Bsdf;
             w.compensate_mis = false;
         }},
        {"lights by area", "solid angles of lights",
         [](WorldOptions& w, PathTracerOptions& p) {
             p.estimator.light_sampling = LightSampling::Light;
             w.samples_light_area = true;
             w.compensate_mis = false;
         }},
        {"area of all lights", "solid angles of lights",
         [](WorldOptions& w, PathTracerOptions& p) {
             p.estimator.light_sampling = LightSampling::Light;
             w.samples_light_area = true;
             w.light_selection = lights::SelectionKind::Area;
             w.compensate_mis = false;
         }},
        {"hemisphere sampling", "light sampling",
         [](WorldOptions& w, PathTracerOptions& p) {
             p.estimator.light_sampling = LightSampling::Hemisphere;
             w.compensate_mis = false;
         }},
        {"hemisphere by cosine", "light sampling",
         [](WorldOptions& w, PathTracerOptions& p) {
             p.estimator.light_sampling = LightSampling::Cosine;
             w.compensate_mis = false;
         }},
        {"no MIS compensation", "MIS compensation",
         [](WorldOptions& w, PathTracerOptions&) { w.compensate_mis = false; }},
        {"lights by power", "light tree",
         [](WorldOptions& w, PathTracerOptions&) {
             w.light_selection = lights::SelectionKind::Power;
         }},
        {"lights uniformly", "light tree",
         [](WorldOptions& w, PathTracerOptions&) {
             w.light_selection = lights::SelectionKind::Uniform;
         }},
        {"constant roulette", "roulette by throughput",
         [](WorldOptions&, PathTracerOptions& p) { p.estimator.roulette = Roulette::Constant; }},
        {"roulette by albedo", "roulette by throughput",
         [](WorldOptions&, PathTracerOptions& p) { p.estimator.roulette = Roulette::Albedo; }},
        {"roulette by efficiency", "roulette by throughput",
         [](WorldOptions&, PathTracerOptions& p) { p.estimator.roulette = Roulette::Efficiency; }},
        {"stratified samples", "Owen-Sobol' points",
         [](WorldOptions&, PathTracerOptions& p) {
             p.sampler = sampling::SamplerKind::Stratified;
         }},
        {"independent samples", "Owen-Sobol' points",
         [](WorldOptions&, PathTracerOptions& p) {
             p.sampler = sampling::SamplerKind::Independent;
         }},
        {"blue noise", "white noise",
         [](WorldOptions&, PathTracerOptions& p) { p.sampler = sampling::SamplerKind::BlueNoise; }},
        {"two halves", "one sequence per pixel",
         [](WorldOptions&, PathTracerOptions& p) {
             p.sampler = sampling::SamplerKind::SobolHalves;
         }},
        {"paths in four", "paths go on by one",
         [](WorldOptions&, PathTracerOptions& p) {
             static const integrator::BranchMap four(4);
             p.branches = &four;
         }},
        {"caustics solved for", "caustics by paths", [](WorldOptions&, PathTracerOptions&) {},
         integrator::Caustics::Manifold},
    };
    return table;
}

const Technique& default_technique() {
    return techniques().front();
}

const std::vector<std::string>& transport_scenes() {
    static const std::vector<std::string> table = {
        "cornell/cornell",        "transport/sun",        "transport/wide_sun",
        "transport/many_lights",  "transport/lamp_sizes", "transport/lens",
        "transport/glass",        "transport/caustic",    "transport/baffle",
        "transport/glowing_mesh", "transport/gloss",      "transport/window",
        "transport/sheets",       "transport/linked",     "transport/doorway",
    };
    return table;
}

scene::Scene load_scene(const std::string& name, int width, int height) {
    Diagnostics diagnostics;
    const std::string path = std::string(VELATURA_SOURCE_DIR) + "/scenes/" + name + ".usda";
    const Result<usd::stage::Stage> stage = usd::stage::Stage::open(path, {}, diagnostics);
    VELATURA_CHECK(stage.has_value(), "a scene of the project does not open");
    translate::TranslateOptions options;
    options.resolution = std::array<int, 2>{width, height};
    options.time = stage->start_time_code();
    Result<scene::Scene> scene = translate::translate_stage(*stage, options, diagnostics);
    for (const Diagnostic& d : diagnostics.all()) fmt::print(stderr, "{}\n", diagnostics.format(d));
    VELATURA_CHECK(scene.has_value() && diagnostics.error_count() == 0,
                   "a scene of the project has errors");
    return std::move(*scene);
}

TransportRenderer::TransportRenderer(const scene::Scene& scene, const Technique& technique)
    : scene_(scene) {
    integrator::WorldOptions world;
    world.width = scene.settings.width;
    world.height = scene.settings.height;
    technique.change(world, options_);
    Diagnostics diagnostics;
    world_ = std::make_unique<integrator::World>(scene, world, app::make_light_image_loader(),
                                                 diagnostics);
    for (const Diagnostic& d : diagnostics.all()) fmt::print(stderr, "{}\n", diagnostics.format(d));
    caustics_ = integrator::make_caustic_sampler(technique.caustics, *world_);
    options_.caustics = caustics_.get();
    if (options_.estimator.roulette == integrator::Roulette::Efficiency) {
        gains_ = integrator::try_roulette(*world_, options_).gains;
        options_.roulette = &gains_;
    }
}

film::LayerSet TransportRenderer::beauty_layers() const {
    film::LayerSet layers;
    layers.matrix_layers = layers.shadow_layers = layers.bounce_layers = layers.group_layers =
        layers.data_layers = false;
    for (const scene::LightGroup& g : scene_.groups)
        layers.groups.push_back({g.name, g.prims, g.is_environment});
    layers.normalise_names();
    return layers;
}

film::Film TransportRenderer::render_film(uint64_t seed,
                                          uint64_t samples,
                                          const Placement& placement,
                                          const film::LayerSet& layers) {
    integrator::PathTracerOptions tracer_options = options_;
    tracer_options.seed = seed;
    if (layers.halves) tracer_options.sampler = sampling::SamplerKind::SobolHalves;
    const integrator::GuideTraining training =
        integrator::train_guide(*world_, tracer_options, placement.guiding);
    was_guided_ = training.is_used;
    if (training.is_used) tracer_options.guide = &training.field;
    const integrator::BranchTrial branches =
        placement.splits
            ? integrator::try_branches(*world_, tracer_options,
                                       {0, 0, scene_.settings.width, scene_.settings.height})
            : integrator::BranchTrial();
    mean_branches_ = branches.map.mean();
    tracer_options.branches = &branches.map;
    const integrator::PathTracer tracer(*world_, layers, tracer_options);
    integrator::RenderOptions options;
    options.seed = seed;
    options.end_sample = samples;
    options.has_independent_halves = layers.halves;
    options.adaptive = placement.is_adaptive;
    options.target_error = placement.target_error;
    integrator::RenderCallbacks callbacks;
    callbacks.snapshot = placement.after_pass;
    callbacks.snapshot_requested = [] { return true; };
    const int width = scene_.settings.width, height = scene_.settings.height;
    film::Film film({0, 0, width, height}, layers,
                    {.final_sample_end = integrator::most_samples(options)});
    const integrator::RenderResult result = integrator::run_schedule(
        film, options,
        [&](int x, int y, uint64_t s, film::SampleRadiance& out, integrator::RayCounts& counts) {
            tracer.trace(x, y, s, out, counts);
        },
        callbacks);
    curve_ = result.curve;
    rays_ += result.rays;
    rays_ += training.rays;
    rays_ += branches.rays;
    bad_ += film.invalid_count();
    return film;
}

Pixels TransportRenderer::render_scheduled(uint64_t seed,
                                           uint64_t samples,
                                           const Placement& placement) {
    const std::vector<float> rgba =
        image::resolve_rgba(render_film(seed, samples, placement, beauty_layers()).sums());
    Pixels pixels;
    pixels.reserve(rgba.size() / 4 * 3);
    for (size_t i = 0; i < rgba.size(); i += 4)
        pixels.insert(pixels.end(), {double(rgba[i]), double(rgba[i + 1]), double(rgba[i + 2])});
    return pixels;
}

Pixels TransportRenderer::render(uint64_t seed, uint64_t samples) {
    const film::LayerSet layers = beauty_layers();
    integrator::PathTracerOptions options = options_;
    options.seed = seed;
    const integrator::PathTracer tracer(*world_, layers, options);

    // Every row sums its own pixels, so that the result does not depend on the threads
    const int width = scene_.settings.width, height = scene_.settings.height;
    Pixels pixels(size_t(width) * size_t(height) * 3);
    std::vector<integrator::RayCounts> rays{size_t(height)};
    std::vector<uint64_t> bad(size_t(height), 0);
    parallel_for(size_t(height), [&](size_t y) {
        film::SampleRadiance out(layers);
        for (int x = 0; x < width; ++x) {
            double* pixel = &pixels[(y * size_t(width) + size_t(x)) * 3];
            for (uint64_t s = 0; s < samples; ++s) {
                out.clear();
                tracer.trace(x, int(y), s, out, rays[y]);
                if (out.is_bad()) {
                    ++bad[y];
                    continue;
                }
                const Rgb L = out.radiance();
                for (int c = 0; c < 3; ++c)
                    pixel[c] += double(out.weight) * double(L[c]) / double(samples);
            }
        }
    });
    for (const integrator::RayCounts& r : rays) rays_ += r;
    for (const uint64_t b : bad) bad_ += b;
    return pixels;
}

Pixels mean_of(const std::vector<Pixels>& estimates) {
    Pixels mean(estimates.front().size());
    for (const Pixels& e : estimates) {
        for (size_t i = 0; i < mean.size(); ++i) mean[i] += e[i] / double(estimates.size());
    }
    return mean;
}

}  // namespace velatura::test
