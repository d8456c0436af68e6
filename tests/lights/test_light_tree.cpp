// SPDX-License-Identifier: Apache-2.0
#include "light_fixtures.h"
#include "lights/light_selector.h"
#include "lights/light_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace velatura::lights {
namespace {

using scene::LightKind;

Vec3d random_direction(std::mt19937& random) {
    std::normal_distribution<double> normal;
    const Vec3d v(normal(random), normal(random), normal(random));
    return v / std::sqrt(v.dot(v));
}

/// A light of random kind, size, strength, place and direction; some with a cone.
scene::Light random_light(std::mt19937& random, double extent) {
    std::uniform_real_distribution<double> unit;
    const Vec3d z = random_direction(random);
    Vec3d x = z.cross(random_direction(random));
    x = x / std::sqrt(x.dot(x));
    const double size = std::exp(unit(random) * 3.0 - 3.0);
    const auto coordinate = [&] { return (unit(random) * 2.0 - 1.0) * extent; };
    const double px = coordinate(), py = coordinate(), pz = coordinate();
    const LightKind kinds[] = {LightKind::Rect, LightKind::Disk, LightKind::Sphere,
                               LightKind::Cylinder};
    scene::Light light = light_of(kinds[random() % 4],
                                  matrix_of(x * size, z.cross(x) * size, z * size, {px, py, pz}));
    light.Le = Rgb(float(std::exp(unit(random) * 6.0)));
    if (random() % 3 == 0) {
        light.shaping.is_active = true;
        light.shaping.cone_angle_deg = float(10.0 + 120.0 * unit(random));
        light.shaping.cone_softness = float(unit(random));
    }
    return light;
}

std::vector<scene::Light> random_lights(size_t count, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<scene::Light> lights;
    for (size_t i = 0; i < count; ++i) lights.push_back(random_light(random, 10.0));
    return lights;
}

Receiver random_receiver(std::mt19937& random) {
    const Vec3d p =
        random_direction(random) * 12.0 * std::uniform_real_distribution<double>()(random);
    const Vec3d n = random_direction(random);
    Receiver at{Vec3(float(p.x), float(p.y), float(p.z))};
    if (random() % 3 != 0) at.n = Vec3(float(n.x), float(n.y), float(n.z));
    at.both_sides = random() % 2 == 0;
    return at;
}

/// Radiance times cosine that one sample of a light brings, over its density; 0 when none.
double contribution(const LightSet& lights, LightId light, const Receiver& at, const Vec2& u) {
    const auto sample = lights.sample(light, at.p, u);
    if (!sample) return 0.0;
    double cosine = 1.0;
    if (at.n != Vec3(0.0f)) {
        cosine = double(at.n.dot(sample->wi));
        cosine = at.both_sides ? std::abs(cosine) : std::max(0.0, cosine);
    }
    return double(luminance(sample->Le)) * cosine / double(sample->pdf);
}

TEST(LightTree, ProbabilitiesMatchTheChoicesAndSumToOneButForDeadEnds) {
    for (const size_t count : {1u, 2u, 8u, 9u, 40u, 700u}) {
        std::vector<scene::Light> all = random_lights(count, uint32_t(count));
        for (int i = 0; i < 12; ++i) {
            all.push_back(light_of(LightKind::Distant));
            all.back().Le = Rgb(float(i + 1));
        }
        all.push_back(light_of(LightKind::Dome));
        const scene::Scene scene = scene_of(all);
        Diagnostics diagnostics;
        const LightSet lights(scene, {}, diagnostics);
        const auto tree = make_light_selector(lights, Box3(), {SelectionKind::Tree});
        std::mt19937 random(7);
        for (int round = 0; round < 20; ++round) {
            const Receiver at = random_receiver(random);
            double sum = 0.0;
            std::vector<double> pmf;
            for (uint32_t i = 0; i < lights.size(); ++i) {
                pmf.push_back(double(tree->pmf(at, i)));
                sum += pmf.back();
            }
            EXPECT_LE(sum, 1.0 + 1e-5);
            constexpr int steps = 1 << 14;
            std::vector<int> chosen(lights.size(), 0);
            int dead_ends = 0;  // a cluster may look as if it shone here, its lights not
            for (int i = 0; i < steps; ++i) {
                const auto choice = tree->select(at, (i + 0.5) / steps);
                if (!choice) {
                    ++dead_ends;
                    continue;
                }
                ASSERT_EQ(choice->pmf, tree->pmf(at, choice->light));
                ++chosen[choice->light.index];
            }
            // Every gap between choices is off by one at either end
            EXPECT_NEAR(dead_ends, (1.0 - sum) * steps, 8.0);
            for (uint32_t i = 0; i < lights.size(); ++i)
                EXPECT_NEAR(chosen[i], pmf[i] * steps, 2.0) << count << " lights, light " << i;
        }
    }
}

TEST(LightTree, LeavesOutOnlyLightsThatBringNothing) {
    const scene::Scene scene = scene_of(random_lights(300, 5));
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    const auto tree = make_light_selector(lights, Box3(), {SelectionKind::Tree});
    std::mt19937 random(11);
    int left_out = 0;
    for (int round = 0; round < 60; ++round) {
        const Receiver at = random_receiver(random);
        for (uint32_t i = 0; i < lights.size(); ++i) {
            if (tree->pmf(at, i) > 0.0f) continue;
            ++left_out;
            for (int k = 0; k < 16; ++k) {
                const Vec2 u(float(k % 4) / 4.0f + 0.125f, float(k / 4) / 4.0f + 0.125f);
                ASSERT_LE(contribution(lights, i, at, u), 0.0) << "light " << i;
            }
        }
    }
    EXPECT_GT(left_out, 1000);
}

TEST(LightTree, ScalingByAPowerOfTwoChangesNoProbability) {
    std::vector<scene::Light> all = random_lights(100, 3);
    const scene::Scene scene = scene_of(all);
    for (scene::Light& light : all) {
        for (int row = 0; row < 4; ++row)
            for (int column = 0; column < 3; ++column)
                light.render_from_light[row][column] *= 0x1p20;
    }
    const scene::Scene large_scene = scene_of(all);
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics), large(large_scene, {}, diagnostics);
    const auto tree = make_light_selector(lights, Box3(), {SelectionKind::Tree});
    const auto large_tree = make_light_selector(large, Box3(), {SelectionKind::Tree});
    std::mt19937 random(2);
    for (int round = 0; round < 50; ++round) {
        const Receiver at = random_receiver(random);
        Receiver far = at;
        far.p *= 0x1p20f;
        for (uint32_t i = 0; i < lights.size(); ++i)
            ASSERT_EQ(tree->pmf(at, i), large_tree->pmf(far, i));
    }
}

