// SPDX-License-Identifier: Apache-2.0
// Points of lights by area: the same irradiance as by solid angle, and areas by closed form.
#include "light_fixtures.h"
#include "lights/light_selector.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::lights {
namespace {

using scene::LightKind;

const Mat4d skewed = matrix_of({1.3, 0.2, 0}, {-0.3, 0.8, 0.1}, {0.1, 0.4, 1.1}, {0.2, -0.1, 2.4});

TEST(AreaSampling, HasTheIrradianceOfSolidAngles) {
    for (const LightKind kind :
         {LightKind::Rect, LightKind::Disk, LightKind::Sphere, LightKind::Cylinder}) {
        for (const Mat4d& m : {translation(0.1, 0.2, 1.2), skewed}) {
            const scene::Scene scene = scene_of({light_of(kind, m)});
            Diagnostics diagnostics;
            const LightSet by_angle(scene, {}, diagnostics);
            const LightSet by_area(scene, {}, diagnostics, {.by_area = true});
            const Vec3 p(0.9f, -0.6f, 0.3f), n(0, 0, 1);
            const Estimate expected = irradiance(by_angle, p, n), e = irradiance(by_area, p, n);
            const double error = std::hypot(expected.standard_error, e.standard_error);
            std::printf("kind %d: by area %.6f, by solid angle %.6f, detectable %.2g\n", int(kind),
                        e.mean, expected.mean, 5.28 * error);
            EXPECT_NEAR(e.mean, expected.mean, 4 * error);
            EXPECT_LT(error, 0.005 * expected.mean);
        }
    }
}

TEST(AreaSampling, LeavesLightsAtInfinityAsTheyAre) {
    for (const LightKind kind : {LightKind::Distant, LightKind::Dome}) {
        const scene::Scene scene = scene_of({light_of(kind)});
        Diagnostics diagnostics;
        const LightSet by_angle(scene, {}, diagnostics);
        const LightSet by_area(scene, {}, diagnostics, {.by_area = true});
        const auto a = by_angle.sample(0, Vec3(0.0f), {0.3f, 0.6f});
        const auto b = by_area.sample(0, Vec3(0.0f), {0.3f, 0.6f});
        ASSERT_TRUE(a && b);
        EXPECT_EQ(a->wi, b->wi);
        EXPECT_EQ(a->pdf, b->pdf);
    }
}

TEST(AreaSampling, AreasAreThoseOfTheShapes) {
    std::vector<scene::Light> all;
    for (const LightKind kind : {LightKind::Rect, LightKind::Disk, LightKind::Sphere,
                                 LightKind::Cylinder, LightKind::Distant})
        all.push_back(light_of(kind, translation(0, 0, 2)));
    all[0].width = 3;
    all[0].height = 2;
    all[1].radius = all[2].radius = all[3].radius = 0.5f;
    all[3].length = 4;
    const scene::Scene scene = scene_of(all);
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    const double areas[] = {6.0, pi_d / 4, pi_d, 4 * pi_d, 0.0};
    double sum = 0.0;
    for (uint32_t i = 0; i < lights.size(); ++i) {
        EXPECT_NEAR(lights.area(i), areas[i], 1e-9) << i;
        sum += areas[i];
    }
    // The distant light is one of five lights; the others share the rest by area
    const auto selector = make_light_selector(lights, Box3(), {SelectionKind::Area});
    for (uint32_t i = 0; i < 4; ++i)
        EXPECT_NEAR(double(selector->pmf({}, i)), 0.8 * areas[i] / sum, 1e-6) << i;
    EXPECT_NEAR(double(selector->pmf({}, 4)), 0.2, 1e-6);
}

}  // namespace
}  // namespace velatura::lights
