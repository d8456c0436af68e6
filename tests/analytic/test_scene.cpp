// SPDX-License-Identifier: Apache-2.0
#include "test_scene.h"

#include "hard_case.h"
#include "render/renderer.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

namespace velatura::test {

TestScene::TestScene() {
    scene.groups.push_back({"emissive", {}, false});
    look_at_point(1e-4);
    scene.camera.clip_near = 0;
}

scene::MaterialId TestScene::add_material(const scene::Material& material) {
    scene.materials.push_back(material);
    return scene::MaterialId(scene.materials.size() - 1);
}

scene::MaterialId TestScene::add_matte(const Rgb& albedo, const Rgb& emission) {
    scene::Material material;
    material.has_specular = false;
    material.diffuse_color = scene::Input(albedo);
    material.emissive_color = scene::Input(emission);
    return add_material(material);
}

void TestScene::add_square(float z, float half_size, scene::MaterialId material) {
    scene::Mesh mesh;
    mesh.points = {{-half_size, -half_size, z},
                   {half_size, -half_size, z},
                   {half_size, half_size, z},
                   {-half_size, half_size, z}};
    mesh.face_vertex_counts = {4};
    mesh.face_vertex_indices = {0, 1, 2, 3};
    scene::Shape shape;
    shape.geometry = mesh;
    shape.material = material;
    scene.shapes.push_back(shape);
}

void TestScene::add_sphere(const Vec3& center, double radius, scene::MaterialId material) {
    scene::Gprim sphere;
    sphere.kind = scene::Gprim::Kind::Sphere;
    sphere.radius = radius;
    sphere.shape_from_gprim.setTranslation(Vec3d(center));
    scene::Shape shape;
    shape.geometry = sphere;
    shape.material = material;
    scene.shapes.push_back(shape);
}

void TestScene::add_box(const Vec3& low, const Vec3& high, scene::MaterialId material) {
    scene::Mesh mesh;
    for (int i = 0; i < 8; ++i)
        mesh.points.emplace_back(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y,
                                 i & 4 ? high.z : low.z);
    mesh.face_vertex_counts = {4, 4, 4, 4, 4, 4};
    mesh.face_vertex_indices = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4,
                                2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
    scene::Shape shape;
    shape.geometry = mesh;
    shape.material = material;
    scene.shapes.push_back(shape);
}

void TestScene::add_faceted_ball(float radius, scene::MaterialId material) {
    constexpr int rings = 12, segments = 16;
    scene::Mesh mesh;
    for (int i = 0; i <= rings; ++i) {
        const float theta = pi * float(i) / float(rings);
        for (int j = 0; j < segments; ++j) {
            const float phi = 2.0f * pi * float(j) / float(segments);
            mesh.points.push_back(Vec3(std::sin(theta) * std::cos(phi), std::cos(theta),
                                       std::sin(theta) * std::sin(phi)) *
                                  radius);
        }
    }
    // The rings at the poles have no width, so that their quadrangles are triangles
    for (int j = 0; j < segments; ++j) mesh.points[size_t(j)] = Vec3(0, radius, 0);
    for (int j = 0; j < segments; ++j)
        mesh.points[size_t(rings * segments + j)] = Vec3(0, -radius, 0);
    for (uint32_t i = 0; i < rings; ++i) {
        for (uint32_t j = 0; j < segments; ++j) {
            const uint32_t next = (j + 1) % segments;
            mesh.face_vertex_counts.push_back(4);
            for (const uint32_t v : {i * segments + j, i * segments + next,
                                     (i + 1) * segments + next, (i + 1) * segments + j})
                mesh.face_vertex_indices.push_back(v);
        }
    }
    scene::Shape shape;
    shape.geometry = mesh;
    shape.material = material;
    scene.shapes.push_back(shape);
}

void TestScene::make_instance(const Mat4& render_from_prototype) {
    scene.prototypes.push_back({"/Lamp", {scene.shapes.back()}});
    scene.shapes.pop_back();
    scene::Instance instance;
    instance.prototype = uint32_t(scene.prototypes.size() - 1);
    instance.render_from_prototype = render_from_prototype;
    scene.instances.push_back(instance);
}

scene::MeshLight& TestScene::make_mesh_light() {
    scene::MeshLight light;
    light.name = fmt::format("/MeshLight{}", scene.mesh_lights.size());
    light.group = scene::GroupId(scene.groups.size() - 1);
    scene.groups.insert(
        scene.groups.end() - 1,
        {fmt::format("meshlight{}", scene.mesh_lights.size()), {light.name}, false});
    scene.shapes.back().light = scene::MeshLightId(scene.mesh_lights.size());
    scene.mesh_lights.push_back(light);
    return scene.mesh_lights.back();
}

scene::Light& TestScene::add_light(scene::LightKind kind, const Mat4d& render_from_light) {
    scene::Light light;
    light.kind = kind;
    light.name = fmt::format("/Light{}", scene.lights.size());
    light.group = scene::GroupId(scene.groups.size() - 1);
    light.render_from_light = render_from_light;
    light.is_camera_visible = false;
    scene.groups.insert(scene.groups.end() - 1, {fmt::format("light{}", scene.lights.size()),
                                                 {light.name},
                                                 kind == scene::LightKind::Dome});
    scene.lights.push_back(light);
    return scene.lights.back();
}

void TestScene::look_at_point(double half_window) {
    scene.camera.projection = scene::Camera::Projection::Orthographic;
    scene.camera.window_left = scene.camera.window_bottom = -half_window;
    scene.camera.window_right = scene.camera.window_top = half_window;
}

void TestScene::look_with_perspective(double half_window) {
    look_at_point(half_window);
    scene.camera.projection = scene::Camera::Projection::Perspective;
}

TestScene closed_room(float albedo, float Le) {
    TestScene test;
    test.add_box(Vec3(-1.0f, -0.7f, -1.2f), Vec3(0.9f, 0.8f, 1.1f),
                 test.add_matte(Rgb(albedo), Rgb(Le)));
    test.look_with_perspective(0.5);
    return test;
}

RenderedLayers render(const TestScene& test, const TestRenderOptions& options) {
    render::Settings settings;
    settings.layers.last_bounce = options.last_bounce;
    settings.layers.matrix_layers = true;
    settings.layers.shadow_layers = options.shadow_layers;
    settings.layers = render::with_rows(std::move(settings.layers), test.scene);
    settings.world = {.width = options.size,
                      .height = options.size,
                      .light_selection = options.light_selection,
                      .media = options.media,
                      .samples_light_area = options.samples_light_area};
    settings.tracer = {.seed = options.seed,
                       .max_depth = options.max_depth,
                       .filter = sampling::FilterKind::Box,
                       .estimator = options.estimator,
                       .sampler = options.sampler,
                       .roulette = options.roulette};
    settings.caustics = options.caustics;
    settings.guiding = integrator::Guiding::Off;
    settings.splits = false;
    settings.schedule.mode = integrator::RenderMode::Tile;
    settings.schedule.tile_size = 16;
    settings.schedule.end_sample = options.samples;
    const int groups = int(settings.layers.groups.size());
    Diagnostics diagnostics;
    render::Renderer renderer(test.scene, std::move(settings));
    renderer.prepare(diagnostics);
    const integrator::RenderResult result = renderer.advance();
    RenderedLayers out{renderer.take_film(), groups};
    out.rays = result.rays;
    for (const Diagnostic& d : diagnostics.all()) ADD_FAILURE() << diagnostics.format(d);
    EXPECT_EQ(out.film.invalid_count(), 0u);
    return out;
}

namespace {

/// Mean and standard error over pixels of the sum of the accumulators, per sample.
Estimate over_pixels(const film::Film& film,
                     const std::vector<uint32_t>& accumulators,
                     int channel) {
    const film::Window& w = film.window();
    double sum = 0, sum_of_squares = 0;
    const double n = double(w.pixel_count());
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            double v = 0;
            for (const uint32_t a : accumulators) {
                const accumulate::Triple sum_of_samples = film.sums().total(x, y, a);
                v += channel == 0   ? sum_of_samples.x
                     : channel == 1 ? sum_of_samples.y
                                    : sum_of_samples.z;
            }
            const accumulate::PixelRecord& record = film.sums().record(x, y);
            v /= double(record.end - record.first);
            sum += v;
            sum_of_squares += v * v;
        }
    }
    const double mean = sum / n;
    const double variance = std::max(0.0, sum_of_squares / n - mean * mean) * n / (n - 1.0);
    return {mean, std::sqrt(variance / n)};
}

}  // namespace

