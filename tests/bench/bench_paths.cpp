// SPDX-License-Identifier: Apache-2.0
// Paths per second of a whole USD scene: what a render costs beside its rays. Usage: velatura_bench_paths [SCENE.usda]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>

#include <fmt/format.h>

#include "app/light_images.h"
#include "app/progress.h"
#include "base/tasks.h"
#include "integrator/path_tracer.h"
#include "integrator/schedule.h"
#include "integrator/world.h"
#include "translate/translate.h"

namespace {

using namespace velatura;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

film::LayerSet all_layers(const scene::Scene& scene) {
    film::LayerSet layers;
    layers.matrix_layers = layers.shadow_layers = true;
    for (const scene::LightGroup& g : scene.groups) layers.groups.push_back({g.name, g.prims, g.is_environment});
    return layers;
}

film::LayerSet beauty_only(const scene::Scene& scene) {
    film::LayerSet layers = all_layers(scene);
    layers.matrix_layers = layers.shadow_layers = layers.bounce_layers = layers.group_layers = layers.data_layers = false;
    return layers;
}

/// One render of 8 samples per pixel; prints a row.
void measure(const integrator::World& world, const film::LayerSet& layers, int threads, const std::string& what) {
    const ThreadLimit limit(threads);
    integrator::RenderOptions options;
    options.mode = integrator::RenderMode::Tile;
    options.end_sample = 8;
    const integrator::PathTracer tracer(world, layers, {});
    film::Film film({0, 0, world.scene.settings.width, world.scene.settings.height}, layers, {.final_sample_end = options.end_sample});
    const integrator::RenderResult result = integrator::run_schedule(
        film, options, [&](int x, int y, uint64_t s, film::SampleRadiance& out, integrator::RayCounts& counts) { tracer.trace(x, y, s, out, counts); }, {});
    fmt::print("{:34} {:8.3f} Mpaths/s {:8.3f} Mrays/s {:6.2f} rays/path  film {}\n", what, double(result.rays.paths) / result.seconds / 1e6,
               double(result.rays.total()) / result.seconds / 1e6, double(result.rays.total()) / double(result.rays.paths), app::format_bytes(film.memory_bytes()));
}

int run(const std::string& path) {
    Diagnostics diagnostics;
    const auto start = Clock::now();
    const Result<usd::stage::Stage> stage = usd::stage::Stage::open(path, {}, diagnostics);
    if (!stage) {
        fmt::print(stderr, "error: {} [{}]\n", stage.error().message, stage.error().code);
        return 1;
    }
    const double open_s = seconds_since(start);
    translate::TranslateOptions options;
    options.resolution = std::array<int, 2>{320, 180};
    options.time = stage->start_time_code();
    const auto translate_start = Clock::now();
    const Result<scene::Scene> scene = translate::translate_stage(*stage, options, diagnostics);
    if (!scene) {
        fmt::print(stderr, "error: {} [{}]\n", scene.error().message, scene.error().code);
        return 1;
    }
    const double translate_s = seconds_since(translate_start);
    const integrator::World world(*scene, {.width = 320, .height = 180}, app::make_light_image_loader(), diagnostics);
    for (const Diagnostic& d : diagnostics.all()) fmt::print(stderr, "{}\n", diagnostics.format(d));
    const accel::AcceleratorStats stats = world.accelerator->stats();
    fmt::print("{}: {} triangles, {} instances, {} lights\n", path, stats.triangles, stats.instances, scene->lights.size());
    fmt::print("open {:.3f} s, translate {:.3f} s, tessellate {:.3f} s, BVH {:.3f} s ({}, {:.1f} B/triangle), lights {:.3f} s, peak {}\n", open_s, translate_s,
               world.times.tessellate_s, world.times.accelerator_s, app::format_bytes(stats.bytes), double(stats.bytes) / double(std::max<size_t>(1, stats.triangles)),
               world.times.lights_s, app::format_bytes(app::peak_resident_bytes()));
    measure(world, all_layers(*scene), 0, "warm-up, all threads, all layers");
    measure(world, all_layers(*scene), 0, fmt::format("{} threads, all layers", thread_count()));
    measure(world, beauty_only(*scene), 0, fmt::format("{} threads, beauty alone", thread_count()));
    measure(world, all_layers(*scene), 1, "1 thread, all layers");
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    // `./dev bench` passes its arguments to every program; only a scene is meant for this one
    const std::string argument = argc > 1 ? argv[1] : "";
    const bool is_scene = argument.find(".usd") != std::string::npos;
    return run(is_scene ? argument : std::string(VELATURA_SOURCE_DIR) + "/scenes/atelier/atelier.usda");
}
