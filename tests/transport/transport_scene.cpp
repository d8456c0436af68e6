// SPDX-License-Identifier: Apache-2.0
#include "transport/transport_scene.h"

#include "accumulate/pixel_means.h"
#include "base/check.h"
#include "base/tasks.h"
#include "render/load_scene.h"

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
        {"constant roulette", "roulette by efficiency",
         [](WorldOptions&, PathTracerOptions& p) { p.estimator.roulette = Roulette::Constant; }},
        {"roulette by albedo", "roulette by efficiency",
         [](WorldOptions&, PathTracerOptions& p) { p.estimator.roulette = Roulette::Albedo; }},
        {"roulette by throughput", "roulette by efficiency",
         [](WorldOptions&, PathTracerOptions& p) { p.estimator.roulette = Roulette::Throughput; }},
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
             static const integrator::SplittingMap four(4);
             p.branches = &four;
         }},
        {"caustics solved for", "caustics by paths", [](WorldOptions&, PathTracerOptions&) {},
         integrator::Caustics::Manifold},
        {"caustics by light tracing", "caustics by paths", [](WorldOptions&, PathTracerOptions&) {},
         integrator::Caustics::Light},
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
    const std::string path = std::string(VELATURA_SOURCE_DIR) + "/scenes/" + name + ".usda";
    render::LoadOptions options;
    options.translate.resolution = std::array<int, 2>{width, height};
    Diagnostics diagnostics;
    Result<scene::Scene> scene = render::load_scene(path, options, diagnostics);
    for (const Diagnostic& d : diagnostics.all()) fmt::print(stderr, "{}\n", diagnostics.format(d));
    VELATURA_CHECK(scene.has_value() && diagnostics.error_count() == 0,
                   "a scene of the project has errors");
    return std::move(*scene);
}

TransportRenderer::TransportRenderer(const scene::Scene& scene, const Technique& technique)
    : scene_(scene) {
    settings_.caustics = technique.caustics;
    settings_.guiding = integrator::Guiding::Off;
    settings_.splits = false;
    settings_.layers = beauty_layers();
    technique.change(settings_.world, settings_.tracer);
    Diagnostics diagnostics;
    renderer_ = std::make_unique<render::Renderer>(scene, settings_);
    renderer_->prepare(diagnostics);
    for (const Diagnostic& d : diagnostics.all()) fmt::print(stderr, "{}\n", diagnostics.format(d));
}

film::LayerSet TransportRenderer::beauty_layers() const {
    film::LayerSet layers;
    layers.matrix_layers = layers.shadow_layers = layers.bounce_layers = layers.group_layers =
        layers.data_layers = false;
    return render::with_rows(std::move(layers), scene_);
}

film::Film TransportRenderer::render_film(uint64_t seed,
                                          uint64_t samples,
                                          const Placement& placement,
                                          const film::LayerSet& layers) {
    render::Settings settings = settings_;
    settings.layers = layers;
    settings.tracer.seed = settings.schedule.seed = seed;
    if (layers.halves) settings.tracer.sampler = sampling::SamplerKind::SobolHalves;
    settings.guiding = placement.guiding;
    settings.splits = placement.splits;
    settings.schedule.end_sample = samples;
    settings.schedule.has_independent_halves = layers.halves;
    settings.schedule.adaptive = placement.is_adaptive;
    settings.schedule.target_error = placement.target_error;
    integrator::RenderCallbacks callbacks;
    callbacks.snapshot = placement.after_pass;
    callbacks.snapshot_requested = [] { return true; };
    render::Renderer renderer(renderer_->shared_world(), std::move(settings));
    renderer.learn();
    renderer.start_film({.final_sample_end = integrator::max_samples(renderer.schedule())});
    const render::PrepassResults& prepass = renderer.prepass();
    was_guided_ = prepass.guide.is_used;
    mean_branches_ = prepass.branches.map.mean();
    const integrator::RenderResult result = renderer.advance(callbacks);
    curve_ = result.curve;
    rays_ += result.rays;
    rays_ += prepass.guide.rays;
    rays_ += prepass.branches.rays;
    if (prepass.roulette) rays_ += prepass.roulette->rays;
    bad_ += renderer.film().invalid_count();
    return renderer.take_film();
}

Pixels TransportRenderer::render_scheduled(uint64_t seed,
                                           uint64_t samples,
                                           const Placement& placement) {
    const std::vector<float> rgba =
        accumulate::resolve_rgba(render_film(seed, samples, placement, beauty_layers()).sums());
    Pixels pixels;
    pixels.reserve(rgba.size() / 4 * 3);
    for (size_t i = 0; i < rgba.size(); i += 4)
        pixels.insert(pixels.end(), {double(rgba[i]), double(rgba[i + 1]), double(rgba[i + 2])});
    return pixels;
}

Pixels TransportRenderer::render(uint64_t seed, uint64_t samples) {
    // Photons come with the passes of a film
    if (settings_.caustics == integrator::Caustics::Light)
        return render_scheduled(
            seed, samples,
            {.is_adaptive = false, .guiding = integrator::Guiding::Off, .splits = false});
    const film::LayerSet layers = beauty_layers();
    const std::unique_ptr<const integrator::PathTracer> tracer = renderer_->make_tracer(seed);

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
                tracer->trace(x, int(y), s, out, rays[y]);
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
