// SPDX-License-Identifier: Apache-2.0
#include "lights/light_tree.h"

#include "hard_case.h"
#include "light_fixtures.h"
#include "lights/cluster_weights.h"
#include "lights/light_selector.h"

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

TEST(H29LightTree, LeavesOutOnlyLightsThatBringNothing) {
    const scene::Scene scene = scene_of(random_lights(300, 5));
    Diagnostics diagnostics;
    const LightSet lights(scene, {}, diagnostics);
    const auto tree = make_light_selector(lights, Box3(), {SelectionKind::Tree});
    std::mt19937 random(11);
    int omitted = 0;
    double lost = 0;
    for (int round = 0; round < 60; ++round) {
        const Receiver at = random_receiver(random);
        for (uint32_t i = 0; i < lights.size(); ++i) {
            if (tree->pmf(at, i) > 0.0f) continue;
            ++omitted;
            for (int k = 0; k < 16; ++k) {
                const Vec2 u(float(k % 4) / 4.0f + 0.125f, float(k / 4) / 4.0f + 0.125f);
                lost = hardcase::larger(lost, contribution(lights, i, at, u));
            }
        }
    }
    EXPECT_GT(omitted, 1000);
    hardcase::expect_within(
        {"most that a light brings which is never chosen", lost, 0, 0, "every light, brute force"});
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

TEST(ClusterWeights, FollowTheTreesOwnImportances) {
    std::mt19937 random(77);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const auto vector = [&] { return Vec3d(unit(random), unit(random), unit(random)); };
    std::vector<ClusterTree::Leaf> leaves;
    for (uint32_t i = 0; i < 40; ++i) {
        LightBounds b;
        const Vec3d center = vector() * 3.0,
                    size = (vector() + Vec3d(1.0)) * (i % 3 == 0 ? 1.0 : 0.01);
        b.box = Box3d(center, center + (i % 7 == 0 ? Vec3d(0.0) : size));
        b.cone.axis = vector().normalized();
        b.cone.normals = i % 2 == 0 ? 0.0 : pi_d / 2.0 * (1.0 + unit(random));
        b.cone.spread = i % 5 == 0 ? pi_d / 2.0 : pi_d / 2.0 * (1.0 + unit(random));
        b.cone.is_two_sided = i % 4 == 0;
        b.cone.intensity = std::exp(3.0 * unit(random));
        leaves.push_back({i, b});
    }
    const ClusterTree tree(std::move(leaves));
    // Inner nodes as well as leaves: the children of the first ones, whatever they are
    std::vector<uint32_t> nodes = {0};
    for (size_t i = 0; i < nodes.size(); ++i) {
        const ClusterTree::Node& n = tree.node(nodes[i]);
        if (n.is_leaf || nodes.size() + 2 > ClusterWeights::capacity) continue;
        nodes.push_back(n.left);
        nodes.push_back(n.left + 1);
    }
    ASSERT_GT(nodes.size(), 60u);
    const ClusterWeights weights(tree, nodes);
    size_t dark = 0, lost = 0;
    double worst = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        ClusterReceiver at{vector() * (trial % 10 == 0 ? 1000.0 : 4.0), vector().normalized(),
                           trial % 3 == 0};
        if (trial % 5 == 0) at.n = Vec3d(0.0);
        if (trial % 50 == 0)
            at.p = Vec3d(tree.node(nodes[size_t(trial / 50) % nodes.size()]).center);
        // Very near a light, where rounding is largest against the distance
        if (trial % 50 == 1)
            at.p =
                Vec3d(tree.node(nodes[size_t(trial / 50) % nodes.size()]).center) + vector() * 1e-6;
        // Nearly behind a light, where the sine of the angle loses most of its digits
        if (trial % 50 == 2) {
            const ClusterTree::Node& n = tree.node(nodes[size_t(trial / 50) % nodes.size()]);
            at.p = Vec3d(n.center) - Vec3d(n.axis) * 3.0 + vector() * 1e-3;
        }
        ClusterWeights::Weights found;
        weights.evaluate(at, found);
        for (size_t i = 0; i < nodes.size(); ++i) {
            const double exact = tree.importance(tree.node(nodes[i]), at);
            dark += found[i] == 0.0 ? 1 : 0;
            lost += found[i] == 0.0 && exact > 0.0 ? 1 : 0;
            // Near the edge of a cone a weight is all slack
            if (trial % 50 > 2 && exact > 1e-2 * tree.importance(tree.node(0), at))
                worst = hardcase::larger(worst, std::abs(found[i] / exact - 1.0));
        }
    }
    std::printf("%zu weights of nothing, worst relative difference of the others %.2g\n", dark,
                worst);
    EXPECT_EQ(lost, 0u);
    EXPECT_GT(dark, 10000u);
    EXPECT_LT(worst, 0.05);
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