Estimate over_seeds(const TestScene& test,
                    TestRenderOptions options,
                    int seeds,
                    const std::function<double(const RenderedLayers&)>& number) {
    double sum = 0, squares = 0;
    for (int i = 0; i < seeds; ++i) {
        options.seed = uint64_t(i) + 1;
        const double v = number(render(test, options));
        sum += v;
        squares += v * v;
    }
    const double mean = sum / seeds;
    return {mean, std::sqrt(std::max(0.0, squares / seeds - mean * mean) / (seeds - 1))};
}

Estimate RenderedLayers::bounce(int column, int group, int channel) const {
    std::vector<uint32_t> cells;
    for (int g = 0; g < groups; ++g) {
        if (group < 0 || g == group) cells.push_back(film.sums().table().matrix(column, g));
    }
    return over_pixels(film, cells, channel);
}

Estimate RenderedLayers::beauty(int channel) const {
    return over_pixels(film, {accumulate::AccumulatorTable::beauty}, channel);
}

Estimate RenderedLayers::unoccluded(int group, int channel) const {
    return over_pixels(film, {film.sums().table().unoccluded(group)}, channel);
}

void expect_close(const Estimate& e, double expected, double relative, const std::string& what) {
    const double scale = expected != 0.0 ? std::abs(expected) : 1.0;
    fmt::print(
        "{:52} measured {:.7g} expected {:.7g} deviation {:+.2e} detectable {:.2e} bound {:.0e}\n",
        what, e.mean, expected, (e.mean - expected) / scale, e.detectable() / scale, relative);
    // Rounding in float is no noise: below 1e-6 the standard error says nothing
    EXPECT_LE(std::abs(e.mean - expected), std::max(4.0 * e.standard_error, 1e-6 * scale)) << what;
    EXPECT_LE(std::abs(e.mean - expected), relative * scale) << what;
    EXPECT_LE(e.detectable(), relative * scale)
        << what << ": the test could not see its bound; more samples are needed";
    hardcase::expect_in_hard_case({what + ", relative", std::abs(e.mean - expected) / scale,
                                   relative, e.detectable() / scale, "closed form"});
}

