// SPDX-License-Identifier: Apache-2.0
// Whole renders, one thread: paths per second, where the time goes, and the bound that the same
// rays alone set. Usage: velatura_bench_paths [SCENE.usda…]; without arguments the scenes of
// scenes/ and two of velatura_bench_rays.
#include "base/tasks.h"
#include "bench_scenes.h"
#include "cpu_clock.h"
#include "path_profile.h"
#include "recorded_rays.h"
#include "render/renderer.h"
#include "translate/translate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

namespace {

using namespace velatura;

constexpr int width = 160, height = 90;
constexpr uint64_t sample_count = 64;
constexpr uint64_t recorded_samples = 4;
constexpr int rounds = 3;

/// Those of the program, without its file, but as many samples in every pixel: as those recorded.
render::Settings settings_of(const scene::Scene& scene) {
    render::Settings settings;
    settings.layers.matrix_layers = settings.layers.shadow_layers = true;
    settings.layers = render::with_rows(std::move(settings.layers), scene);
    settings.world = {.width = width, .height = height, .expected_rays = 1e8};
    settings.schedule.end_sample = sample_count;
    return settings;
}

/// Own trees that keep the rays they are asked about.
class RecordingFactory final : public accel::AcceleratorFactory {
  public:
    Result<std::unique_ptr<accel::Accelerator>> build(const accel::SoupScene& soup) const override {
        traced_ = accel::build_bvh(soup);
        auto recorder = std::make_unique<bench::RayRecorder>(*traced_);
        recorder_ = recorder.get();
        return std::unique_ptr<accel::Accelerator>(std::move(recorder));
    }

    bench::RayRecorder& recorder() const { return *recorder_; }

  private:
    mutable std::unique_ptr<accel::Accelerator> traced_;
    mutable bench::RayRecorder* recorder_ = nullptr;
};

/// A scene of velatura_bench_rays with one gray material and its light.
scene::Scene minimal_scene(const bench::BenchScene& from) {
    scene::Scene scene;
    scene::Mesh mesh;
    // The camera is the origin of render space
    for (const Vec3& p : from.direct.positions) mesh.points.push_back(p - from.eye);
    for (const auto& triangle : from.direct.triangles) {
        mesh.face_vertex_counts.push_back(3);
        mesh.face_vertex_indices.insert(mesh.face_vertex_indices.end(), triangle.begin(),
                                        triangle.end());
    }
    scene.shapes.push_back({std::move(mesh)});
    scene.groups = {{"light", {}, false}, {"emissive", {}, false}};

    const auto set_row = [](Mat4d& m, int row, const Vec3d& v) {
        for (int k = 0; k < 3; ++k) m[row][k] = v[k];
    };
    // The light shines along −Z, towards what the camera looks at
    scene::Light light;
    light.kind = scene::LightKind::Rect;
    light.Le = Rgb(8.0f);
    Vec3d x(from.light_x), y(from.light_y);
    const Vec3d corner(from.light - from.eye), center = corner + (x + y) * 0.5;
    if (x.cross(y).dot(Vec3d(from.target - from.eye) - center) > 0.0) std::swap(x, y);
    set_row(light.render_from_light, 0, x);
    set_row(light.render_from_light, 1, y);
    set_row(light.render_from_light, 2, normalize(x.cross(y)));
    set_row(light.render_from_light, 3, center);
    scene.lights.push_back(light);

    const Vec3d back = normalize(Vec3d(from.eye) - Vec3d(from.target));
    const Vec3d right = normalize(Vec3d(0, 1, 0).cross(back));
    set_row(scene.camera.render_from_camera, 0, right);
    set_row(scene.camera.render_from_camera, 1, back.cross(right));
    set_row(scene.camera.render_from_camera, 2, back);
    scene.camera.window_left = -0.7;
    scene.camera.window_right = 0.7;
    scene.camera.window_top = 0.7 * height / width;
    scene.camera.window_bottom = -scene.camera.window_top;
    scene.settings.width = width;
    scene.settings.height = height;
    return scene;
}

std::optional<scene::Scene> load(const std::string& path) {
    Diagnostics diagnostics;
    const Result<usd::stage::Stage> stage = usd::stage::Stage::open(path, {}, diagnostics);
    if (!stage) {
        fmt::print(stderr, "error: {} [{}]\n", stage.error().message, stage.error().code);
        return std::nullopt;
    }
    translate::TranslateOptions options;
    options.resolution = std::array<int, 2>{width, height};
    options.time = stage->start_time_code();
    Result<scene::Scene> scene = translate::translate_stage(*stage, options, diagnostics);
    for (const Diagnostic& d : diagnostics.all()) fmt::print(stderr, "{}\n", diagnostics.format(d));
    if (scene) return std::move(scene).value();
    fmt::print(stderr, "error: {} [{}]\n", scene.error().message, scene.error().code);
    return std::nullopt;
}

/// What is measured of one scene.
struct Row {
    std::string name;
    double path_s = 0;  ///< of CPU time
    double instructions = 0;
    bench::Shares shares{};
    double rays = 0;                          ///< per path
    double alone_s = 0;                       ///< of tracing them alone, per path
    double shadow_gain = 1, bounce_gain = 1;  ///< of tracing in batches, over one by one
    double best_gain = 1;                     ///< of the whole render by both
};

class Measurement {
  public:
    Measurement(std::string name, const scene::Scene& scene)
        : scene_(scene), renderer_(scene, settings_of(scene)) {
        renderer_.prepare(diagnostics_);
        for (const Diagnostic& d : diagnostics_.all())
            fmt::print(stderr, "{}\n", diagnostics_.format(d));
        row_.name = std::move(name);
    }

