// SPDX-License-Identifier: Apache-2.0
// Points of lights, chosen without regard to who looks, against directions to the light chosen for
// one who does: both integrate the light's radiance over directions.
#include "light_fixtures.h"
#include "lights/emitter.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

namespace velatura::lights {
namespace {

using scene::LightKind;

struct Case {
    const char* name;
    LightKind kind;
    bool is_shaped = false;
};

scene::Light make_light(const Case& c, const Mat4d& m) {
    scene::Light light = light_of(c.kind, m);
    light.Le = Rgb(1.0f, 0.5f, 0.25f);
    light.width = 1.5f;
    light.height = 0.75f;
    light.radius = 0.5f;
    light.length = 2.0f;
    light.angle_deg = 20.0f;
    if (c.is_shaped) {
        light.shaping.is_active = true;
        light.shaping.cone_angle_deg = 70.0f;
        light.shaping.cone_softness = 0.5f;
        light.shaping.focus = 1.0f;
    }
    return light;
}

/// ∫ Le dω at p by points of the light.
double by_points(const LightSet& lights,
                 const Vec3& p,
                 const Vec2& u,
                 const std::optional<Vec3d>& facing) {
    const EmitterPoint point = lights.sample_point(0, u, facing);
    const Vec3d o(p);
    if (lights.is_infinite(0))
        return double(lights.radiance_at(0, point, o, point.n).x) / point.pdf;
    const Vec3d away = point.p - o;
    const double distance2 = away.dot(away);
    const Vec3d d = away / std::sqrt(distance2);
    return double(lights.radiance_at(0, point, o, d).x) * std::abs(point.n.dot(d)) /
           (distance2 * point.pdf);
}

TEST(LightPoints, BringWhatDirectionsBring) {
    const Case cases[] = {{"rect", LightKind::Rect},
                          {"disk", LightKind::Disk},
                          {"sphere", LightKind::Sphere},
                          {"cylinder", LightKind::Cylinder},
                          {"distant", LightKind::Distant},
                          {"shaped rect", LightKind::Rect, true},
                          {"shaped disk", LightKind::Disk, true},
                          {"shaped sphere", LightKind::Sphere, true}};
    const Mat4d skewed =
        matrix_of({0.75, 0.5, 0.25}, {-0.25, 1.25, 0.5}, {0.125, -0.5, 1.5}, {0.5, 0.25, 1.0});
    const Mat4d mirrored = matrix_of({-1.5, 0, 0}, {0, 0.5, 0}, {0, 0, 1}, {0, 0, 0});
    const Vec3 receivers[] = {Vec3(0.25f, 0.5f, -3.0f), Vec3(1.0f, 2.0f, -2.0f),
                              Vec3(-2.0f, -1.0f, 4.0f), Vec3(0.5f, 0.25f, 1.125f)};
    int compared = 0;
    for (const Case& c : cases) {
        for (const Mat4d& m : {Mat4d(), skewed, mirrored}) {
            Diagnostics diagnostics;
            const scene::Scene scene = scene_of({make_light(c, m)});
            const LightSet lights(scene, {}, diagnostics);
            ASSERT_TRUE(lights.has_points(0)) << c.name;
            for (const Vec3& p : receivers) {
                const Estimate expected = integrate(1 << 11, [&](const Vec2& u) {
                    const auto s = lights.sample(0, p, u);
                    return s ? double(s->Le.x) / double(s->pdf) : 0.0;
                });
                for (const std::optional<Vec3d>& facing :
                     {std::optional<Vec3d>(), std::optional<Vec3d>(Vec3d(0.6, 0.0, -0.8))}) {
                    const Estimate found = integrate(
                        1 << 14, [&](const Vec2& u) { return by_points(lights, p, u, facing); });
                    const double error = std::hypot(expected.standard_error, found.standard_error);
                    if (expected.mean == 0.0) {
                        EXPECT_EQ(found.mean, 0.0) << c.name;
                        continue;
                    }
                    EXPECT_LE(std::abs(found.mean - expected.mean),
                              4.5 * error + 1e-5 * expected.mean)
                        << c.name << " from " << p;
                    EXPECT_LE(5.8 * error, 0.08 * expected.mean)
                        << c.name << " from " << p << ": too noisy to be judged";
                    ++compared;
                }
            }
        }
    }
    fmt::print("{} comparisons, an error of 8 % would be seen in each\n", compared);
    EXPECT_GT(compared, 100);
}

TEST(LightPoints, AreaOfASphere) {
    scene::Light light = light_of(LightKind::Sphere);
    light.radius = 0.75f;
    Diagnostics diagnostics;
    const scene::Scene scene = scene_of({light});
    const LightSet lights(scene, {}, diagnostics);
    const Estimate area = integrate(
        1 << 12, [&](const Vec2& u) { return 1.0 / lights.sample_point(0, u, std::nullopt).pdf; });
    EXPECT_NEAR(area.mean, 4.0 * pi_d * 0.5625, 1e-9);
}

TEST(LightPoints, DomesHaveNone) {
    Diagnostics diagnostics;
    const scene::Scene scene = scene_of({light_of(LightKind::Dome)});
    EXPECT_FALSE(LightSet(scene, {}, diagnostics).has_points(0));
}

}  // namespace
}  // namespace velatura::lights
