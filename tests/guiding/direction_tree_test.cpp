// SPDX-License-Identifier: Apache-2.0
// The equal-area map and the directional quadtree: samples follow the density, the density is
// normalized.
#include "guiding/direction_tree.h"

#include "../sampling/chi_square.h"
#include "guiding/equal_area.h"
#include "sampling/warp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

namespace velatura::guiding {
namespace {

using sampling::testing::chi_square;
using sampling::testing::smallest_detectable;
using sampling::testing::TestRandom;

constexpr double four_pi = 4 * pi_d;

std::vector<WeightedDirection> lobe_items(size_t count, double exponent, unsigned long long seed) {
    TestRandom random(seed);
    const Frame frame = Frame::from_z(normalize(Vec3(0.3f, -0.5f, 0.8f)));
    std::vector<WeightedDirection> items;
    for (size_t i = 0; i < count; ++i) {
        const Vec3 w = sampling::uniform_sphere(Vec2(random.uniform(), random.uniform()));
        const double cosine = std::max(0.0, double(w.z));
        items.push_back({square_from_direction(frame.from_local(w)),
                         float(0.1 + 10 * std::pow(cosine, exponent))});
    }
    return items;
}

/// χ² of a tree's samples against its own density over an even grid of the equal-area square.
void expect_samples_follow_density(const std::vector<DirectionNode>& nodes) {
    constexpr int side = 32, fine = 16, count = 400000;
    const DirectionTree tree(nodes.data());
    TestRandom random(7);
    std::vector<double> counts(side * side, 0.0), expected(side * side, 0.0);
    for (int i = 0; i < count; ++i) {
        const DirectionSample s = tree.sample(Vec2(random.uniform(), random.uniform()));
        ASSERT_NEAR(double(s.wi.dot(s.wi)), 1.0, 2e-6);
        ASSERT_GT(s.pdf, 0.0f);
        const Vec2 q = square_from_direction(s.wi);
        counts[size_t(std::min(side - 1, int(q.y * side)) * side +
                      std::min(side - 1, int(q.x * side)))] += 1;
    }
    // Points between the lines of the finest quadtree cells, which are 2^-9 wide
    double total = 0;
    for (int y = 0; y < side * fine; ++y) {
        for (int x = 0; x < side * fine; ++x) {
            const Vec2 q((float(x) + 0.5f) / (side * fine), (float(y) + 0.5f) / (side * fine));
            const double mass = double(tree.pdf(direction_from_square(q))) * four_pi /
                                (double(side) * fine * side * fine);
            expected[size_t((y / fine) * side + x / fine)] += mass * count;
            total += mass;
        }
    }
    const auto result = chi_square(counts, expected);
    std::printf("smallest detectable error of a cell: %.1f %%, integral %.7f, z %.2f\n",
                100 * smallest_detectable(count, side * side), total, result.z);
    EXPECT_NEAR(total, 1.0, 1e-5);
    EXPECT_LT(result.z, 4.0);
}

}  // namespace

TEST(EqualAreaMap, RoundTripsEveryOctantAndAxis) {
    TestRandom random(3);
    double worst = 0;
    for (int i = 0; i < 200000; ++i) {
        const Vec3 w = sampling::uniform_sphere(Vec2(random.uniform(), random.uniform()));
        const Vec3 back = direction_from_square(square_from_direction(w));
        worst = std::max(worst, double((back - w).length()));
    }
    std::printf("worst distance after a round trip: %.2e\n", worst);
    // Near the poles 1 − z carries the whole distance: √ulp
    EXPECT_LT(worst, 1e-3);
    for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0),
                             Vec3(0, 0, 1), Vec3(0, 0, -1)}) {
        EXPECT_LT(double((direction_from_square(square_from_direction(axis)) - axis).length()),
                  1e-3);
    }
}

TEST(EqualAreaMap, EqualAreasHaveEqualSolidAngles) {
    constexpr int side = 16, count = 400000;
    TestRandom random(5);
    std::vector<double> counts(side * side, 0.0);
    const std::vector<double> expected(side * side, double(count) / (side * side));
    for (int i = 0; i < count; ++i) {
        const Vec2 q = square_from_direction(
            sampling::uniform_sphere(Vec2(random.uniform(), random.uniform())));
        counts[size_t(std::min(side - 1, int(q.y * side)) * side +
                      std::min(side - 1, int(q.x * side)))] += 1;
    }
    std::printf("smallest detectable error of a cell: %.1f %%\n",
                100 * smallest_detectable(count, side * side));
    EXPECT_LT(chi_square(counts, expected).z, 4.0);
}

TEST(DirectionTree, SamplesFollowTheDensityOfABroadLobe) {
    std::vector<WeightedDirection> items = lobe_items(5000, 2, 11);
    const auto nodes = fit_direction_tree(items);
    ASSERT_GT(nodes.size(), 5u);
    expect_samples_follow_density(nodes);
}

TEST(DirectionTree, SamplesFollowTheDensityOfANarrowLobe) {
    std::vector<WeightedDirection> items = lobe_items(50000, 500, 12);
    const auto nodes = fit_direction_tree(items);
    ASSERT_GT(nodes.size(), 5u);
    expect_samples_follow_density(nodes);
}

TEST(DirectionTree, SamplesFollowTheDensityOfOneItem) {
    std::vector<WeightedDirection> items = {{Vec2(0.9f, 0.3f), 1.0f}};
    expect_samples_follow_density(fit_direction_tree(items));
}

TEST(DirectionTree, ApproachesWhatArrived) {
    // On fresh items: the gain in likelihood over the uniform density, against that of the target
    // itself, which nothing can exceed but by chance
    std::vector<WeightedDirection> items = lobe_items(50000, 20, 13);
    const std::vector<WeightedDirection> fresh = lobe_items(50000, 20, 15);
    const auto nodes = fit_direction_tree(items);
    const DirectionTree tree(nodes.data());
    double sum = 0, sum_log_ratio = 0;
    for (const WeightedDirection& item : fresh) {
        sum += double(item.weight);
        sum_log_ratio += double(item.weight) *
                         std::log(double(tree.pdf(direction_from_square(item.q))) * four_pi);
    }
    double information = 0;
    for (const WeightedDirection& item : fresh) {
        information +=
            double(item.weight) / sum * std::log(double(item.weight) / sum * double(fresh.size()));
    }
    std::printf("information learned: %.3f of %.3f nats\n", sum_log_ratio / sum, information);
    EXPECT_GT(sum_log_ratio / sum, 0.8 * information);
    EXPECT_LT(sum_log_ratio / sum, information);
}

TEST(DirectionTree, OneLuckyPathMakesNoSpike) {
    // 999 even items and one a million times as heavy
    std::vector<WeightedDirection> items = lobe_items(1000, 0, 14);
    items[0].weight *= 1e6f;
    const Vec3 lucky = direction_from_square(items[0].q);
    const auto nodes = fit_direction_tree(items);
    // The prior of 8 items leaves the cell at most (1 + 2) / (1 + 8) of what lies above it
    EXPECT_LE(double(DirectionTree(nodes.data()).pdf(lucky)) * four_pi, 4.0 * 3.0 / 9.0 + 1e-3);
}

TEST(DirectionTree, NothingArrivedNothingLearned) {
    std::vector<WeightedDirection> none;
    EXPECT_TRUE(fit_direction_tree(none).empty());
    std::vector<WeightedDirection> dark = {{Vec2(0.5f, 0.5f), 0.0f}};
    EXPECT_TRUE(fit_direction_tree(dark).empty());
}

}  // namespace velatura::guiding