    Row run() {
        const ThreadLimit limit(1);
        row_.shares = bench::profile([this] { render(); });
        row_.instructions = bench::instructions_of([this] { render(); }) / double(path_count_);
        const std::vector<bench::RecordedRay> rays = record();
        const auto recorded_paths = double(width * height) * double(recorded_samples);
        row_.rays = double(rays.size()) / recorded_paths;

        std::vector<double> whole_s;
        for (int i = 0; i < rounds; ++i) {
            const double start = bench::thread_seconds();
            render();
            whole_s.push_back((bench::thread_seconds() - start) / double(path_count_));
        }
        std::sort(whole_s.begin(), whole_s.end());
        row_.path_s = whole_s[rounds / 2];

        const bench::ReplayTimes alone = bench::replay(rays, *renderer_.world().accelerator);
        row_.alone_s = alone.all_s / recorded_paths;
        row_.shadow_gain = alone.shadow_s / alone.batched_shadow_s;
        row_.bounce_gain = alone.bounce_s / alone.batched_bounce_s;
        const double shadow_saved = std::max(0.0, alone.shadow_s - alone.batched_shadow_s);
        const double bounce_saved = std::max(0.0, alone.bounce_s - alone.batched_bounce_s);
        row_.best_gain =
            row_.path_s / (row_.path_s - (shadow_saved + bounce_saved) / recorded_paths);
        return row_;
    }

  private:
    void render() {
        renderer_.start_film({.final_sample_end = sample_count});
        path_count_ = renderer_.advance().rays.paths;
    }

    /// The rays of a few samples of every pixel, pixel by pixel as the schedule goes.
    std::vector<bench::RecordedRay> record() {
        const RecordingFactory trees;
        render::Settings settings = settings_of(scene_);
        settings.world.accelerator = &trees;
        render::Renderer recorded(scene_, std::move(settings));
        Diagnostics told_before;
        recorded.prepare(told_before);
        bench::RayRecorder& rays = trees.recorder();
        rays.clear();
        film::SampleRadiance radiance(recorded.layers());
        integrator::RayCounts counts;
        constexpr int tile = 32;
        for (int ty = 0; ty < height; ty += tile) {
            for (int tx = 0; tx < width; tx += tile) {
                for (int y = ty; y < std::min(ty + tile, height); ++y) {
                    for (int x = tx; x < std::min(tx + tile, width); ++x) {
                        for (uint64_t s = 0; s < recorded_samples; ++s) {
                            rays.begin_path();
                            radiance.clear();
                            recorded.tracer().trace(x, y, s, radiance, counts);
                        }
                    }
                }
            }
        }
        return rays.rays();
    }

    const scene::Scene& scene_;
    Diagnostics diagnostics_;
    render::Renderer renderer_;
    uint64_t path_count_ = 1;  ///< of the last render, those of the pilot included
    Row row_;
};

void print(const std::vector<Row>& rows) {
    std::string header = "| scene | paths/s | instructions per path |", line = "|---|---|---|";
    for (size_t p = 0; p < size_t(bench::Part::Count); ++p) {
        header += fmt::format(" {} |", bench::name_of(bench::Part(p)));
        line += "---|";
    }
    fmt::print("\n{}\n{}\n", header, line);
    for (const Row& r : rows) {
        fmt::print("| {} | {:.3f} M | {} |", r.name, 1e-6 / r.path_s,
                   r.instructions > 0 ? fmt::format("{:.0f}", r.instructions) : "–");
        for (const double share : r.shares) fmt::print(" {:.0f} % |", 100 * share);
        fmt::print("\n");
    }
    fmt::print(
        "\n| scene | rays per path | alone, Mrays/s | bound, paths/s | reached | shadow rays in "
        "batches | bounce rays in batches | whole render at best |\n");
    fmt::print("|---|---|---|---|---|---|---|---|\n");
    for (const Row& r : rows) {
        fmt::print("| {} | {:.2f} | {:.2f} | {:.3f} M | {:.0f} % | {:.2f} | {:.2f} | {:.2f} |\n",
                   r.name, r.rays, 1e-6 * r.rays / r.alone_s, 1e-6 / r.alone_s,
                   100 * r.alone_s / r.path_s, r.shadow_gain, r.bounce_gain, r.best_gain);
    }
}

}  // namespace

int main(int argc, char** argv) {
    // `./dev bench` passes its arguments to every program; only scenes are meant for this one
    std::vector<std::string> paths;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        if (argument.find(".usd") != argument.npos) paths.push_back(argument);
    }
    const bool is_whole = paths.empty();
    if (is_whole) {
        for (const char* name : {"atelier/atelier", "sky/sky", "cornell/cornell", "transport/sun",
                                 "transport/lens", "transport/glass", "transport/many_lights"})
            paths.push_back(fmt::format("{}/scenes/{}.usda", VELATURA_SOURCE_DIR, name));
    }
    std::vector<Row> rows;
    for (const std::string& path : paths) {
        const std::optional<scene::Scene> scene = load(path);
        if (!scene) return 1;
        const size_t slash = path.rfind('/') + 1;
        rows.push_back(Measurement(path.substr(slash, path.rfind('.') - slash), *scene).run());
        fmt::print(stderr, "{}: {:.3f} Mpaths/s\n", rows.back().name, 1e-6 / rows.back().path_s);
    }
    for (const bench::SceneMaker& maker : bench::all_scenes()) {
        const std::string name = maker.name;
        if (!is_whole || (name != "museum" && name != "statue")) continue;
        const scene::Scene scene = minimal_scene(maker.make());
        rows.push_back(Measurement(name, scene).run());
        fmt::print(stderr, "{}: {:.3f} Mpaths/s\n", name, 1e-6 / rows.back().path_s);
    }
    print(rows);
    return 0;
}
