// SPDX-License-Identifier: Apache-2.0
#include "lux_render.h"

#include "base/check.h"
#include "image/formats.h"
#include "integrator/schedule.h"
#include "test_assets.h"
#include "translate/translate.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace velatura::test {

namespace {

constexpr int image_size = 1 << 16;
constexpr int window_size = 12;
constexpr uint64_t fewest_samples = 64, max_samples = 16384;

Result<lights::EnvironmentImage> load_light_image(const scene::Light& light) {
    const Result<image::RgbImage> read = image::read_rgb_image(light.texture_file);
    if (!read) return read.error();
    lights::EnvironmentImage out{read->width, read->height, {}};
    for (size_t i = 0; i < read->pixels.size(); i += 3)
        out.texels.emplace_back(read->pixels[i], read->pixels[i + 1], read->pixels[i + 2]);
    return out;
}

}  // namespace

std::filesystem::path luxtest_folder() {
    return test_assets() / "luxtest";
}

usd::stage::Stage open_stage(const std::filesystem::path& path) {
    static Diagnostics diagnostics;  // must outlive every stage
    Result<usd::stage::Stage> stage = usd::stage::Stage::open(path.string(), {}, diagnostics);
    for (const Diagnostic& d : diagnostics.all()) ADD_FAILURE() << diagnostics.format(d);
    VELATURA_CHECK(stage.has_value(), "a sheet does not open");
    return std::move(*stage);
}

scene::Scene translate_frame(const usd::stage::Stage& stage,
                             double frame,
                             std::set<std::string>& warnings) {
    Diagnostics diagnostics;
    translate::TranslateOptions options;
    options.time = frame;
    options.resolution = std::array<int, 2>{image_size, image_size};
    Result<scene::Scene> scene = translate::translate_stage(stage, options, diagnostics);
    for (const Diagnostic& d : diagnostics.all()) {
        if (d.severity == Severity::Error) ADD_FAILURE() << diagnostics.format(d);
        warnings.insert(d.code);
    }
    VELATURA_CHECK(scene.has_value(), "a sheet does not translate");
    return std::move(*scene);
}

LuxImage read_image(const std::filesystem::path& path) {
    const Result<image::RgbImage> read = image::read_rgb_image(path.string());
    VELATURA_CHECK(read.has_value(), "the picture of a sheet cannot be read");
    LuxImage out{read->width, read->height, {}};
    for (size_t i = 0; i < read->pixels.size(); i += 3) {
        out.texels.emplace_back(double(read->pixels[i]), double(read->pixels[i + 1]),
                                double(read->pixels[i + 2]));
    }
    return out;
}

bool expect_texel(const LuxImage& image, int x, int y, const Vec3d& seen) {
    if (x == 0 || y == 0 || x == image.width - 1 || y == image.height - 1) return false;
    Vec3d low = image.at(x, y), high = low;
    for (int j = y - 1; j <= y + 1; ++j) {
        for (int i = x - 1; i <= x + 1; ++i) {
            for (int c = 0; c < 3; ++c) {
                low[c] = std::min(low[c], image.at(i, j)[c]);
                high[c] = std::max(high[c], image.at(i, j)[c]);
            }
        }
    }
    if ((high - low).length() > 0.1 * high.length()) return false;
    for (int c = 0; c < 3; ++c) {
        EXPECT_GE(seen[c], low[c] - 1e-6) << x << ", " << y;
        EXPECT_LE(seen[c], high[c] + 1e-6) << x << ", " << y;
    }
    return true;
}

FrameRenderer::FrameRenderer(const scene::Scene& scene) : scene_(scene) {
    layers_.last_bounce = 1;
    layers_.group_layers = layers_.data_layers = false;
    for (const scene::LightGroup& g : scene.groups)
        layers_.groups.push_back({g.name, g.prims, g.is_environment});
    Diagnostics diagnostics;
    world_ = std::make_unique<integrator::World>(
        scene, integrator::WorldOptions{.width = image_size, .height = image_size},
        load_light_image, diagnostics);
    for (const Diagnostic& d : diagnostics.all()) ADD_FAILURE() << diagnostics.format(d);
    tracer_ = std::make_unique<integrator::PathTracer>(
        *world_, layers_,
        integrator::PathTracerOptions{
            .seed = 1, .max_depth = 1, .filter = sampling::FilterKind::Box});
}

std::optional<Vec2d> FrameRenderer::pixel_of(const Vec3d& direction) const {
    const scene::Camera& camera = scene_.camera;
    const Vec3d v = transform_direction(direction, camera.render_from_camera.inverse());
    if (!(v.z < 0)) return std::nullopt;
    const double x = (v.x / -v.z - camera.window_left) / (camera.window_right - camera.window_left);
    const double y = (camera.window_top - v.y / -v.z) / (camera.window_top - camera.window_bottom);
    if (!(x > 0.01 && x < 0.99 && y > 0.01 && y < 0.99)) return std::nullopt;
    return Vec2d(x * image_size, y * image_size);
}

Vec3d FrameRenderer::direction_of(const Vec2d& pixel) const {
    const scene::Camera& camera = scene_.camera;
    const double x =
        camera.window_left + (camera.window_right - camera.window_left) * pixel.x / image_size;
    const double y =
        camera.window_top - (camera.window_top - camera.window_bottom) * pixel.y / image_size;
    return transform_direction(Vec3d(x, y, -1), camera.render_from_camera);
}

