// SPDX-License-Identifier: Apache-2.0
// Trees over up to a million unequal lights (docs/engineering/hard_cases.md H29).
#include "emissive_fixtures.h"
#include "hard_case.h"
#include "lights/light_tree.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>

namespace velatura::lights {
namespace {

/// `count` emissive triangles of unequal size and radiance (both over three decades) in clumps of
/// unequal density.
void fill(EmissiveStage& stage, size_t count, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit;
    std::normal_distribution<float> normal;
    scene::Input emission(Rgb(0.0f));
    emission.source = scene::Input::Source::Primvar;
    emission.primvar = scene::intern_primvar(stage.scene, "glow");
    const auto material = stage.add_material(Rgb(0.0f));
    stage.scene.materials[material].emissive_color = emission;
    scene::Primvar glow;
    glow.name = emission.primvar;
    glow.interpolation = scene::Interpolation::Uniform;
    glow.width = 3;
    std::vector<Vec3> points;
    points.reserve(3 * count);
    const auto offset = [&](float size) {
        return Vec3(normal(random), normal(random), normal(random)) * size;
    };
    Vec3 clump(0.0f);
    float spread = 1.0f;
    for (size_t i = 0; i < count; ++i) {
        if (i % 1000 == 0) {
            clump = Vec3(unit(random), unit(random), unit(random)) * 200.0f - Vec3(100.0f);
            spread = std::exp(4.0f * unit(random) - 3.0f);
        }
        const Vec3 center = clump + offset(spread);
        const float size = 1e-2f * std::exp(6.9f * unit(random) - 3.5f);
        for (int k = 0; k < 3; ++k) points.push_back(center + offset(size));
        const float Le = std::exp(6.9f * unit(random));
        for (int c = 0; c < 3; ++c) glow.values.push_back(Le);
    }
    scene::Shape shape = EmissiveStage::triangles(points, material);
    std::get<scene::Mesh>(shape.geometry).primvars = {glow};
    stage.scene.shapes = {std::move(shape)};
}

Receiver receiver_at(std::mt19937& random) {
    std::uniform_real_distribution<float> unit(-100.0f, 100.0f);
    return {Vec3(unit(random), unit(random), unit(random))};
}

TEST(H29ManyLights, ProbabilitiesOfAllSumToOne) {
    double worst = 0;
    for (const size_t count : {100u, 3000u, 30000u}) {
        EmissiveStage stage;
        fill(stage, count, 3);
        const LightSet& lights = stage.prepare();
        const LightTree tree(lights);
        std::mt19937 random(1);
        for (int round = 0; round < 8; ++round) {
            // Every direction counts: no cluster can turn out to bring nothing
            const Receiver at = receiver_at(random);
            double sum = 0;
            for (uint32_t i = 0; i < lights.item_count(); ++i) sum += double(tree.pmf(at, i));
            worst = hardcase::larger(worst, std::abs(sum - 1));
        }
    }
    hardcase::expect_within(
        {"sum of the probabilities of up to 30000 lights, less 1", worst, 1e-4, 0, "all lights"});
}

TEST(H29ManyLights, AMillionAreChosenAmongByTheirProbabilities) {
    EmissiveStage stage;
    fill(stage, 1000000, 5);
    const auto begin = std::chrono::steady_clock::now();
    const LightSet& lights = stage.prepare();
    const auto middle = std::chrono::steady_clock::now();
    const LightTree tree(lights);
    const auto end = std::chrono::steady_clock::now();
    ASSERT_EQ(lights.item_count(), 1000000u);
    EXPECT_TRUE(wants_fine_numbers(lights));
    const auto seconds = [](auto a, auto b) {
        return std::chrono::duration<double>(b - a).count();
    };
    std::printf("surfaces %.2f s, tree %.2f s, %.0f bytes a light\n", seconds(begin, middle),
                seconds(middle, end), double(tree.bytes()) / 1e6);
    EXPECT_LE(tree.bytes(), 160u * 1000000u);

    // Estimate the sum of strength / distance² of all of them from the choices
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit;
    for (int round = 0; round < 2; ++round) {
        const Receiver at = receiver_at(random);
        const auto value = [&](LightId id) {
            const LightBounds bounds = lights.bounds(id.index);
            const Vec3d v = bounds.box.center() - Vec3d(at.p);
            return bounds.cone.intensity / v.dot(v);
        };
        double exact = 0;
        for (uint32_t i = 0; i < lights.item_count(); ++i) exact += value(i);
        const auto samples = double(hardcase::sized(40000, 4000000, 40000000));
        double sum = 0, squares = 0;
        for (int i = 0; i < int(samples); ++i) {
            const auto choice = tree.select(at, unit(random));
            ASSERT_TRUE(choice);
            ASSERT_EQ(choice->pmf, tree.pmf(at, choice->light));
            ASSERT_GT(choice->pmf, 0.0f);
            const double x = value(choice->light) / double(choice->pmf);
            sum += x;
            squares += x * x;
        }
        const double mean = sum / samples;
        const double error = std::sqrt((squares / samples - mean * mean) / samples);
        EXPECT_LE(std::abs(mean - exact), 4.0 * error);
        hardcase::expect_within({"sum over a million lights, by choices, relative",
                                 std::abs(mean / exact - 1), 0.1, 5.28 * error / exact,
                                 "sum over all of them"});
    }
}

TEST(ManyLights, ChoosingLooksAtALogarithmicNumberOfClusters) {
    // Clusters that one choice weighs, averaged as they are chosen and at worst over all lights
    double last = 0;
    for (const size_t count : {100u, 1000u, 10000u, 100000u, 1000000u}) {
        EmissiveStage stage;
        fill(stage, count, 11);
        const LightSet& lights = stage.prepare();
        const LightTree tree(lights);
        std::mt19937 random(2);
        std::uniform_real_distribution<double> unit;
        double sum = 0;
        constexpr int samples = 2000;
        for (int i = 0; i < samples; ++i) {
            const auto choice = tree.select(receiver_at(random), unit(random));
            ASSERT_TRUE(choice);
            sum += double(tree.visited_clusters(choice->light));
        }
        size_t max = 0;
        for (uint32_t i = 0; i < lights.item_count(); ++i)
            max = std::max(max, tree.visited_clusters(i));
        const double mean = sum / samples;
        std::printf("%7zu lights: %.1f clusters a choice, at worst %zu\n", count, mean, max);
        // A perfectly balanced tree adds 2 log2(10) = 6.6 with every factor of ten
        EXPECT_TRUE(last == 0 || mean - last <= 2.0 * 6.7) << count << " lights";
        EXPECT_LE(max, 2u * ClusterTree::depth_limit + 80u);
        last = mean;
    }
}

}  // namespace
}  // namespace velatura::lights
