// SPDX-License-Identifier: Apache-2.0
// Irradiance from single lights against closed forms (docs/engineering/hard_cases.md H24, H26) and
// against quadrature over the surface.
#include "hard_case.h"
#include "light_fixtures.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::lights {
namespace {

using scene::LightKind;

void expect_irradiance(const scene::Light& light,
                       const Vec3& p,
                       const Vec3& n,
                       double expected,
                       double relative,
                       int samples = 4096) {
    const scene::Scene scene = scene_of({light});
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    ASSERT_TRUE(lights.is_on(0));
    const Estimate e = irradiance(lights, p, n, samples);
    EXPECT_NEAR(e.mean, expected, relative * expected)
        << "detectable " << e.detectable() / expected << " relative";
    // A pass must mean something: the noise may not hide a deviation of the bound
    EXPECT_LE(e.standard_error, relative * expected);
    hardcase::expect_in_hard_case(
        {fmt::format("irradiance {:.6g} at distance {:.7g} of {:.3g} across, relative", expected,
                     (light.render_from_light.translation() - Vec3d(p)).length(),
                     2 * double(light.radius)),
         std::abs(e.mean / expected - 1), relative, e.detectable() / expected, "closed form"});
}

scene::Light square(double side, const Mat4d& m) {
    scene::Light light = light_of(LightKind::Rect, m);
    light.width = light.height = float(side);
    return light;
}

TEST(H24RectLight, IrradianceOfTheHandbook) {
    expect_irradiance(square(2, translation(0, 0, 1)), Vec3(0.0f), {0, 0, 1}, 1.7408395, 1e-4);
    expect_irradiance(square(1, translation(0.5, 0.5, 1)), Vec3(0.0f), {0, 0, 1}, 0.4352099, 1e-4);
}

TEST(H24RectLight, IrradianceFarAwayIsAreaOverDistanceSquared) {
    // Both sides of the switch to area sampling and far beyond; series of the closed form to first
    // order
    for (const double d : {200.0, 310.0, 320.0, 1e4, 1e6}) {
        const double expected = 1.0 / (d * d) * (1.0 - 1.0 / (3.0 * d * d));
        expect_irradiance(square(1, translation(0, 0, d)), Vec3(0.0f), {0, 0, 1}, expected, 2e-5);
    }
}

TEST(RectLight, EmitsFromOneSideOnly) {
    const scene::Scene scene = scene_of({square(2, translation(0, 0, 1))});
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    EXPECT_FALSE(lights.sample(0, {0, 0, 2}, {0.5f, 0.5f}));
    EXPECT_FALSE(lights.intersect(0, {0, 0, 2}, {0, 0, -1}));
    EXPECT_FALSE(lights.sample(0, {0.25f, 0, 1}, {0.5f, 0.5f}));
    EXPECT_TRUE(lights.sample(0, {0, 0, 0}, {0.5f, 0.5f}));
    EXPECT_TRUE(lights.intersect(0, {0, 0, 0}, {0, 0, 1}));
}

TEST(H08Mirrored, RectLightStillEmitsAlongTheImageOfMinusZ) {
    const Mat4d mirrored = matrix_of({-1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 1});
    expect_irradiance(square(2, mirrored), Vec3(0.0f), {0, 0, 1}, 1.7408395, 1e-4);
    const Mat4d upside_down = matrix_of({1, 0, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, -1});
    expect_irradiance(square(2, upside_down), Vec3(0.0f), {0, 0, -1}, 1.7408395, 1e-4);
}

/// Irradiance at the origin, normal +z, of the surface p(s, t) with the normal area dA = ∂s × ∂t,
/// both one-sided towards the origin, by midpoint quadrature over the unit square.
double quadrature(const std::function<Vec3d(double, double)>& p, int steps, const Vec3d& n) {
    const double h = 1e-5;
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
        for (int j = 0; j < steps; ++j) {
            const double s = (i + 0.5) / steps, t = (j + 0.5) / steps;
            const Vec3d q = p(s, t);
            const Vec3d ds = (p(s + h, t) - p(s - h, t)) / (2 * h);
            const Vec3d dt = (p(s, t + h) - p(s, t - h)) / (2 * h);
            const double r2 = q.dot(q), r = std::sqrt(r2);
            // Outward normals of closed shapes face the origin where the product is negative
            const double facing = -ds.cross(dt).dot(q) / r;
            sum += std::max(0.0, facing) * std::max(0.0, n.dot(q) / r) / r2;
        }
    }
    return sum / (double(steps) * steps);
}