RadianceEstimate FrameRenderer::render(const PixelWindow& window,
                                       int bounce,
                                       uint64_t samples) const {
    const int x = window.x, y = window.y;
    film::Film film({x, y, x + window_size, y + window_size}, layers_);
    integrator::RenderOptions schedule;
    schedule.mode = integrator::RenderMode::Tile;
    schedule.end_sample = samples;
    integrator::run_schedule(
        film, schedule,
        [this](int i, int j, uint64_t s, film::SampleRadiance& out, integrator::RayCounts& counts) {
            tracer_->trace(i, j, s, out, counts);
        },
        {});
    EXPECT_EQ(film.invalid_count(), 0u);
    const double n = window_size * window_size;
    Vec3d sum(0.0), squares(0.0);
    for (int j = y; j < y + window_size; ++j) {
        for (int i = x; i < x + window_size; ++i) {
            const accumulate::Triple t =
                film.sums().total(i, j, film.sums().table().bounce(bounce));
            const Vec3d v = Vec3d(t.x, t.y, t.z) / double(samples);
            sum += v;
            squares += v * v;
        }
    }
    RadianceEstimate out;
    out.mean = sum / n;
    for (int c = 0; c < 3; ++c) {
        const double variance = std::max(0.0, squares[c] / n - out.mean[c] * out.mean[c]);
        out.standard_error[c] = std::sqrt(variance / (n - 1));
    }
    return out;
}

RadianceEstimate FrameRenderer::measure(const PixelWindow& window,
                                        int bounce,
                                        const Vec3d& visible_error) const {
    for (uint64_t samples = fewest_samples;; samples *= 4) {
        const RadianceEstimate out = render(window, bounce, samples);
        bool is_enough = true;
        for (int c = 0; c < 3; ++c)
            is_enough &= detectable_sigmas * out.standard_error[c] <= visible_error[c];
        if (is_enough || samples >= max_samples) return out;
    }
}

PixelWindow FrameRenderer::window_at(const Vec3d& p, const Vec3d& normal) const {
    const Vec3d& eye = scene_.camera.world_position;
    const auto pixel = pixel_of(p - eye);
    VELATURA_CHECK(pixel.has_value(), "the camera does not see a point of the test");
    PixelWindow out{int(pixel->x) - window_size / 2, int(pixel->y) - window_size / 2, {}};
    const Vec3d d = direction_of(Vec2d(out.x, out.y) + Vec2d(window_size / 2.0));
    out.position = eye - d * (eye.dot(normal) / d.dot(normal));
    return out;
}

PixelWindow FrameRenderer::window_along(double x, double y) const {
    PixelWindow out{int(x * image_size), int(y * image_size), {}};
    out.position = direction_of(Vec2d(out.x, out.y) + Vec2d(window_size / 2.0)).normalized();
    return out;
}

std::optional<Vec3d> FrameRenderer::see(const Vec3d& direction) const {
    const auto pixel = pixel_of(direction);
    if (!pixel) return std::nullopt;
    return render({int(pixel->x) - window_size / 2, int(pixel->y) - window_size / 2, {}}, 0, 1)
        .mean;
}

void expect_patch_irradiance(
    scene::Scene scene, const Vec3d& p, const Vec3d& n, const Vec3d& expected, double bound) {
    scene::Material white;
    white.has_specular = false;
    white.diffuse_color = scene::Input(Rgb(1.0f));
    scene.materials.push_back(white);
    const Vec3d a = n.cross(std::abs(n.x) < 0.7 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0)).normalized();
    const Vec3d b = n.cross(a);
    scene::Mesh mesh;
    for (const Vec2d& corner : {Vec2d(-1, -1), Vec2d(1, -1), Vec2d(1, 1), Vec2d(-1, 1)})
        mesh.points.push_back(to_float(p + (a * corner.x + b * corner.y) * 0.01));
    mesh.face_vertex_counts = {4};
    mesh.face_vertex_indices = {0, 1, 2, 3};
    scene::Shape shape;
    shape.geometry = mesh;
    shape.material = scene::MaterialId(scene.materials.size() - 1);
    scene.shapes.push_back(shape);

    // Look at it along its normal, from so near that no light comes in between
    scene::Camera& camera = scene.camera;
    camera.world_position += p + n * 0.01;
    for (scene::Light& light : scene.lights)
        for (int i = 0; i < 3; ++i) light.render_from_light[3][i] -= (p + n * 0.01)[i];
    auto& points = std::get<scene::Mesh>(scene.shapes.back().geometry).points;
    for (Vec3& point : points) point -= to_float(p + n * 0.01);
    camera.clip_near = camera.clip_far = 0;
    for (int i = 0; i < 3; ++i) {
        camera.render_from_camera[0][i] = a[i];
        camera.render_from_camera[1][i] = b[i];
        camera.render_from_camera[2][i] = n[i];
    }
    const FrameRenderer renderer(scene);
    const RadianceEstimate e =
        renderer.measure(renderer.window_along(0.5, 0.5), 1, expected * (bound / pi_d));
    for (int c = 0; c < 3; ++c) {
        const double error = pi_d * e.standard_error[c], value = pi_d * e.mean[c];
        fmt::print(
            "patch facing ({:4.1f}, {:4.1f}, {:4.1f}) channel {}: {:.6g} expected {:.6g} "
            "detectable {:.1e}\n",
            n.x, n.y, n.z, c, value, expected[c], detectable_sigmas * error / expected[c]);
        EXPECT_LE(std::abs(value - expected[c]), std::max(4 * error, 1e-4 * expected[c]));
        EXPECT_LE(std::abs(value - expected[c]), bound * expected[c]);
        EXPECT_LE(detectable_sigmas * error, bound * expected[c]);
    }
}

}  // namespace velatura::test
