// SPDX-License-Identifier: Apache-2.0
#include "light_fixtures.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::lights {
namespace {

using scene::LightKind;

/// A sky that is brighter towards +X, and dark below.
EnvironmentImage sky() {
    EnvironmentImage image{32, 16, {}};
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 32; ++x)
            image.texels.push_back(Rgb(y < 9 ? 1.0f + float(std::abs(x - 24) < 5) * 20.0f : 0.01f));
    return image;
}

scene::Light dome(bool textured) {
    scene::Light light = light_of(LightKind::Dome);
    if (textured) light.texture_file = "sky.exr";
    return light;
}

/// Windows around the origin: one overhead, one that is slanted and sheared, one that overlaps it,
/// and one that turns its back.
std::vector<Mat4d> windows() {
    return {translation(0, 0, 1), matrix_of({0, 2, 0.5}, {0.3, 0, 1}, {1, 0, 0}, {-2, 0.2, 0.4}),
            matrix_of({0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {-2.5, 0.2, 0.4}),
            matrix_of({1, 0, 0}, {0, -1, 0}, {0, 0, -1}, {0.5, 0.5, 2})};
}

const Vec3 receivers[] = {
    {0, 0, 0}, {0.1f, 0.2f, 0.95f}, {-1.9f, 0.2f, 0.3f}, {0, 0, 1}, {5, 5, 50}};

LightSet make_lights(const scene::Scene& scene, Diagnostics& diagnostics, bool compensate = false) {
    return LightSet(scene, [](const scene::Light&) { return Result<EnvironmentImage>(sky()); },
                    diagnostics, {.compensate_mis = compensate});
}

TEST(Portals, DensityIsThatOfTheSamplesAndIntegratesToOne) {
    for (const bool textured : {false, true}) {
        scene::Scene scene = scene_of({dome(textured)});
        scene.lights[0].render_from_portals = windows();
        Diagnostics diagnostics;
        const LightSet lights = make_lights(scene, diagnostics);
        EXPECT_TRUE(diagnostics.all().empty());
        for (const Vec3& p : receivers) {
            int different = 0;
            for (int i = 0; i < 2000; ++i) {
                const sampling::PixelSampler sampler(3, 1, 1, uint64_t(i));
                const auto s =
                    lights.sample(0, p, sampler.get_2d(0, sampling::Purpose::LightSurface));
                ASSERT_TRUE(s);
                const auto hit = lights.intersect(0, p, s->wi);
                ASSERT_TRUE(hit && std::isinf(hit->t) && std::isinf(s->distance));
                // Directions rounded to float fall off the edge of a window now and then
                different += std::abs(hit->pdf - s->pdf) > 1e-3f * s->pdf;
            }
            EXPECT_LE(different, 4);
            const Estimate mass = integrate(16384, [&](const Vec2& u) {
                return 4.0 * pi_d * double(lights.pdf(0, p, uniform_direction(u)));
            });
            EXPECT_NEAR(mass.mean, 1.0, 4.0 * mass.standard_error + 2e-3)
                << "detectable " << mass.detectable();
            // Uniform directions hardly ever find the small window of the farthest receiver
            EXPECT_TRUE(p.z > 10.0f || mass.standard_error < 5e-3) << mass.standard_error;
        }
    }
}

TEST(Portals, ChangeNoIrradiance) {
    for (const bool textured : {false, true}) {
        const scene::Scene plain_scene = scene_of({dome(textured)});
        scene::Scene scene = plain_scene;
        scene.lights[0].render_from_portals = windows();
        Diagnostics diagnostics;
        const LightSet plain = make_lights(plain_scene, diagnostics),
                       lights = make_lights(scene, diagnostics);
        for (const Vec3& p : receivers) {
            for (const Vec3& n : {Vec3(0, 0, 1), Vec3(-1, 0, 0), Vec3(0.6f, -0.8f, 0)}) {
                const Estimate a = irradiance(plain, p, n, 8192),
                               b = irradiance(lights, p, n, 8192);
                const double error = std::sqrt(a.standard_error * a.standard_error +
                                               b.standard_error * b.standard_error);
                EXPECT_LE(std::abs(a.mean - b.mean), 4.0 * error + 1e-6 * a.mean);
                EXPECT_LE(5.28 * error, 3e-2 * a.mean);
            }
        }
    }
}

TEST(Portals, WhereNoneFacesThePointTheyChangeNothing) {
    scene::Scene scene = scene_of({dome(true)});
    const scene::Scene plain_scene = scene;
    scene.lights[0].render_from_portals = {translation(0, 0, 1)};
    Diagnostics diagnostics;
    const LightSet plain = make_lights(plain_scene, diagnostics),
                   lights = make_lights(scene, diagnostics);
    for (int i = 0; i < 100; ++i) {
        const sampling::PixelSampler sampler(3, 1, 1, uint64_t(i));
        const Vec2 u = sampler.get_2d(0, sampling::Purpose::LightSurface);
        const auto a = plain.sample(0, {0, 0, 2}, u), b = lights.sample(0, {0, 0, 2}, u);
        ASSERT_EQ(a->wi, b->wi);
        ASSERT_EQ(a->pdf, b->pdf);
    }
}

TEST(Portals, SpendSamplesOnTheWindow) {
    // Light through one small window: second moment of its estimate with and without the portal
    scene::Scene scene = scene_of({dome(true)});
    const scene::Scene plain_scene = scene;
    const Mat4d window = matrix_of({0.4, 0, 0}, {0, 0.4, 0}, {0, 0, 1}, {0.3, 0, 1});
    scene.lights[0].render_from_portals = {window};
    scene::Scene pane = scene_of({light_of(LightKind::Rect, window)});
    Diagnostics diagnostics;
    const LightSet plain = make_lights(plain_scene, diagnostics),
                   lights = make_lights(scene, diagnostics);
    const LightSet opening(pane, {}, diagnostics);
    const auto moments = [&](const LightSet& set) {
        double sum = 0, squares = 0;
        constexpr int samples = 20000;
        for (int i = 0; i < samples; ++i) {
            const sampling::PixelSampler sampler(5, 1, 1, uint64_t(i));
            const auto s =
                set.sample(0, Vec3(0.0f), sampler.get_2d(0, sampling::Purpose::LightSurface));
            if (!s || !opening.intersect(0, Vec3(0.0f), s->wi)) continue;
            const double x = double(s->Le.x) * double(s->wi.z) / double(s->pdf);
            sum += x;
            squares += x * x;
        }
        const double mean = sum / samples;
        return squares / samples / (mean * mean) - 1.0;
    };
    const double without = moments(plain), with = moments(lights);
    std::printf("relative variance without portal %.3g, with %.3g\n", without, with);
    EXPECT_LT(with * 5.0, without);
}

TEST(Portals, WithoutAreaTheyAreNamed) {
    scene::Scene scene = scene_of({dome(false)});
    scene.lights[0].render_from_portals = {matrix_of({0, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0})};
    Diagnostics diagnostics;
    const LightSet lights = make_lights(scene, diagnostics);
    EXPECT_TRUE(lights.is_on(0));
    ASSERT_EQ(diagnostics.all().size(), 1u);
    EXPECT_EQ(diagnostics.all()[0].code, "light-portal");
}

}  // namespace
}  // namespace velatura::lights
