// SPDX-License-Identifier: Apache-2.0
// What rows and lobes cost: 1,000 lamps, each a row of the matrix or of the lobe matrix, against
// the same lamps in one row of the matrix. The paths are the same, so that the difference is what
// the film does. CPU time of one thread; rounds interleaved, medians of their ratios. Usage:
// velatura_bench_layers [LAMPS [SIZE [SAMPLES]]]
#include "base/tasks.h"
#include "cpu_clock.h"
#include "film/film.h"
#include "film/lobe_layers.h"
#include "render/renderer.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <vector>

namespace {

using namespace velatura;

constexpr int round_count = 7;

/// Plastic, metal, glass, and plastic under a coat.
std::vector<scene::Material> materials() {
    std::vector<scene::Material> list(4);
    list[0].name = "/Plastic";
    list[1].name = "/Metal";
    list[1].metallic = scene::Input(1.0f);
    list[2].name = "/Glass";
    list[2].opacity = scene::Input(0.0f);
    list[3].name = "/Coated";
    list[3].clearcoat = scene::Input(1.0f);
    list[3].clearcoat_roughness = scene::Input(0.2f);
    return list;
}

/// A floor of 20 units full of balls and a wall behind it under a grid of small lamps; every lamp
/// has a row of its own.
scene::Scene scene_of(int lamps, int size) {
    scene::Scene scene;
    scene::Mesh corner;
    corner.face_vertex_counts = {4, 4};
    corner.face_vertex_indices = {0, 1, 2, 3, 3, 2, 5, 4};
    corner.points = {Vec3(-10, -4, 6),   Vec3(10, -4, 6),   Vec3(10, -4, -14),
                     Vec3(-10, -4, -14), Vec3(-10, 6, -14), Vec3(10, 6, -14)};
    scene::Shape shape;
    shape.geometry = corner;
    scene.shapes.push_back(shape);
    scene.materials = materials();
    for (int i = 0; i < 400; ++i) {
        shape.material = scene::MaterialId(i % 4);
        scene::Gprim ball;
        ball.kind = scene::Gprim::Kind::Sphere;
        ball.radius = 0.35;
        ball.shape_from_gprim.setTranslation(Vec3d(i % 20 - 9.5, -3.65, i / 20 - 13.5));
        shape.geometry = ball;
        scene.shapes.push_back(shape);
    }
    const int side = int(std::ceil(std::sqrt(double(lamps))));
    for (int i = 0; i < lamps; ++i) {
        scene::Light lamp;
        lamp.kind = scene::LightKind::Sphere;
        lamp.radius = 0.05f;
        lamp.Le = Rgb(5.0f + float(i % 7));
        const double x = 20.0 * (i % side + 0.5) / side - 10,
                     z = 20.0 * (i / side + 0.5) / side - 14;
        lamp.render_from_light.setTranslation(Vec3d(x, -3.5 + 0.4 * (i % 5), z));
        lamp.group = scene::GroupId(i);
        lamp.name = fmt::format("/L{}", i);
        scene.groups.push_back({fmt::format("L{}", i), {lamp.name}, false});
        scene.lights.push_back(lamp);
    }
    scene.groups.push_back({"emissive", {}, false});
    scene.settings.width = scene.settings.height = size;
    return scene;
}

/// All lamps in one row.
scene::Scene in_one_row(scene::Scene scene) {
    for (scene::Light& l : scene.lights) l.group = 0;
    scene.groups = {{"rest", {}, false}, {"emissive", {}, false}};
    return scene;
}

struct Measured {
    double render_s = 0, write_s = 0;
    size_t film_bytes = 0, file_bytes = 0;
};

enum class Cells : uint8_t { Matrix, LobeMatrix };

Measured measure(const scene::Scene& scene, uint64_t samples, bool writes, Cells cells) {
    render::Settings settings;
    settings.layers.shadow_layers = true;
    settings.layers.matrix_layers = cells == Cells::Matrix;
    settings.layers.bounce_layers = settings.layers.group_layers = false;
    if (cells == Cells::LobeMatrix) settings.layers.path_layers = film::lobes_of_matrix();
    settings.layers = render::with_rows(std::move(settings.layers), scene);
    settings.tracer.seed = 1;
    settings.schedule.end_sample = samples;
    settings.guiding = integrator::Guiding::Off;
    settings.splits = false;
    Diagnostics diagnostics;
    render::Renderer renderer(scene, std::move(settings));
    renderer.prepare(diagnostics);
    renderer.start_film({.final_sample_end = samples});
    const film::Film& film = renderer.film();
    Measured m;
    double start = bench::cpu_seconds();
    renderer.advance();
    m.render_s = bench::cpu_seconds() - start;
    m.film_bytes = film.memory_bytes();
    if (!writes) return m;
    const auto file = std::filesystem::temp_directory_path() /
                      fmt::format("velatura_bench_layers_{}.exr", ::getpid());
    start = bench::cpu_seconds();
    if (!film.write(file.string(), {})) std::exit(1);
    m.write_s = bench::cpu_seconds() - start;
    m.file_bytes = std::filesystem::file_size(file);
    std::filesystem::remove(file);
    return m;
}

double median(std::vector<double> v) {
    std::nth_element(v.begin(), v.begin() + std::ptrdiff_t(v.size() / 2), v.end());
    return v[v.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
    const ThreadLimit one(1);
    const int lamps = argc > 1 ? std::atoi(argv[1]) : 1000,
              size = argc > 2 ? std::atoi(argv[2]) : 128;
    const auto samples = argc > 3 ? uint64_t(std::atoll(argv[3])) : 64;
    const scene::Scene rows = scene_of(lamps, size), row = in_one_row(rows);
    std::vector<double> of_rows, of_lobes, seconds;
    for (int round = 0; round < round_count; ++round) {
        const double alone = measure(row, samples, false, Cells::Matrix).render_s,
                     many = measure(rows, samples, false, Cells::Matrix).render_s,
                     lobes = measure(rows, samples, false, Cells::LobeMatrix).render_s;
        of_rows.push_back(many / alone);
        of_lobes.push_back(lobes / alone);
        seconds.push_back(alone);
    }
    fmt::print("{} lamps, {} x {} pixels, {} samples, cells and shadow layers of 6 columns\n",
               lamps, size, size, samples);
    fmt::print("rendering   one row {:8.3f} s   a row for each {:.3f} x   and 6 lobes {:.3f} x\n",
               median(seconds), median(of_rows), median(of_lobes));
    std::fflush(stdout);
    const Measured alone = measure(row, samples, true, Cells::Matrix),
                   many = measure(rows, samples, true, Cells::Matrix),
                   lobes = measure(rows, samples, true, Cells::LobeMatrix);
    fmt::print("film        one row {:8.1f} MB  a row for each {:.1f} MB  and 6 lobes {:.1f} MB\n",
               double(alone.film_bytes) * 1e-6, double(many.film_bytes) * 1e-6,
               double(lobes.film_bytes) * 1e-6);
    fmt::print("file        one row {:8.1f} MB  a row for each {:.1f} MB  and 6 lobes {:.1f} MB\n",
               double(alone.file_bytes) * 1e-6, double(many.file_bytes) * 1e-6,
               double(lobes.file_bytes) * 1e-6);
    fmt::print("writing     one row {:8.3f} s   a row for each {:.3f} s   and 6 lobes {:.3f} s\n",
               alone.write_s, many.write_s, lobes.write_s);
}
