// SPDX-License-Identifier: Apache-2.0
// A room with a window under a dome: portals change the noise of the image and nothing else.
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::test {

namespace {

constexpr float half_room = 2.0f, half_window = 0.25f;

void add_quad(
    TestScene& test, const Vec3& corner, const Vec3& x, const Vec3& y, scene::MaterialId material) {
    scene::Mesh mesh;
    mesh.points = {corner, corner + x, corner + x + y, corner + y};
    mesh.face_vertex_counts = {4};
    mesh.face_vertex_indices = {0, 1, 2, 3};
    scene::Shape shape;
    shape.geometry = mesh;
    shape.material = material;
    test.scene.shapes.push_back(shape);
}

/// A cube around the camera with a square window in the middle of its ceiling (+Y).
TestScene room() {
    TestScene test;
    const auto gray = test.add_matte(Rgb(0.5f));
    const float h = half_room, w = half_window;
    add_quad(test, {-h, -h, -h}, {2 * h, 0, 0}, {0, 2 * h, 0}, gray);
    add_quad(test, {-h, -h, h}, {2 * h, 0, 0}, {0, 2 * h, 0}, gray);
    add_quad(test, {-h, -h, -h}, {0, 0, 2 * h}, {0, 2 * h, 0}, gray);
    add_quad(test, {h, -h, -h}, {0, 0, 2 * h}, {0, 2 * h, 0}, gray);
    add_quad(test, {-h, -h, -h}, {2 * h, 0, 0}, {0, 0, 2 * h}, gray);
    add_quad(test, {-h, h, -h}, {2 * h, 0, 0}, {0, 0, h - w}, gray);
    add_quad(test, {-h, h, w}, {2 * h, 0, 0}, {0, 0, h - w}, gray);
    add_quad(test, {-h, h, -w}, {h - w, 0, 0}, {0, 0, 2 * w}, gray);
    add_quad(test, {w, h, -w}, {h - w, 0, 0}, {0, 0, 2 * w}, gray);
    test.add_light(scene::LightKind::Dome, Mat4d());
    test.look_with_perspective(0.7);
    return test;
}

/// Faces down through the window.
Mat4d portal() {
    const double side = 2.0 * double(half_window);
    return Mat4d(side, 0, 0, 0, 0, 0, side, 0, 0, 1, 0, 0, 0, double(half_room), 0, 1);
}

/// Means of the images of independent seeds.
struct Runs {
    double mean = 0, variance = 0;  ///< of one run
    int count = 0;
};

Runs runs_of(const TestScene& test, int first_seed) {
    Runs runs;
    constexpr int count = 24;
    double sum = 0, squares = 0;
    for (int i = 0; i < count; ++i) {
        const double mean = render(test, {.size = 12,
                                          .samples = 128,
                                          .last_bounce = 1,
                                          .max_depth = 2,
                                          .seed = uint64_t(first_seed + i)})
                                .beauty()
                                .mean;
        sum += mean;
        squares += mean * mean;
    }
    runs.count = count;
    runs.mean = sum / count;
    runs.variance = (squares - sum * runs.mean) / (count - 1);
    return runs;
}

}  // namespace

TEST(Portal, ChangesTheNoiseAndNotTheImage) {
    const TestScene plain = room();
    TestScene guided = plain;
    guided.scene.lights[0].render_from_portals = {portal()};
    TestScene misplaced = plain;
    Mat4d turned = portal();
    for (int c = 0; c < 3; ++c) turned[2][c] = -turned[2][c];
    turned[3][0] = 0.5;
    misplaced.scene.lights[0].render_from_portals = {turned};

    const Runs without = runs_of(plain, 100), with = runs_of(guided, 200),
               beside = runs_of(misplaced, 300);
    for (const Runs& other : {with, beside}) {
        const double error = std::sqrt((without.variance + other.variance) / without.count);
        fmt::print(
            "room without portal {:.5g}, with {:.5g}: {:+.2f} standard errors, detectable {:.2g}; "
            "variance {:.3g} and {:.3g}\n",
            without.mean, other.mean, (other.mean - without.mean) / error,
            5.28 * error / without.mean, without.variance, other.variance);
        EXPECT_LE(std::abs(other.mean - without.mean), 4.0 * error);
        EXPECT_LE(5.28 * error, 0.15 * without.mean);
    }
    EXPECT_LT(with.variance * 4.0, without.variance);
}

TEST(Portal, FlushWithAWallThatSeesTheSkyBesideIt) {
    // The wall fills the half space behind it; the portal lies in its plane, far to the side, so
    // that nothing comes through it: the wall shows albedo times the even sky
    TestScene test;
    add_quad(test, {-1.0f, -1.0f, -3.0f}, {2, 0, 0}, {0, 2, 0}, test.add_matte(Rgb(0.5f)));
    // Shines towards +Z, the camera's side
    test.add_light(scene::LightKind::Dome, Mat4d()).render_from_portals = {
        Mat4d(-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 3, 0, -3, 1)};
    test.look_at_point(0.01);
    for (const auto strategy : {integrator::LightSampling::Mis, integrator::LightSampling::Light,
                                integrator::LightSampling::Bsdf}) {
        expect_close(render(test, {.size = 16,
                                   .samples = 1024,
                                   .last_bounce = 1,
                                   .estimator = {.light_sampling = strategy}})
                         .beauty(),
                     0.5, 5e-3, "wall beside a flush portal");
    }
}

}  // namespace velatura::test
