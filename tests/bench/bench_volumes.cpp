// SPDX-License-Identifier: Apache-2.0
// Volumes, one thread: time to the same error with bounds brick by brick and with one bound for a
// whole grid, as delta tracking has it in its simplest form. Usage: velatura_bench_volumes
// [SCENE.usda [FRAME]]; without arguments the smoke of OpenUSD's tests, and a cloud with dense
// cores that is made here.
#include "../media/grid_fixtures.h"
#include "base/tasks.h"
#include "cpu_clock.h"
#include "render/renderer.h"
#include "render/volume_loading.h"
#include "test_assets.h"
#include "translate/translate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace {

using namespace velatura;

constexpr int width = 120, height = 90;
constexpr uint64_t samples = 32;
constexpr int rounds = 4;

struct Image {
    std::vector<double> beauty;
    double seconds = 0;  ///< of CPU time
    double lookups = 0;  ///< per path
};

Image render(const scene::Scene& scene, media::Majorants majorants, uint64_t seed) {
    render::Settings settings;
    settings.layers = render::with_rows({}, scene);
    settings.world = {.width = width, .height = height, .media = {.majorants = majorants}};
    settings.tracer.seed = settings.schedule.seed = seed;
    settings.schedule.end_sample = samples;
    settings.guiding = integrator::Guiding::Off;
    settings.splits = false;
    Diagnostics diagnostics;
    render::Renderer renderer(scene, std::move(settings));
    renderer.prepare(diagnostics);
    const double start = bench::thread_seconds();
    const integrator::RenderResult result = renderer.advance();
    const film::Film& film = renderer.film();
    Image image;
    image.seconds = bench::thread_seconds() - start;
    image.lookups =
        double(result.rays.effects.of(scene::Effect::Volumes)) / double(result.rays.paths);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const accumulate::Triple t =
                film.sums().total(x, y, accumulate::AccumulatorTable::beauty);
            for (const double v : {t.x, t.y, t.z}) image.beauty.push_back(v / double(samples));
        }
    return image;
}

/// Relative squared error of one image, by two of them.
double error_of(const Image& a, const Image& b) {
    double sum = 0;
    for (size_t i = 0; i < a.beauty.size(); ++i) {
        const double mean = 0.5 * (a.beauty[i] + b.beauty[i]),
                     difference = a.beauty[i] - b.beauty[i];
        sum += 0.5 * difference * difference / (mean * mean + 0.01);
    }
    return sum / double(a.beauty.size());
}

struct Sum {
    double seconds = 0, error = 0, lookups = 0;
};

/// The smoke, or what is asked for; nothing where it is not there.
std::optional<scene::Scene> load(const std::string& path, double frame) {
    Diagnostics diagnostics;
    const Result<usd::stage::Stage> stage = usd::stage::Stage::open(path, {}, diagnostics);
    if (!stage) {
        fmt::print("skipped: {}\n", stage.error().message);
        return std::nullopt;
    }
    translate::TranslateOptions options;
    options.resolution = std::array<int, 2>{width, height};
    options.time = frame;
    Result<scene::Scene> scene = translate::translate_stage(*stage, options, diagnostics);
    if (scene) render::load_volumes(*scene, {}, diagnostics);
    for (const Diagnostic& d : diagnostics.all())
        if (d.severity == Severity::Error) fmt::print(stderr, "{}\n", diagnostics.format(d));
    if (!scene || scene->volumes.empty()) return std::nullopt;
    return std::move(*scene);
}

/// Haze with a few cores a hundred times as dense, 192 voxels each way.
scene::Scene cloud() {
    constexpr int n = 192;
    scene::Scene scene;
    const auto density = [](int x, int y, int z) {
        const Vec3 p = Vec3(float(x), float(y), float(z)) * (2.0f / n) - Vec3(1.0f);
        float cores = 0.0f;
        for (const Vec3& center :
             {Vec3(0.3f, 0.2f, 0.1f), Vec3(-0.4f, 0.0f, -0.2f), Vec3(0.0f, -0.4f, 0.3f)})
            cores += std::exp(-(p - center).dot(p - center) * 150.0f);
        return p.length() < 0.9f ? 0.5f + 100.0f * cores : 0.0f;
    };
    scene.volume_fields.emplace_back().voxels = std::make_shared<const scene::VoxelGrid>(
        media::testing::make_voxel_grid(scene::Vec3i(n), 2.0f / n, density));
    scene::Volume& volume = scene.volumes.emplace_back();
    volume.density = 0;
    volume.optics.albedo = Rgb(0.9f);
    volume.render_from_volume.translate(Vec3d(-1.0, -1.0, -5.0));
    scene.groups = {{"sun", {}, false}, {"emissive", {}, false}};
    scene::Light& sun = scene.lights.emplace_back();
    sun.kind = scene::LightKind::Distant;
    sun.angle_deg = 0.0f;
    sun.Le = Rgb(10.0f);
    sun.render_from_light.rotate(Vec3d(-0.8, 0.6, 0.0));
    scene.camera.window_right = 0.4;
    scene.camera.window_left = -0.4;
    scene.camera.window_top = 0.3;
    scene.camera.window_bottom = -0.3;
    scene.settings.width = width;
    scene.settings.height = height;
    return scene;
}

void measure(const std::string& name, const scene::Scene& scene) {
    // Both by turns, so that a busy machine is as unkind to the one as to the other
    std::array<Sum, 2> sums;
    constexpr std::array kinds = {media::Majorants::Bricks, media::Majorants::One};
    for (int round = 0; round < rounds; ++round) {
        for (size_t k = 0; k < kinds.size(); ++k) {
            const Image a = render(scene, kinds[k], uint64_t(2 * round)),
                        b = render(scene, kinds[k], uint64_t(2 * round + 1));
            sums[k].seconds += a.seconds + b.seconds;
            sums[k].lookups += 0.5 * (a.lookups + b.lookups);
            sums[k].error += error_of(a, b);
        }
    }
    fmt::print("{}\n{:>22} {:>12} {:>16} {:>12} {:>20}\n", name, "bounds", "CPU s",
               "lookups a path", "relMSE", "s to relMSE 1e-3");
    std::array<double, 2> to_error = {};
    constexpr std::array names = {"brick by brick", "one for the grid"};
    for (size_t k = 0; k < kinds.size(); ++k) {
        const double seconds = sums[k].seconds / (2 * rounds), error = sums[k].error / rounds;
        to_error[k] = seconds * error / 1e-3;
        fmt::print("{:>22} {:>12.3f} {:>16.1f} {:>12.3g} {:>20.2f}\n", names[k], seconds,
                   sums[k].lookups / rounds, error, to_error[k]);
    }
    fmt::print("brick by brick the same error takes 1/{:.2f} of the time\n",
               to_error[1] / to_error[0]);
}

}  // namespace

int main(int argc, char** argv) {
    const ThreadLimit limit(1);
    const std::string path =
        argc > 1 ? argv[1]
                 : (test_assets() /
                    "openusd/imaging/testUsdImagingGLVdbVolume/vdbVolumeFallbackMaterial.usda")
                       .string();
    if (const auto scene = load(path, argc > 2 ? std::atof(argv[2]) : 2.0)) measure(path, *scene);
    if (argc == 1) measure("cloud with dense cores", cloud());
    return 0;
}
