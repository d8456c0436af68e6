// SPDX-License-Identifier: Apache-2.0
// Lobes of fibers against light traced through a cylinder, quadrature and samples.
#include "shading/hair.h"

#include "../sampling/chi_square.h"
#include "shading/bsdf.h"
#include "shading/fresnel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace velatura::shading {
namespace {

using sampling::testing::chi_square;
using sampling::testing::TestRandom;

/// Direction of a sine along the fiber and an angle around it.
Vec3 direction(double sine, double phi) {
    const double cosine = std::sqrt(std::max(0.0, 1.0 - sine * sine));
    return {float(sine), float(cosine * std::cos(phi)), float(cosine * std::sin(phi))};
}

HairParameters fiber(float roughness, float azimuthal, float tilt = 0.0f) {
    HairParameters p;
    p.roughness = roughness;
    p.azimuthal_roughness = azimuthal;
    p.cuticle_angle = tilt;
    return p;
}

double difference_of_angles(double a, double b) {
    return std::remainder(a - b, 2.0 * pi_d);
}

/// d behind a boundary whose normal n faces it; index of what is behind over what is before.
Vec3d refracted(const Vec3d& d, const Vec3d& n, double eta) {
    const double cosine = -d.dot(n), sine2 = (1.0 - cosine * cosine) / (eta * eta);
    return d / eta + n * (cosine / eta - std::sqrt(1.0 - sine2));
}

// Where light goes that is refracted in and out of a smooth cylinder, and how much of it is left
TEST(Hair, AgreesWithLightThroughACylinder) {
    TestRandom random(5);
    for (int i = 0; i < 500; ++i) {
        const double sine = 1.8 * double(random.uniform()) - 0.9,
                     phi = 6.28 * double(random.uniform());
        const double turn = 3.0 * double(random.uniform()) - 1.5;
        const Vec3 wo = direction(sine, phi);
        // The normal from which the view is turned by `turn`
        const Vec3d n(0.0, std::cos(phi - turn), std::sin(phi - turn));
        HairParameters p = fiber(0.3f, 0.3f);
        p.sigma_a = Rgb(0.0f, 0.3f, 2.0f);
        const HairLobes lobes(p, float(std::sin(turn)));
        const HairLobes::View view = lobes.view(wo);
        const double eta = double(p.ior);

        const Vec3d d = -Vec3d(wo), mirrored = d - n * (2.0 * d.dot(n));
        EXPECT_NEAR(difference_of_angles(std::atan2(mirrored.z, mirrored.y),
                                         double(view.phi + view.turn[0])),
                    0.0, 1e-3);
        const double fresnel = double(fresnel_dielectric(float(-d.dot(n)), p.ior));
        EXPECT_NEAR(double(view.attenuation[0].x), fresnel, 1e-4);

        // Through it: the chord of the unit circle ends where it is met again
        const Vec3d inside = refracted(d, n, eta);
        const double across = std::hypot(inside.y, inside.z);
        const double t = -2.0 * (inside.y * n.y + inside.z * n.z) / (across * across);
        const Vec3d exit = n + inside * t;
        const Vec3d normal(0.0, exit.y, exit.z);
        const Vec3d passed = refracted(inside, -normal, 1.0 / eta);
        EXPECT_NEAR(passed.x, -sine, 1e-6);
        EXPECT_NEAR(
            difference_of_angles(std::atan2(passed.z, passed.y), double(view.phi + view.turn[1])),
            0.0, 1e-3);
        for (int c = 0; c < 3; ++c) {
            const double left = std::exp(-double(p.sigma_a[c]) * t);
            EXPECT_NEAR(double(view.attenuation[1][c]), (1.0 - fresnel) * (1.0 - fresnel) * left,
                        1e-3);
            // Every further reflection inside takes as much away: a geometric series
            const double all =
                fresnel + (1.0 - fresnel) * (1.0 - fresnel) * left / (1.0 - fresnel * left);
            EXPECT_NEAR(double(HairLobes::albedo(view)[c]), all, 2e-3);
        }

        const Vec3d returned = inside - normal * (2.0 * inside.dot(normal));
        const double t2 =
            -2.0 * (returned.y * normal.y + returned.z * normal.z) / (across * across);
        const Vec3d last = normal + returned * t2, last_normal(0.0, last.y, last.z);
        const Vec3d back = refracted(returned, -last_normal, 1.0 / eta);
        EXPECT_NEAR(
            difference_of_angles(std::atan2(back.z, back.y), double(view.phi + view.turn[2])), 0.0,
            3e-3);
    }
}

/// ∫ over the sphere of what `at` says of directions: both rules converge at once for what is
/// smooth.
template <class At>
double over_sphere(const At& at, int rows, int columns) {
    double sum = 0;
    for (int r = 0; r < rows; ++r) {
        // Even in the angle: lobes are as narrow everywhere
        const double theta = ((r + 0.5) / rows - 0.5) * pi_d;
        const double weight = std::cos(theta) * (pi_d / rows) * (2.0 * pi_d / columns);
        for (int c = 0; c < columns; ++c)
            sum += weight * at(direction(std::sin(theta), 2.0 * pi_d * (c + 0.5) / columns));
    }
    return sum;
}

TEST(Hair, WhiteFurnaceIsOne) {
    double worst = 0;
    for (const float roughness : {0.05f, 0.1f, 0.3f, 0.6f, 1.0f}) {
        for (const float azimuthal : {0.05f, 0.3f, 1.0f}) {
            const int rows = roughness < 0.2f ? 900 : 200, columns = azimuthal < 0.1f ? 1200 : 160;
            for (const double sine : {0.0, 0.7, -0.98}) {
                for (const float h : {0.0f, -0.6f, 0.99f}) {
                    const HairLobes lobes(fiber(roughness, azimuthal, 0.035f), h);
                    const HairLobes::View view = lobes.view(direction(sine, 0.4));
                    const double all = over_sphere(
                        [&](const Vec3& wi) { return double(lobes.evaluate(view, wi).f_cosine.y); },
                        rows, columns);
                    worst = std::max(worst, std::abs(all - 1.0));
                    EXPECT_NEAR(all, 1.0, 5e-3)
                        << roughness << " " << azimuthal << " " << sine << " " << h;
                }
            }
        }
    }
    std::printf("hair furnace: 1 within %.1e\n", worst);
}

TEST(Hair, WhatIsAbsorbedIsMissing) {
    HairParameters p = fiber(0.3f, 0.3f, 0.035f);
    p.sigma_a = absorption_of_melanin(scene::Hair(), 0.6f, 0.4f);
    for (const float h : {-0.8f, 0.1f, 0.9f}) {
        const HairLobes lobes(p, h);
        const HairLobes::View view = lobes.view(direction(0.5, 1.0));
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(
                over_sphere(
                    [&](const Vec3& wi) { return double(lobes.evaluate(view, wi).f_cosine[c]); },
                    200, 200),
                double(HairLobes::albedo(view)[c]), 2e-3);
    }
}

TEST(Hair, SamplesFollowThePdf) {
    constexpr int rows = 12, columns = 16, sub = 24, count = 40000;
    for (const float roughness : {0.15f, 0.3f, 1.0f}) {
        for (const float azimuthal : {0.15f, 0.4f, 1.0f}) {
            for (const float h : {0.0f, 0.7f, -0.95f}) {
                HairParameters p = fiber(roughness, azimuthal, 0.035f);
                p.sigma_a = Rgb(0.1f, 0.4f, 1.5f);
                const HairLobes lobes(p, h);
                const HairLobes::View view = lobes.view(direction(h < 0.0f ? 0.93 : -0.3, 2.0));
                TestRandom random(11);
                std::vector<double> counts(rows * columns, 0.0), expected(rows * columns, 0.0);
                // Rows of equal angle, as lobes are
                const auto cell = [](double theta, double phi) {
                    const int r = std::clamp(int((theta / pi_d + 0.5) * rows), 0, rows - 1);
                    const int c =
                        std::clamp(int((phi / (2.0 * pi_d) + 0.5) * columns), 0, columns - 1);
                    return size_t(r * columns + c);
                };
                for (int i = 0; i < count; ++i) {
                    const float u = random.uniform();
                    const Vec2 v(random.uniform(), random.uniform());
                    const Vec3 wi = lobes.sample(view, u, v);
                    ASSERT_NEAR(double(wi.length()), 1.0, 1e-5);
                    counts[cell(std::asin(double(wi.x)), std::atan2(double(wi.z), double(wi.y)))] +=
                        1;
                }
                double total = 0;
                for (int r = 0; r < rows * sub; ++r) {
                    for (int c = 0; c < columns * sub; ++c) {
                        const double theta = ((r + 0.5) / (rows * sub) - 0.5) * pi_d;
                        const double phi = ((c + 0.5) / (columns * sub) - 0.5) * 2.0 * pi_d;
                        const double mass =
                            double(lobes.evaluate(view, direction(std::sin(theta), phi)).pdf) *
                            std::cos(theta) * 2.0 * pi_d * pi_d / (rows * sub * columns * sub);
                        expected[cell(theta, phi)] += mass * count;
                        total += mass;
                    }
                }
                EXPECT_NEAR(total, 1.0, 1e-3);
                EXPECT_LT(chi_square(counts, expected).z, 4.5)
                    << roughness << " " << azimuthal << " " << h;
            }
        }
    }
    std::printf("smallest detectable error of a cell: %.0f %%\n",
                100 * sampling::testing::smallest_detectable(count, rows * columns));
}

// Untilted fibers as a whole, between directions of the same angle to the fiber
TEST(Hair, IsReciprocalWithinACone) {
    HairParameters p = fiber(0.4f, 0.5f);
    p.sigma_a = Rgb(0.2f);
    const auto across = [&](const Vec3& wo, const Vec3& wi) {
        double sum = 0;
        constexpr int steps = 400;
        for (int i = 0; i < steps; ++i) {
            const HairLobes lobes(p, float((i + 0.5) / steps * 2.0 - 1.0));
            sum += double(lobes.evaluate(lobes.view(wo), wi).f_cosine.x) / steps;
        }
        return sum;
    };
    for (const double sine : {-0.7, 0.2}) {
        for (const double phi : {0.3, 1.7, 3.0}) {
            for (const double sign : {1.0, -1.0}) {
                const Vec3 a = direction(sine, 0.4), b = direction(sign * sine, 0.4 + phi);
                EXPECT_NEAR(across(a, b) / across(b, a), 1.0, 1e-3);
            }
        }
    }
}

TEST(Hair, ColorsComeBackFromAbsorption) {
    // White absorbs nothing, dark absorbs more, the melanin of black hair more than that of blond
    EXPECT_EQ(absorption_of_color(Rgb(1.0f), 0.3f), Rgb(0.0f));
    const Rgb tan = absorption_of_color(Rgb(0.7f, 0.5f, 0.2f), 0.3f);
    EXPECT_LT(tan.x, tan.y);
    EXPECT_LT(tan.y, tan.z);
    EXPECT_TRUE(is_finite(absorption_of_color(Rgb(0.0f), 0.3f)));
    EXPECT_LT(absorption_of_melanin(scene::Hair(), 0.3f, 0.0f).x,
              absorption_of_melanin(scene::Hair(), 8.0f, 0.0f).x);
}

TEST(HairBsdf, IsTheLobesWhateverTheFrame) {
    const Vec3 along = normalize(Vec3(0.3f, -0.8f, 0.5f)),
               ng = normalize(cross(along, Vec3(0.2f, 0.1f, 1.0f)));
    TestRandom random(3);
    for (int i = 0; i < 2000; ++i) {
        const Vec3 wo = normalize(
            Vec3(random.uniform() - 0.5f, random.uniform() - 0.5f, random.uniform() - 0.5f));
        HairParameters p = fiber(0.3f, 0.3f, 0.035f);
        p.sigma_a = Rgb(0.1f, 0.2f, 0.9f);
        const Bsdf bsdf(p, 2.0f * random.uniform() - 1.0f, along, ng, wo);
        ASSERT_TRUE(bsdf.has_non_delta() && bsdf.has_transmission() && bsdf.is_hair());
        ASSERT_FALSE(bsdf.delta(ScatterKind::Reflect) || bsdf.delta(ScatterKind::Transmit));
        const float u = random.uniform();
        const auto s = bsdf.sample_f(wo, u, Vec2(random.uniform(), random.uniform()));
        if (!s) continue;
        ASSERT_FALSE(s->is_delta);
        const BsdfValue value = bsdf.evaluate(wo, s->wi);
        ASSERT_NEAR(double(value.pdf / s->pdf), 1.0, 1e-4);
        ASSERT_NEAR(double(value.f().y / s->f.y), 1.0, 1e-4);
        ASSERT_EQ(value.kind, s->kind);
        // No path gains
        ASSERT_LE(double(max_component(s->f)) * double(bsdf.cosine(s->wi) / s->pdf), 3.0);
    }
}

TEST(HairBsdf, NothingIsEverNan) {
    TestRandom random(12);
    const float edges[] = {0.0f, 0.5f, 0x1.fffffep-1f};
    for (int i = 0; i < 50000; ++i) {
        HairParameters p;
        const float widths[] = {min_hair_roughness, 0.1f, 0.3f, 1.0f};
        p.roughness = widths[random.bits() % 4];
        p.azimuthal_roughness = widths[random.bits() % 4];
        const float sigmas[] = {0.0f, 0.1f, 1.0f, 1e4f};
        for (int c = 0; c < 3; ++c) p.sigma_a[c] = sigmas[random.bits() % 4];
        const float iors[] = {1.001f, 1.55f, 3.0f};
        p.ior = iors[random.bits() % 3];
        p.cuticle_angle = random.bits() % 2 ? 0.3f : 0.0f;
        const float hs[] = {-1.0f, 0.0f, 0.999999f, 1.0f};
        const Vec3 along(0, 0, 1);
        const Vec3 directions[] = {
            {0, 0, 1},
            {0, 0, -1},
            {1, 0, 0},
            normalize(Vec3(1e-4f, 0, 1)),
            normalize(Vec3(random.uniform(), random.uniform() - 0.5f, random.uniform()))};
        const Vec3 wo = directions[random.bits() % 5], wi = directions[random.bits() % 5];
        const Bsdf bsdf(p, hs[random.bits() % 4], along, Vec3(0, 1, 0), wo);
        const BsdfValue value = bsdf.evaluate(wo, wi);
        ASSERT_TRUE(is_finite(value.f()) && std::isfinite(value.pdf)) << i;
        ASSERT_GE(value.f().x, 0.0f);
        const auto s = bsdf.sample_f(wo, edges[random.bits() % 3],
                                     Vec2(edges[random.bits() % 3], edges[random.bits() % 3]));
        if (s) {
            ASSERT_TRUE(is_finite(s->f) && is_finite(s->wi) && std::isfinite(s->pdf)) << i;
            ASSERT_GT(s->pdf, 0.0f);
        }
        ASSERT_TRUE(is_finite(bsdf.albedo()));
    }
}

}  // namespace
}  // namespace velatura::shading