/// Variance of one-sample estimates of the direct light at random receivers, over the squared sum.
double relative_variance(const LightSet& lights, SelectionKind kind) {
    const auto selector = make_light_selector(lights, Box3(Vec3(-10.0f), Vec3(10.0f)), {kind});
    std::mt19937 random(23);
    std::uniform_real_distribution<float> unit;
    double total = 0.0;
    constexpr int receivers = 40, samples = 4000;
    for (int round = 0; round < receivers; ++round) {
        Receiver at = random_receiver(random);
        at.both_sides = false;
        double sum = 0.0, squares = 0.0;
        for (int i = 0; i < samples; ++i) {
            const auto choice = selector->select(at, double(unit(random)));
            const Vec2 u(unit(random), unit(random));
            const double value =
                choice ? contribution(lights, choice->light.index, at, u) / double(choice->pmf)
                       : 0.0;
            sum += value;
            squares += value * value;
        }
        const double mean = sum / samples;
        if (mean > 0.0) total += (squares / samples - mean * mean) / (mean * mean);
    }
    return total / receivers;
}

TEST(LightTree, ManyUnequalLightsCostFewerSamplesThanByPower) {
    for (const size_t count : {64u, 1000u, 10000u}) {
        const scene::Scene scene = scene_of(random_lights(count, 9));
        Diagnostics diagnostics;
        const LightSet lights(scene, {}, diagnostics);
        const double tree = relative_variance(lights, SelectionKind::Tree);
        const double power = relative_variance(lights, SelectionKind::Power);
        const double uniform = relative_variance(lights, SelectionKind::Uniform);
        std::printf("%5zu lights, relative variance: tree %.3g, power %.3g, uniform %.3g\n", count,
                    tree, power, uniform);
        EXPECT_LT(tree * 3.0, power) << count;
        EXPECT_LT(power, uniform) << count;
    }
}

TEST(LightBounds, MergedConesHoldBothOfThem) {
    std::mt19937 random(31);
    std::uniform_real_distribution<double> unit;
    for (int round = 0; round < 2000; ++round) {
        EmissionCone a, b;
        a.axis = random_direction(random);
        b.axis = round % 10 == 0 ? -a.axis : random_direction(random);
        a.normals = unit(random) * (round % 3 ? 1.0 : pi_d);
        b.normals = round % 7 ? unit(random) : 0.0;
        const EmissionCone both = merged(a, b);
        for (const EmissionCone* part : {&a, &b}) {
            const double apart = safe_acos(both.axis.dot(part->axis));
            EXPECT_LE(std::min(apart + part->normals, pi_d), both.normals + 1e-7);
        }
    }
}

}  // namespace
}  // namespace velatura::lights