TEST(RectLight, ParallelogramUnderShear) {
    const Mat4d m = matrix_of({1, 0, 0}, {0.7, 0.9, 0.1}, {0.2, 0, 1.5}, {0.3, 0.2, 0.8});
    const Vec3d ex(2, 0, 0), ey(1.4, 1.8, 0.2), center(0.3, 0.2, 0.8);
    const double expected =
        quadrature([&](double s, double t) { return center + ex * (0.5 - s) + ey * (t - 0.5); },
                   400, {0, 0, 1});
    expect_irradiance(square(2, m), Vec3(0.0f), {0, 0, 1}, expected, 1e-4);
}

TEST(DiskLight, IrradianceOfTheHandbook) {
    for (const double h : {0.05, 0.3, 1.0, 1.3, 5.0, 1e3, 1e6}) {
        scene::Light light = light_of(LightKind::Disk, translation(0, 0, h));
        light.radius = 1.0f;
        expect_irradiance(light, Vec3(0.0f), {0, 0, 1}, pi_d / (1.0 + h * h), h < 2 ? 1e-3 : 1e-4,
                          8192);
    }
}

TEST(DiskLight, EllipseUnderNonUniformScale) {
    const Mat4d m = matrix_of({3, 0, 0}, {0, 0.5, 0}, {0, 0, 7}, {0.4, -0.3, 1.1});
    scene::Light light = light_of(LightKind::Disk, m);
    const double expected = quadrature(
        [&](double s, double t) {
            const double r = 0.5 * s, a = 2 * pi_d * t;
            return Vec3d(0.4 + 3 * r * std::cos(a), -0.3 - 0.5 * r * std::sin(a), 1.1);
        },
        600, {0, 0, 1});
    expect_irradiance(light, Vec3(0.0f), {0, 0, 1}, expected, 1e-3, 8192);
}

TEST(H26SphereLight, IrradianceFromTouchingToTenMillionRadii) {
    for (const double ratio : {0.999, 0.99, 0.5, 0.1, 1e-2, 1e-3, 2e-4, 1e-4, 1e-5, 1e-6, 1e-7}) {
        scene::Light light = light_of(LightKind::Sphere, translation(0, 0, 1));
        light.radius = float(ratio);
        const double r = double(light.radius);
        expect_irradiance(light, Vec3(0.0f), {0, 0, 1}, pi_d * r * r, 1e-4);
        // Tilted, still fully above the horizon
        if (ratio > 0.5) continue;
        expect_irradiance(light, Vec3(0.0f), {0.6f, 0, 0.8f}, 0.8 * pi_d * r * r, 1e-4);
    }
}

TEST(H26SphereLight, IrradianceInsideAndOnTheSurface) {
    scene::Light light = light_of(LightKind::Sphere, translation(0, 0, 1));
    light.radius = 1.0f;
    constexpr int samples = 16384;
    const double below = 1.0 - 0x1p-24;
    expect_irradiance(light, Vec3(0.0f), {0, 0, 1}, pi_d, 1e-4, samples);  // on it, facing in
    expect_irradiance(light, {0, 0, 1}, {0, 0, 1}, pi_d, 1e-4, samples);   // at the center
    expect_irradiance(light, {0.3f, 0.2f, 0.4f}, {0.6f, 0, 0.8f}, pi_d, 1e-4, samples);
    expect_irradiance(light, {0, 0, float(-0x1p-22)}, {0, 0, 1}, pi_d, 1e-4,
                      samples);  // just outside
    light.radius = float(below);
    expect_irradiance(light, Vec3(0.0f), {0, 0, 1}, pi_d * below * below, 1e-4, samples);
}

TEST(SphereLight, EllipsoidUnderShear) {
    const Vec3d x(2, 0.3, 0), y(0, 0.4, 0.2), z(-0.5, 0, 1), center(0.5, -0.2, 1.7);
    const Mat4d m = matrix_of(x, y, z, center);
    const double expected = quadrature(
        [&](double s, double t) {
            const double a = 2 * pi_d * s, b = pi_d * (t - 0.5);
            return center + x * (0.5 * std::cos(a) * std::cos(b)) +
                   y * (0.5 * std::sin(a) * std::cos(b)) + z * (0.5 * std::sin(b));
        },
        800, {0, 0, 1});
    expect_irradiance(light_of(LightKind::Sphere, m), Vec3(0.0f), {0, 0, 1}, expected, 1e-4);
}

