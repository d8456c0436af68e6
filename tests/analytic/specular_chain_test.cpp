// SPDX-License-Identifier: Apache-2.0
// Chains of mirrors and interfaces: their derivatives against differences, and all light that they
// carry against what paths meet by chance, light layer by light layer.
#include "integrator/specular_chain.h"

#include "integrator/specular_casters.h"
#include "sampling/sampler.h"
#include "sampling/warp.h"
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace velatura::test {

namespace {

using shading::ScatterKind;

/// A ball of radius 1, turned into an ellipsoid by an instance.
void add_ellipsoid(TestScene& test,
                   const Vec3d& center,
                   const Vec3d& radii,
                   scene::MaterialId material) {
    TestScene ball;
    ball.add_sphere(Vec3(0.0f), 1.0, material);
    test.scene.prototypes.push_back({"Ball", ball.scene.shapes});
    Mat4d m;
    m.setScale(radii);
    Mat4d turn;
    turn.setAxisAngle(Vec3d(1, 2, 0).normalized(), 0.4);
    m = m * turn * at(center);
    scene::Instance instance;
    instance.prototype = uint32_t(test.scene.prototypes.size() - 1);
    instance.render_from_prototype = Mat4(m);
    test.scene.instances.push_back(instance);
}

/// A point that chains start from.
geometry::SurfacePoint free_point(const Vec3& p) {
    geometry::SurfacePoint point;
    point.p = p;
    point.p_error = Vec3(0.0f);
    point.ng = point.ns = Vec3(0, 0, 1);
    return point;
}

/// Compares derivatives with central differences for rays towards a ball around `center`.
void expect_derivatives(const TestScene& test,
                        const Vec3d& center,
                        double radius,
                        const integrator::SpecularEvents& events,
                        const std::string& what) {
    Diagnostics diagnostics;
    const integrator::World world(test.scene, {.width = 1, .height = 1}, {}, diagnostics);
    const geometry::SurfacePoint from = free_point(Vec3(0.25f, -0.5f, -1.0f));
    integrator::RayCounts counts;
    const sampling::PixelSampler random(3, 0, 0, 0, sampling::SamplerKind::Independent);
    constexpr double h = 1e-5;
    std::vector<double> errors;
    for (uint32_t i = 0; i < 4000; ++i) {
        const Vec2 u = random.get_2d(0, sampling::Purpose::ManifoldSeed, i);
        const Vec3d aside(2.0 * double(u.x) - 1.0, 2.0 * double(u.y) - 1.0, 0.0);
        const Vec3d d = (center + aside * radius - Vec3d(from.p)).normalized();
        const auto across = integrator::directions_across(d);
        integrator::SpecularChain middle, side[2];
        if (!follow_chain(world, from, d, across, events, middle, counts)) continue;
        for (size_t k = 0; k < 2; ++k) {
            // Richardson: differences over h and 2h, so that their own error is of fourth order
            Vec3d o_by(0.0), d_by(0.0);
            bool is_same = true;
            for (const double step : {h, 2 * h}) {
                for (size_t s = 0; s < 2; ++s) {
                    const Vec3d moved = (d + across[k] * (s == 0 ? step : -step)).normalized();
                    is_same = is_same &&
                              follow_chain(world, from, moved, across, events, side[s], counts);
                    for (size_t v = 0; is_same && v < size_t(events.count); ++v)
                        is_same = side[s].points[v].triangle == middle.points[v].triangle;
                }
                const double weight = (step == h ? 4.0 : -1.0) / (3.0 * 2.0 * step);
                o_by += (side[0].ray.o - side[1].ray.o) * weight;
                d_by += (side[0].ray.d - side[1].ray.d) * weight;
            }
            // Across an edge of the mesh the derivative jumps
            if (!is_same) continue;
            const double scale = 1.0 + o_by.length() + d_by.length();
            errors.push_back(std::max((o_by - middle.ray.o_by[k]).length(),
                                      (d_by - middle.ray.d_by[k]).length()) /
                             scale);
        }
    }
    ASSERT_GT(errors.size(), 1000u);
    // Close to total reflection differences say little: judge all but the last hundredth
    std::sort(errors.begin(), errors.end());
    const double median = errors[errors.size() / 2], high = errors[errors.size() * 99 / 100];
    fmt::print(
        "{:32} {} derivatives, relative difference {:.2e} in the median, {:.2e} at most but for 1 "
        "%\n",
        what, errors.size(), median, high);
    EXPECT_LT(median, 1e-9) << what;
    EXPECT_LT(high, 1e-5) << what;
}

integrator::SpecularEvents through(scene::MaterialId material) {
    integrator::SpecularEvents events;
    events.count = 2;
    events.events[0] = {ScatterKind::Transmit, material, false, 1.5f};
    events.events[1] = {ScatterKind::Transmit, material, true, 1.0f / 1.5f};
    return events;
}

/// A floor whose one point all pixels see.
TestScene floor_scene() {
    TestScene test;
    test.add_square(-1.0f, 2.0f, test.add_matte(Rgb(0.6f, 0.5f, 0.4f)));
    return test;
}

/// Welch's test of every (bounce, group) cell; the cells named must be seen well enough to see an
/// error of `bound`.
void expect_same_layers(const TestScene& test,
                        const std::vector<int>& judged,
                        double bound,
                        const std::string& what,
                        uint64_t samples = 512) {
    constexpr double limit = 4.5;  // 1 in 150 000, for some 20 cells each
    TestRenderOptions options{.size = 32, .samples = samples, .last_bounce = 7, .seed = 5};
    const RenderedLayers path = render(test, options);
    options.caustics = integrator::Caustics::Manifold;
    options.seed = 6;
    const RenderedLayers manifold = render(test, options);
    EXPECT_GT(manifold.rays.caustics_found, 100u) << what;
    for (int group = 0; group + 1 < path.groups; ++group) {
        for (int bounce = 1; bounce <= 8; ++bounce) {
            const Estimate a = path.bounce(bounce, group, 1), b = manifold.bounce(bounce, group, 1);
            const double error = std::hypot(a.standard_error, b.standard_error);
            if (a.mean == 0 && b.mean == 0) continue;
            const double detectable = (limit + 1.2816) * error / std::max(a.mean, b.mean);
            fmt::print(
                "{:28} group {} b{}: path {:.6g}, manifold {:.6g}, {:+.2f} standard errors, "
                "detectable {:.2e}\n",
                what, group, bounce, a.mean, b.mean, error > 0 ? (b.mean - a.mean) / error : 0.0,
                detectable);
            // Where few paths met the light their error is not known
            if (detectable < 0.5) {
                EXPECT_LE(std::abs(a.mean - b.mean), limit * error + 1e-6 * a.mean)
                    << what << ": bounce " << bounce;
            }
            if (std::find(judged.begin(), judged.end(), bounce) != judged.end()) {
                EXPECT_LE(detectable, bound)
                    << what << ": bounce " << bounce << " is too noisy to be judged";
            }
        }
        EXPECT_EQ(path.unoccluded(group).mean > 0, manifold.unoccluded(group).mean > 0);
    }
}

}  // namespace

TEST(SpecularChain, DerivativesThroughABall) {
    TestScene test;
    const scene::MaterialId material = test.add_material(smooth_glass());
    test.add_sphere(Vec3(0.0f, 0.0f, 1.5f), 0.75, material);
    expect_derivatives(test, Vec3d(0, 0, 1.5), 0.75, through(material), "refraction by a ball");
}

TEST(SpecularChain, DerivativesThroughAnInstance) {
    TestScene test;
    const scene::MaterialId material = test.add_material(smooth_glass());
    add_ellipsoid(test, Vec3d(0, 0, 1.5), Vec3d(0.5, 1.0, 0.75), material);
    expect_derivatives(test, Vec3d(0, 0, 1.5), 0.75, through(material),
                       "refraction by an ellipsoid");
}

TEST(SpecularChain, DerivativesOffAMirror) {
    // Rays leave opaque balls above their facets
    TestScene test;
    const scene::MaterialId material = test.add_material(mirror(Rgb(0.9f, 0.8f, 0.7f)));
    test.add_sphere(Vec3(0.0f, 0.0f, 1.5f), 0.75, material);
    integrator::SpecularEvents events;
    events.count = 1;
    events.events[0] = {ScatterKind::Reflect, material, false, 1.0f};
    expect_derivatives(test, Vec3d(0, 0, 1.5), 0.75, events, "reflection by a ball");
}

TEST(CausticLayers, GlassBall) {
    TestScene test = floor_scene();
    test.add_sphere(Vec3(0.25f, 0.0f, 1.0f), 0.5, test.add_material(smooth_glass()));
    test.add_light(scene::LightKind::Sphere, at(Vec3d(0.5, 0, 3))).radius = 0.5f;
    expect_same_layers(test, {3}, 0.1, "glass ball", 128);
}

TEST(CausticLayers, MirrorBallAndRect) {
    TestScene test = floor_scene();
    test.add_sphere(Vec3(1.0f, 0.0f, 0.5f), 0.5, test.add_material(mirror(Rgb(0.9f, 0.8f, 0.7f))));
    Mat4d m;
    m.setAxisAngle(Vec3d(0, 1, 0), -0.5);
    scene::Light& light = test.add_light(scene::LightKind::Rect, m * at(Vec3d(-1.0, 0, 1.5)));
    light.width = light.height = 1.5f;
    expect_same_layers(test, {2}, 0.2, "mirror ball");
}

TEST(CausticLayers, InstancedLensAndCylinders) {
    TestScene test = floor_scene();
    add_ellipsoid(test, Vec3d(0, 0, 1.0), Vec3d(0.75, 0.6, 0.25),
                  test.add_material(smooth_glass()));
    for (const double x : {-0.5, 0.75}) {
        scene::Light& light = test.add_light(scene::LightKind::Cylinder, at(Vec3d(x, 0.25, 2.5)));
        light.radius = 0.4f;
        light.length = 2.0f;
    }
    expect_same_layers(test, {3}, 0.4, "lens under two cylinders");
}

TEST(CausticLayers, LampInsideABulbBehindAnother) {
    // The lamp crosses chains midway: those that end inside the bulb and those that go on
    TestScene test = floor_scene();
    const scene::MaterialId material = test.add_material(smooth_glass());
    test.add_sphere(Vec3(0.0f, 0.0f, 1.0f), 0.5, material);
    test.add_sphere(Vec3(0.5f, 0.25f, 2.25f), 0.5, material);
    test.add_light(scene::LightKind::Sphere, at(Vec3d(0.5, 0.25, 2.25))).radius = 0.3f;
    expect_same_layers(test, {2, 4}, 0.35, "lamp in a bulb");
}

TEST(CausticLayers, CutOutsAndCoats) {
    // Half of the glass is not there, a sheet that is half there hangs before the lamp, and the
    // wall has a smooth coat
    TestScene test = floor_scene();
    scene::Material thin = smooth_glass();
    thin.opacity = scene::Input(0.5f);
    test.add_sphere(Vec3(0.25f, 0.0f, 1.0f), 0.5, test.add_material(thin));
    scene::Material sheet;
    sheet.presence = true;
    sheet.opacity = scene::Input(0.5f);
    test.add_square(2.0f, 0.35f, test.add_material(sheet));
    scene::Material lacquer;
    lacquer.diffuse_color = scene::Input(Rgb(0.5f));
    lacquer.clearcoat = scene::Input(1.0f);
    lacquer.clearcoat_roughness = scene::Input(0.0f);
    test.add_sphere(Vec3(-1.0f, 0.0f, 0.0f), 0.6, test.add_material(lacquer));
    test.add_light(scene::LightKind::Sphere, at(Vec3d(0.5, 0, 3))).radius = 0.5f;
    expect_same_layers(test, {3}, 0.2, "cut-outs and coats");
}

// Paths leave light out behind every delta lobe at a plain vertex: no such lobe may go without
// seeds.
TEST(SpecularCasters, WhateverScattersWithoutBlurIsSought) {
    int smooth = 0, rough = 0;
    for (int i = 0; i < 3 * 3 * 3 * 2 * 2 * 2 * 2; ++i) {
        int rest = i;
        const auto pick = [&rest](int n) {
            const int k = rest % n;
            rest /= n;
            return k;
        };
        scene::Material m;
        const float values[3] = {0.0f, 0.02f, 0.5f};
        m.roughness = scene::Input(values[pick(3)]);
        m.ior = scene::Input(std::array{1.0f, 1.001f, 1.5f}[size_t(pick(3))]);
        m.metallic = scene::Input(std::array{0.0f, 0.5f, 1.0f}[size_t(pick(3))]);
        m.diffuse_color = scene::Input(Rgb(pick(2) ? 0.5f : 0.0f));
        m.opacity = scene::Input(pick(2) ? 1.0f : 0.0f);
        m.rough_transmission = pick(2) == 1;
        m.clearcoat = scene::Input(pick(2) ? 1.0f : 0.0f);
        m.clearcoat_roughness = scene::Input(0.0f);
        TestScene test;
        test.scene.materials.push_back(m);
        test.add_sphere(Vec3(0.0f), 1.0, 0);
        Diagnostics diagnostics;
        const integrator::World world(test.scene, {.width = 1, .height = 1}, {}, diagnostics);
        const integrator::SpecularCasters casters(world);
        for (const float side : {1.0f, -1.0f}) {
            geometry::SurfacePoint point = free_point(Vec3(0.0f));
            point.material = 0;
            const shading::Bsdf bsdf =
                world.materials.make_bsdf(point, normalize(Vec3(0.3f, 0.1f, side)), 0.0f);
            const auto reflected = bsdf.delta(ScatterKind::Reflect);
            const auto transmitted = bsdf.delta(ScatterKind::Transmit);
            const bool is_smooth =
                (reflected && !is_black(reflected->weight)) ||
                (transmitted && transmitted->eta != 1.0f && !is_black(transmitted->weight));
            ++(is_smooth ? smooth : rough);
            if (is_smooth) {
                EXPECT_GT(casters.weight(0), 0.0) << "material " << i;
            }
        }
    }
    EXPECT_GT(smooth, 100);
    EXPECT_GT(rough, 100);
}

}  // namespace velatura::test
