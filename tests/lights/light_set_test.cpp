// SPDX-License-Identifier: Apache-2.0
#include "light_fixtures.h"
#include "lights/emitter_tree.h"
#include "lights/light_selector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace velatura::lights {
namespace {

using scene::LightKind;

const Mat4d skewed = matrix_of({1.3, 0.2, 0}, {-0.3, 0.8, 0.1}, {0.1, 0.4, 1.1}, {0.2, -0.1, 1.4});

std::vector<scene::Light> finite_lights() {
    std::vector<scene::Light> lights;
    for (const LightKind kind :
         {LightKind::Rect, LightKind::Disk, LightKind::Sphere, LightKind::Cylinder}) {
        lights.push_back(light_of(kind, translation(0.1, 0.2, 1.2)));
        lights.push_back(light_of(kind, skewed));
    }
    return lights;
}

TEST(LightSet, DensityIntegratesToOneOverTheDirectionsThatHit) {
    const scene::Scene scene = scene_of(finite_lights());
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    for (uint32_t i = 0; i < lights.size(); ++i) {
        for (const Vec3& p : {Vec3(0.0f), Vec3(0.9f, -0.6f, 0.3f)}) {
            if (!lights.sample(i, p, {0.5f, 0.5f})) continue;
            const Estimate e = integrate(8192, [&](const Vec2& u) {
                return 4.0 * pi_d * double(lights.pdf(i, p, uniform_direction(u)));
            });
            // Disks sampled through the square around them lose the samples beside them
            double expected = 1.0;
            if (scene.lights[i].kind == LightKind::Disk) {
                const Estimate found = integrate(
                    4096, [&](const Vec2& u) { return lights.sample(i, p, u) ? 1.0 : 0.0; });
                expected = found.mean;
            }
            EXPECT_NEAR(e.mean, expected, 4 * e.standard_error + 1e-3)
                << "light " << i << ", detectable " << e.detectable();
            // The density of cylinders grows without bound towards their outline
            const bool is_cylinder = scene.lights[i].kind == LightKind::Cylinder;
            EXPECT_LE(e.standard_error, is_cylinder ? 0.04 : 0.01) << "light " << i;
        }
    }
}

TEST(LightSet, SamplesAreFoundAgainByRaysWithTheSameNumbers) {
    std::vector<scene::Light> all = finite_lights();
    scene::Light far = light_of(LightKind::Rect, translation(0, 0, 5000));
    all.push_back(far);
    far.kind = LightKind::Sphere;
    all.push_back(far);
    all.push_back(light_of(LightKind::Distant));
    all.push_back(light_of(LightKind::Dome));
    const scene::Scene scene = scene_of(all);
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    for (uint32_t i = 0; i < lights.size(); ++i) {
        int samples = 0, lost = 0, different = 0;
        for (int k = 0; k < 4096; ++k) {
            const sampling::PixelSampler sampler(1, 2, 3, uint64_t(k));
            const Vec2 u = sampler.get_2d(0, sampling::Purpose::LightSurface);
            const Vec3 p(0.1f * float(k % 3), -0.2f, 0.05f);
            const auto s = lights.sample(i, p, u);
            if (!s) continue;
            ++samples;
            EXPECT_NEAR(s->wi.length(), 1.0f, 1e-6f);
            EXPECT_TRUE(s->pdf > 0.0f && std::isfinite(s->pdf));
            const auto hit = lights.intersect(i, p, s->wi);
            if (!hit) {
                ++lost;
                continue;
            }
            EXPECT_EQ(hit->Le, s->Le);
            if (std::isinf(s->distance)) {
                EXPECT_TRUE(std::isinf(hit->t));
            } else if (std::abs(hit->t - s->distance) > 1e-3f * s->distance) {
                ++different;  // near a silhouette a rounded direction lands far behind
            }
            if (std::abs(hit->pdf - s->pdf) > 1e-3f * s->pdf) ++different;
        }
        EXPECT_GT(samples, 2000) << "light " << i;
        // Directions rounded to float leave the light only where they graze its edge
        EXPECT_LE(lost, samples / 200) << "light " << i;
        EXPECT_LE(different, samples / 100) << "light " << i;
    }
}

TEST(LightSet, ScalingByPowersOfTwoChangesNothingButDistances) {
    std::vector<scene::Light> original = finite_lights();
    scene::Light tiny = light_of(LightKind::Rect, translation(0, 0, 900));
    original.push_back(tiny);
    const scene::Scene scene = scene_of(original);
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    for (const int k : {-40, -20, -3, 7, 20, 40}) {
        const float factor = std::ldexp(1.0f, k);
        scene::Scene scaled = scene;
        for (scene::Light& light : scaled.lights)
            for (int row = 0; row < 4; ++row)
                for (int column = 0; column < 3; ++column)
                    light.render_from_light[row][column] *= double(factor);
        const LightSet other(scaled, {}, diagnostics);
        for (uint32_t i = 0; i < lights.size(); ++i) {
            for (int n = 0; n < 64; ++n) {
                const sampling::PixelSampler sampler(5, int(i), 0, uint64_t(n));
                const Vec2 u = sampler.get_2d(0, sampling::Purpose::LightSurface);
                const Vec3 p(0.3f, 0.1f * float(n % 5), -0.2f);
                const auto a = lights.sample(i, p, u), b = other.sample(i, p * factor, u);
                ASSERT_EQ(a.has_value(), b.has_value());
                if (!a) continue;
                EXPECT_EQ(a->wi, b->wi);
                EXPECT_EQ(a->pdf, b->pdf);
                EXPECT_EQ(a->distance * factor, b->distance);
                EXPECT_EQ(lights.pdf(i, p, a->wi), other.pdf(i, p * factor, a->wi));
            }
        }
        const Box3 box(Vec3(-1.0f), Vec3(1.0f));
        for (const SelectionKind kind : {SelectionKind::Power, SelectionKind::Tree}) {
            const auto s = make_light_selector(lights, box, {kind});
            const auto t =
                make_light_selector(other, Box3(box.min * factor, box.max * factor), {kind});
            const Receiver at{Vec3(0.3f, 0.1f, -0.2f)};
            Receiver scaled_at = at;
            scaled_at.p *= factor;
            for (uint32_t i = 0; i < lights.size(); ++i)
                EXPECT_FLOAT_EQ(s->pmf(at, i), t->pmf(scaled_at, i));
        }
    }
    EXPECT_EQ(diagnostics.warning_count(), 0u);
}

TEST(LightSet, TreeFindsTheHitsThatTheListFinds) {
    std::vector<scene::Light> many;
    for (int i = 0; i < 300; ++i) {
        const LightKind kinds[] = {LightKind::Rect, LightKind::Disk, LightKind::Sphere,
                                   LightKind::Cylinder};
        const sampling::PixelSampler s(11, i, 0, 0);
        const Vec2 a = s.get_2d(0, sampling::Purpose::Lens);
        const Vec2 b = s.get_2d(0, sampling::Purpose::PixelFilter);
        Mat4d m = skewed;
        m[3][0] = 20 * double(a.x) - 10;
        m[3][1] = 20 * double(a.y) - 10;
        m[3][2] = i % 10 == 0 ? 2.0 : 20 * double(b.x) - 10;
        many.push_back(light_of(kinds[i % 4], m));
    }
    many.push_back(light_of(LightKind::Dome));
    const scene::Scene scene = scene_of(many);
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    int total = 0;
    for (int k = 0; k < 2000; ++k) {
        const sampling::PixelSampler s(13, k, 0, 0);
        const Vec2 a = s.get_2d(0, sampling::Purpose::Lens);
        Vec3 d = uniform_direction(s.get_2d(0, sampling::Purpose::BsdfDirection));
        // Rays along axes too: divisions by zero
        if (k % 5 == 0) d = Vec3(0, k % 2 == 0 ? 1.0f : -1.0f, 0);
        const Vec3 o(12 * a.x - 6, 12 * a.y - 6, 2.0f);
        const float t_max = k % 3 == 0 ? 6.0f : std::numeric_limits<float>::infinity();
        std::map<uint32_t, float> expected, found;
        for (uint32_t i = 0; i < lights.size(); ++i) {
            const auto hit = lights.intersect(i, o, d);
            if (hit && (hit->t < t_max || t_max > 100.0f)) expected[i] = hit->t;
        }
        lights.for_each_hit(o, d, t_max, 0.0f, [&](const LightHit& hit) {
            EXPECT_EQ(found.count(hit.light), 0u);
            found[hit.light] = hit.t;
        });
        EXPECT_EQ(found, expected);
        total += int(found.size());
    }
    EXPECT_GT(total, 2000);
}

TEST(EmitterTree, RaysInsideTheSideOfABoxAreNotLost) {
    std::vector<EmitterTree::Item> items;
    for (uint32_t i = 0; i < 40; ++i)
        items.push_back({i, Box3d(Vec3d(2.0 * i, -1, 0), Vec3d(2.0 * i + 1, 1, 0))});
    const EmitterTree tree(items);
    int found = 0;
    // The boxes are flat at z = 0 and the direction has no z: 0 · infinity
    tree.for_each({-5, 0, 0}, {1, 0, 0}, 1e9, [&](uint32_t) { ++found; });
    EXPECT_EQ(found, 40);
    found = 0;
    tree.for_each({-5, 0, -0.5}, {1, 0, 0}, 1e9, [&](uint32_t) { ++found; });
    EXPECT_EQ(found, 0);
    tree.for_each({-5, 0, 0}, {1, 0, 0}, 8.0, [&](uint32_t) { ++found; });
    EXPECT_GE(found, 2);  // the boxes that start within the ray,
    EXPECT_LE(found, 8);  // with those of the same leaves
}

TEST(LightSet, NegativeRadianceCountsAsZeroAndIsNamed) {
    scene::Light light = light_of(LightKind::Sphere, translation(0, 0, 2));
    light.Le = Rgb(1.0f, -1.0f, 0.0f);
    const scene::Scene scene = scene_of({light});
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    EXPECT_EQ(lights.intersect(0, Vec3(0.0f), {0, 0, 1})->Le, Rgb(1, 0, 0));
    ASSERT_EQ(diagnostics.all().size(), 1u);
    EXPECT_EQ(diagnostics.all()[0].code, "light-radiance");
}

TEST(LightSet, DegenerateLightsAreOffWithAWarningEach) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const Mat4d flat = matrix_of({1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {0, 0, 1});
    const Mat4d zero = matrix_of({0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 1});
    const Mat4d broken = matrix_of({nan, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 1});
    std::vector<scene::Light> bad;
    for (const LightKind kind :
         {LightKind::Rect, LightKind::Disk, LightKind::Sphere, LightKind::Cylinder}) {
        bad.push_back(light_of(kind, zero));
        bad.push_back(light_of(kind, broken));
        scene::Light point = light_of(kind, translation(0, 0, 1));
        point.radius = point.width = 0.0f;
        bad.push_back(point);
        point.Le = Rgb(std::numeric_limits<float>::infinity());
        bad.push_back(point);
    }
    bad.push_back(light_of(LightKind::Sphere, flat));
    bad.push_back(light_of(LightKind::Distant, zero));
    for (size_t i = 0; i < bad.size(); ++i) bad[i].name = "/Bad" + std::to_string(i);
    bad.push_back(light_of(LightKind::Rect, flat));  // a flat rect is still a rect
    bad.push_back(light_of(LightKind::Disk, flat));
    scene::Light black = light_of(LightKind::Sphere, translation(0, 0, 1));
    black.Le = Rgb(0.0f);
    bad.push_back(black);

    const scene::Scene scene = scene_of(bad);
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    const size_t broken_count = bad.size() - 3;
    EXPECT_EQ(diagnostics.warning_count(), broken_count);
    for (uint32_t i = 0; i < lights.size(); ++i) {
        const bool is_flat_but_fine = i >= broken_count && i < broken_count + 2;
        EXPECT_EQ(lights.is_on(i), is_flat_but_fine) << i;
        EXPECT_EQ(lights.sample(i, Vec3(0.0f), {0.5f, 0.5f}).has_value(), is_flat_but_fine) << i;
    }
}

TEST(LightSet, SamplesAreFiniteEverywhere) {
    const scene::Scene scene = scene_of(finite_lights());
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    int found = 0;
    for (uint32_t i = 0; i < lights.size(); ++i) {
        for (const float x : {0.0f, 0.5f, 0.6f, 1e-30f, 1e10f, -1e19f}) {
            for (const float z : {0.7f, 1.2f, 1.7f, 1.1999999f, -1e12f}) {
                for (const float u : {0.0f, 0.5f, 0x1.fffffep-1f}) {
                    const auto s = lights.sample(i, {x, 0.2f, z}, {u, u});
                    if (!s) continue;
                    ++found;
                    EXPECT_TRUE(is_finite(s->wi) && std::isfinite(s->pdf) && s->pdf > 0.0f);
                    EXPECT_NEAR(s->wi.length(), 1.0f, 1e-6f);
                    EXPECT_TRUE(s->distance > 0.0f && std::isfinite(s->distance));
                    EXPECT_TRUE(is_finite(s->Le));
                }
            }
        }
    }
    EXPECT_GT(found, 300);
}

TEST(LightShaping, ConeCutsAtItsAngleAndSoftensInside) {
    scene::Light light = light_of(LightKind::Sphere, translation(0, 0, 1));
    light.shaping.is_active = true;
    light.shaping.cone_angle_deg = 30.0f;
    const auto seen_at = [&](double degrees, float softness) {
        light.shaping.cone_softness = softness;
        const scene::Scene scene = scene_of({light});
        Diagnostics diagnostics;
        const LightSet lights(scene, {}, diagnostics);
        const double a = degrees * pi_d / 180;
        // Look at the center from a point at this angle off the axis −Z
        const Vec3 d(float(-std::sin(a)), 0, float(std::cos(a)));
        return lights.intersect(0, Vec3(0, 0, 1) - d * 4.0f, d)->Le.x;
    };
    EXPECT_EQ(seen_at(29.9, 0.0f), 1.0f);
    EXPECT_EQ(seen_at(30.1, 0.0f), 0.0f);
    EXPECT_EQ(seen_at(14.9, 0.5f), 1.0f);
    EXPECT_NEAR(seen_at(22.5, 0.5f), 0.5f, 1e-5f);
    EXPECT_NEAR(seen_at(26.25, 0.5f), 0.15625f, 1e-5f);  // 1 − smoothstep(3/4)
    EXPECT_EQ(seen_at(30.1, 0.5f), 0.0f);
    light.shaping.cone_angle_deg = 90.0f;
    EXPECT_EQ(seen_at(89.9, 0.0f), 1.0f);
    EXPECT_EQ(seen_at(90.1, 0.0f), 0.0f);
    light.shaping.cone_angle_deg = 180.0f;
    EXPECT_EQ(seen_at(179.0, 0.0f), 1.0f);
    EXPECT_NEAR(seen_at(135.0, 0.5f), 0.5f, 1e-5f);
}

TEST(LightShaping, FocusTintsWhatItTakesAway) {
    scene::Light light = light_of(LightKind::Rect, translation(0, 0, 1));
    light.shaping.is_active = true;
    light.shaping.focus = 2.0f;
    light.shaping.focus_tint = Rgb(0.0f, 1.0f, 0.5f);
    const scene::Scene scene = scene_of({light});
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    const Rgb Le = lights.intersect(0, {-0.6f, 0, 0.2f}, {0.6f, 0, 0.8f})->Le;
    EXPECT_NEAR(Le.x, 0.64f, 1e-6f);
    EXPECT_NEAR(Le.y, 1.0f, 1e-6f);
    EXPECT_NEAR(Le.z, 0.82f, 1e-6f);
}

TEST(LightSelector, ProbabilitiesSumToOneAndMatchTheChoices) {
    std::vector<scene::Light> all = finite_lights();
    all[1].Le = Rgb(1e-6f);
    all[2].Le = Rgb(1e6f);
    all[3].Le = Rgb(0.0f);
    all.push_back(light_of(LightKind::Dome));
    const scene::Scene scene = scene_of(all);
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    for (const SelectionKind kind : {SelectionKind::Uniform, SelectionKind::Power}) {
        SelectorOptions options;
        options.kind = kind;
        const auto selector = make_light_selector(lights, Box3(Vec3(-1.0f), Vec3(1.0f)), options);
        const Receiver at{Vec3(0.0f)};
        constexpr int steps = 1 << 16;
        std::vector<int> chosen(lights.size(), 0);
        for (int i = 0; i < steps; ++i) {
            const auto choice = selector->select(at, double(i) / double(steps));
            ASSERT_TRUE(choice);
            EXPECT_EQ(choice->pmf, selector->pmf(at, choice->light));
            ++chosen[choice->light.index];
        }
        double sum = 0.0;
        for (uint32_t i = 0; i < lights.size(); ++i) {
            const double pmf = double(selector->pmf(at, i));
            sum += pmf;
            EXPECT_EQ(pmf > 0.0, lights.is_on(i));
            // Every light keeps its share of the uniform part: a tenth of the choices by default
            EXPECT_TRUE(!lights.is_on(i) || pmf >= 0.1 / double(lights.size())) << i;
            EXPECT_EQ(lights.power(i, 1.0) > 0.0, lights.is_on(i));
            // Evenly spaced numbers: off by one at either end
            EXPECT_NEAR(chosen[i], pmf * steps, 2.0) << i;
        }
        EXPECT_NEAR(sum, 1.0, 1e-6);
        EXPECT_EQ(selector->pmf(at, 3), 0.0f);
        EXPECT_EQ(kind == SelectionKind::Power, selector->pmf(at, 2) > 0.5f);
    }
    const scene::Scene empty;
    const LightSet none(empty, {}, diagnostics);
    for (const SelectionKind kind :
         {SelectionKind::Uniform, SelectionKind::Power, SelectionKind::Tree}) {
        const auto selector = make_light_selector(none, Box3(), {kind});
        EXPECT_TRUE(selector->is_empty());
        EXPECT_FALSE(selector->select({Vec3(0.0f)}, 0.5));
    }
}

TEST(LightSelector, PowerOfPlainShapesIsPiTimesAreaTimesRadiance) {
    std::vector<scene::Light> all = finite_lights();
    const scene::Scene scene = scene_of({all[0], all[2], all[4], all[6]});
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    EXPECT_NEAR(lights.power(0, 1), pi_d, 1e-6);
    EXPECT_NEAR(lights.power(1, 1), pi_d * pi_d / 4, 1e-6);
    EXPECT_NEAR(lights.power(2, 1), pi_d * pi_d, 1e-6);
    EXPECT_NEAR(lights.power(3, 1), pi_d * pi_d, 1e-6);
}

}  // namespace
}  // namespace velatura::lights
