// SPDX-License-Identifier: Apache-2.0
// Fibers in the light of whole scenes.
#include "shading/hair.h"

#include "../sampling/chi_square.h"
#include "geometry/fiber.h"
#include "integrator/specular_chain.h"
#include "integrator/world.h"
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::test {

namespace {

using integrator::LightSampling;
using sampling::testing::TestRandom;

scene::Material hair_of(const Rgb& sigma_a, float roughness = 0.3f) {
    scene::Material m;
    m.has_specular = false;
    m.hair.emplace();
    m.hair->absorber = scene::Hair::Absorber::Coefficient;
    m.hair->absorption = scene::Input(sigma_a);
    m.hair->roughness = m.hair->azimuthal_roughness = scene::Input(roughness);
    return m;
}

/// A straight one, of constant width.
void add_strand(TestScene& test,
                const Vec3& from,
                const Vec3& to,
                float width,
                scene::MaterialId material,
                bool is_flat = false) {
    scene::Curves curves;
    curves.basis = scene::Curves::Basis::Linear;
    curves.vertex_counts = {2};
    curves.points = {from, to};
    curves.widths = {width};
    if (is_flat) {
        curves.normals = {Vec3(0, 0, 1)};
        curves.normal_interpolation = scene::Interpolation::Constant;
    }
    scene::Shape shape;
    shape.material = material;
    shape.geometry = curves;
    test.scene.shapes.push_back(shape);
}

void add_dome(TestScene& test) {
    test.add_light(scene::LightKind::Dome, Mat4d()).is_camera_visible = true;
}

integrator::World world_of(const TestScene& test) {
    Diagnostics diagnostics;
    return integrator::World(test.scene, {.width = 8, .height = 8}, {}, diagnostics);
}

}  // namespace

TEST(H14Curves, WhiteHairIsOne) {
    // By BSDF sampling alone every path brings 1, whatever it meets on its way
    using Basis = scene::Curves::Basis;
    for (int kind = 0; kind < 6; ++kind) {
        TestScene test;
        scene::Curves curves;
        curves.basis = Basis::Bezier;
        curves.vertex_counts = {4, 4};
        curves.points = {Vec3(-1.5f, -1, -4),      Vec3(-0.5f, 0.5f, -4.5f),
                         Vec3(0.5f, -0.5f, -3.5f), Vec3(1, 1, -4),
                         Vec3(-1.5f, 1, -4.2f),    Vec3(-0.5f, -0.5f, -4.5f),
                         Vec3(0.5f, 0.5f, -3.7f),  Vec3(1, -1, -4)};
        curves.widths = {kind % 2 ? 0.3f : 0.8f};
        if (kind >= 4) {
            curves.normals = {Vec3(0.5f, 0, 1)};
            curves.normal_interpolation = scene::Interpolation::Constant;
        }
        scene::Shape shape;
        shape.material = test.add_material(hair_of(Rgb(0.0f), kind < 2 ? 0.1f : 0.4f));
        shape.geometry = curves;
        test.scene.shapes.push_back(shape);
        if (kind % 2) {
            Mat4d placed;
            placed.setScale(Vec3d(1.2, -0.7, 1.0));
            test.make_instance(Mat4(placed));
        }
        add_dome(test);
        test.look_with_perspective(0.5);
        const Estimate bsdf = render(test, {.size = 32,
                                            .samples = 32,
                                            .estimator = {.light_sampling = LightSampling::Bsdf,
                                                          .roulette = integrator::Roulette::None}})
                                  .beauty();
        expect_close(bsdf, 1.0, 1e-5, fmt::format("white hair {}, by its own samples", kind));
        expect_close(render(test, {.size = 32, .samples = 64}).beauty(), 1.0, 5e-3,
                     fmt::format("white hair {}", kind));
    }
}

// One fiber alone: what it does not absorb of a white dome, over its width
TEST(Hair, AbsorbsByTheWayThrough) {
    const Rgb sigma_a(0.2f, 0.6f, 2.0f);
    for (const bool is_flat : {false, true}) {
        TestScene test;
        const double slope = 0.5;
        add_strand(test, Vec3(0, -20, -4 + float(20 * slope)), Vec3(0, 20, -4 - float(20 * slope)),
                   0.5f, test.add_material(hair_of(sigma_a)), is_flat);
        add_dome(test);
        // The window shows half of the fiber's width from edge to edge
        test.look_at_point(0.25);
        const RenderedLayers layers = render(test, {.size = 32, .samples = 512});
        const double sine = slope / std::sqrt(1.0 + slope * slope);
        const Vec3 wo(float(sine), 0.0f, float(std::sqrt(1.0 - sine * sine)));
        for (int c = 0; c < 3; ++c) {
            double expected = 0;
            constexpr int steps = 2000;
            for (int i = 0; i < steps; ++i) {
                shading::HairParameters p;
                p.sigma_a = sigma_a;
                p.roughness = p.azimuthal_roughness = 0.3f;
                const shading::HairLobes lobes(p, float((i + 0.5) / steps * 2.0 - 1.0));
                expected += double(shading::HairLobes::albedo(lobes.view(wo))[c]) / steps;
            }
            // Pixels differ, each by its place across: their spread is no error
            const double mean = layers.beauty(c).mean;
            fmt::print("{} fiber, channel {}: {:.5f}, expected {:.5f}\n",
                       is_flat ? "flat" : "round", c, mean, expected);
            EXPECT_NEAR(mean / expected, 1.0, 2e-3);
        }
    }
}

TEST(Hair, SamplersAgree) {
    TestScene test;
    const scene::MaterialId material = test.add_material(hair_of(Rgb(0.1f, 0.3f, 0.8f)));
    TestRandom random(4);
    for (int i = 0; i < 60; ++i) {
        const auto place = [&] {
            return Vec3(2.0f * random.uniform() - 1.0f, 2.0f * random.uniform() - 1.0f,
                        -3.0f - random.uniform());
        };
        const Vec3 from = place();
        add_strand(test, from, place(), 0.1f, material, i % 3 == 0);
    }
    test.add_light(scene::LightKind::Sphere, at(Vec3d(0.5, 1.0, -6.0))).radius = 1.2f;
    test.add_light(scene::LightKind::Sphere, at(Vec3d(-2.0, 1.0, 0.0))).radius = 1.0f;
    test.look_with_perspective(0.3);
    TestRenderOptions options{.size = 32, .samples = 512};
    RenderedLayers mis = render(test, options);
    options.seed = 2;
    for (const LightSampling sampler : {LightSampling::Light, LightSampling::Bsdf}) {
        options.estimator.light_sampling = sampler;
        expect_agreement(render(test, options), mis, 0.05,
                         fmt::format("hair by sampler {}", int(sampler)));
    }
}

// Across the fiber h goes evenly, whatever the direction, and rays leave on the side to which they
// go
TEST(HairFiber, IsAsWideAsItLooks) {
    for (const bool is_placed : {false, true}) {
        TestScene test;
        const scene::MaterialId material = test.add_material(hair_of(Rgb(0.0f)));
        add_strand(test, Vec3(0, -2, -4), Vec3(0, 2, -4), 0.6f, material);
        Mat4d placed;
        placed.setAxisAngle(Vec3d(0.0, 0.0, 1.0), 0.4);
        placed = placed * at(Vec3d(0.1, 0.0, 0.5));
        if (is_placed) test.make_instance(Mat4(placed));
        const integrator::World world = world_of(test);
        const Mat4d m = is_placed ? placed : Mat4d();
        const Vec3d axis = transform_direction(Vec3d(0, 1, 0), m),
                    across = transform_direction(Vec3d(1, 0, 0), m);
        TestRandom random(9);
        for (int i = 0; i < 300; ++i) {
            const double offset = 0.29 * (2.0 * double(random.uniform()) - 1.0),
                         lean = double(random.uniform()) - 0.5;
            const Vec3d d = normalize(transform_direction(Vec3d(0, lean, -1), m));
            const Vec3d middle = transform_point(Vec3d(0, 0, -4), m);
            const geometry::Ray ray{to_float(middle + across * offset - d * 3.0), to_float(d)};
            const geometry::Hit hit = world.accelerator->intersect(ray);
            ASSERT_TRUE(hit.is_valid());
            const geometry::SurfacePoint point =
                geometry::make_surface_point(world.scene, world.geometry, ray, hit);
            uint64_t rays = 0;
            const auto start = integrator::leaving_point(world, point, -ray.d, rays);
            ASSERT_TRUE(start);
            EXPECT_EQ(rays, 0u);
            for (const geometry::SurfacePoint& p : {point, *start}) {
                const auto fiber = geometry::fiber_at(world.scene, p, -ray.d);
                ASSERT_TRUE(fiber);
                EXPECT_NEAR((Vec3d(fiber->along) - axis).length(), 0.0, 1e-5);
                // About the axis the view is behind a normal that leans to the side of `across`
                EXPECT_NEAR(double(fiber->h), -offset / 0.3, 1e-4);
            }
            for (int k = 0; k < 20; ++k) {
                const Vec3 out = normalize(Vec3(random.uniform() - 0.5f, random.uniform() - 0.5f,
                                                random.uniform() - 0.5f));
                ASSERT_FALSE(world.accelerator->is_occluded(geometry::spawn_ray(*start, out)));
            }
        }
    }
}

// Tips and bends: what leaves meets the fiber again no more often than it should
TEST(HairFiber, SeldomMeetsItselfWhereItTapers) {
    TestScene test;
    scene::Curves curves;
    curves.basis = scene::Curves::Basis::Bezier;
    curves.vertex_counts = {4};
    curves.points = {Vec3(0, -1, -4), Vec3(0.1f, -0.3f, -4), Vec3(0.2f, 0.3f, -4),
                     Vec3(0.1f, 1, -4)};
    curves.widths = {0.05f, 0.0f};
    curves.width_interpolation = scene::Interpolation::Varying;
    scene::Shape shape;
    shape.material = test.add_material(hair_of(Rgb(0.0f)));
    shape.geometry = curves;
    test.scene.shapes.push_back(shape);
    const integrator::World world = world_of(test);
    TestRandom random(6);
    int met = 0, rays = 0;
    for (int i = 0; i < 4000; ++i) {
        const Vec3 from(0.4f * random.uniform() - 0.1f, 1.8f * random.uniform() - 0.9f, 0.0f);
        const geometry::Ray ray{from, Vec3(0, 0, -1)};
        const geometry::Hit hit = world.accelerator->intersect(ray);
        if (!hit.is_valid()) continue;
        const geometry::SurfacePoint point =
            geometry::make_surface_point(world.scene, world.geometry, ray, hit);
        uint64_t count = 0;
        const auto start = integrator::leaving_point(world, point, -ray.d, count);
        ASSERT_TRUE(start);
        for (int k = 0; k < 30; ++k, ++rays) {
            const Vec3 out = normalize(
                Vec3(random.uniform() - 0.5f, random.uniform() - 0.5f, random.uniform() - 0.5f));
            met += world.accelerator->is_occluded(geometry::spawn_ray(*start, out));
        }
    }
    fmt::print("{} of {} rays hit the fiber that they leave\n", met, rays);
    EXPECT_GT(rays, 1000);
    EXPECT_LT(met, rays / 500);
}

}  // namespace velatura::test