scene::Material smooth_glass(float ior) {
    scene::Material m;
    m.diffuse_color = scene::Input(Rgb(0.0f));
    m.opacity = scene::Input(0.0f);
    m.roughness = scene::Input(0.0f);
    m.ior = scene::Input(ior);
    return m;
}

scene::Material mirror(const Rgb& reflectance) {
    scene::Material m;
    m.diffuse_color = scene::Input(reflectance);
    m.metallic = scene::Input(1.0f);
    m.roughness = scene::Input(0.0f);
    return m;
}

Mat4d at(const Vec3d& where) {
    Mat4d m;
    m.setTranslation(where);
    return m;
}

void expect_agreement(const RenderedLayers& a,
                      const RenderedLayers& b,
                      double relative,
                      const std::string& what) {
    const film::Window& w = a.film.window();
    const double count = double(w.pixel_count());
    double sum = 0, squares = 0, level = 0;
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const double mine = a.film.sums().total(x, y, accumulate::AccumulatorTable::beauty).x;
            const double other = b.film.sums().total(x, y, accumulate::AccumulatorTable::beauty).x;
            sum += mine - other;
            squares += (mine - other) * (mine - other);
            level += other;
        }
    }
    const double error = std::sqrt((squares - sum * sum / count) / (count - 1) * count);
    fmt::print("{:<60} {:+.2f} standard errors, detectable {:.2g}\n", what, sum / error,
               5.2816 * error / level);
    EXPECT_LE(std::abs(sum), 4.0 * error) << what;
    EXPECT_LE(5.2816 * error, relative * level) << what << ": the test could not see its bound";
    hardcase::expect_in_hard_case({what + ", relative", std::abs(sum) / level, relative,
                                   5.2816 * error / level, "second method, other noise"});
}

}  // namespace velatura::test