TEST(CylinderLight, IrradianceAgreesWithQuadratureOverTheMantle) {
    struct Case {
        double radius, length;
        Vec3d center;
        Vec3d y;  // second axis: shear or scale
    };

    const Case cases[] = {
        {0.5, 1, {0, 0, 1}, {0, 1, 0}},       {0.1, 6, {1, 0.2, 0.5}, {0, 1, 0}},
        {0.5, 1, {2.5, 0.6, 0.3}, {0, 1, 0}}, {0.3, 2, {0.5, 0.5, 3}, {0.4, 1.7, 0.1}},
        {0.02, 1, {30, 20, 40}, {0, 1, 0}},
    };
    for (const Case& c : cases) {
        const Mat4d m = matrix_of({1, 0, 0}, c.y, {0, 0, 1}, c.center);
        scene::Light light = light_of(LightKind::Cylinder, m);
        light.radius = float(c.radius);
        light.length = float(c.length);
        const double expected = quadrature(
            [&](double s, double t) {
                const double a = 2 * pi_d * s;
                return c.center + Vec3d(c.length * (t - 0.5), 0, 0) +
                       c.y * (c.radius * std::cos(a)) + Vec3d(0, 0, c.radius * std::sin(a));
            },
            800, {0, 0, 1});
        ASSERT_GT(expected, 0.0);
        expect_irradiance(light, Vec3(0.0f), {0, 0, 1}, expected, 3e-4, 8192);
    }
}

TEST(CylinderLight, InsideAndBehindTheCapsIsDark) {
    const scene::Scene scene = scene_of({light_of(LightKind::Cylinder)});
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    for (const Vec3& p : {Vec3(0.0f), Vec3(3, 0.2f, 0.1f)}) {
        EXPECT_FALSE(lights.sample(0, p, {0.3f, 0.4f}));
        EXPECT_FALSE(lights.intersect(0, p, {-0.8f, 0.6f, 0}));
    }
}

TEST(DistantLight, SunOfTheHandbook) {
    scene::Light sun = light_of(LightKind::Distant);
    sun.angle_deg = 0.53f;
    const double t = double(sun.angle_deg) / 2 * pi_d / 180;
    expect_irradiance(sun, Vec3(0.0f), {0, 0, 1}, pi_d * std::sin(t) * std::sin(t), 1e-6);
    const scene::Scene scene = scene_of({sun});
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    EXPECT_NEAR(1.0 / double(lights.pdf(0, Vec3(0.0f), {0, 0, 1})), 6.72041e-5, 1e-10);
    for (const float angle : {1e-4f, 1e-2f, 10.0f, 90.0f, 170.0f, 180.0f}) {
        sun.angle_deg = angle;
        const double half = double(angle) / 2 * pi_d / 180;
        expect_irradiance(sun, Vec3(0.0f), {0, 0, 1}, pi_d * std::sin(half) * std::sin(half), 1e-4);
    }
    sun.angle_deg = 360.0f;
    expect_irradiance(sun, Vec3(0.0f), {0, 0, 1}, pi_d, 1e-4);
}

TEST(DistantLight, TooSmallForFloatsIsADeltaOfTheSameIrradiance) {
    scene::Light sun = light_of(LightKind::Distant);
    for (const float angle : {1e-12f, 1e-9f, 1e-7f, 1.1e-7f, 1.2e-7f, 1e-6f, 1e-4f}) {
        sun.angle_deg = angle;
        const scene::Scene scene = scene_of({sun});
        Diagnostics diagnostics;
        const LightSet lights(scene, {}, diagnostics);
        const auto s = lights.sample(0, Vec3(0.0f), {0.1f, 0.9f});
        ASSERT_TRUE(s);
        const double half = double(angle) / 2 * pi_d / 180, expected = pi_d * half * half;
        EXPECT_NEAR(double(s->Le.x) / double(s->pdf), expected, 1e-6 * expected) << angle;
    }
}

TEST(DistantLight, AngleZeroIsADeltaOfTheSameIrradiance) {
    scene::Light sun = light_of(LightKind::Distant);
    sun.angle_deg = 0.0f;
    sun.Le = Rgb(3.0f);
    const scene::Scene scene = scene_of({sun});
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    const auto s = lights.sample(0, Vec3(0.0f), {0.1f, 0.9f});
    ASSERT_TRUE(s);
    EXPECT_TRUE(s->is_delta && lights.is_delta(0));
    EXPECT_EQ(s->wi, Vec3(0, 0, 1));
    EXPECT_EQ(s->Le.x / s->pdf, 3.0f);
    EXPECT_EQ(lights.pdf(0, Vec3(0.0f), s->wi), 0.0f);
    EXPECT_FALSE(lights.intersect(0, Vec3(0.0f), s->wi));
}

TEST(DomeLight, WithoutTextureGivesPi) {
    expect_irradiance(light_of(LightKind::Dome), Vec3(0.0f), {0, 0, 1}, pi_d, 1e-4);
    expect_irradiance(light_of(LightKind::Dome), {5, 6, 7}, {0.6f, -0.8f, 0}, pi_d, 1e-4);
}

}  // namespace
}  // namespace velatura::lights
