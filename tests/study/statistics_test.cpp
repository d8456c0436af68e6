// SPDX-License-Identifier: Apache-2.0
#include "study/statistics.h"

#include <gtest/gtest.h>

#include <random>

namespace velatura::test {

using namespace velatura::study;

TEST(Statistics, IntervalsOfNoiseHoldTheTruthAsOftenAsTheySay) {
    // Pixels of one mean and one variance: the relative square is variance / (mean² + 0.01)
    constexpr int trials = 400, pixels = 400, rounds = 6;
    std::mt19937_64 numbers(7);
    std::normal_distribution<float> normal(1.0f, 0.1f);
    int inside = 0;
    for (int t = 0; t < trials; ++t) {
        Moments m;
        for (int r = 0; r < rounds; ++r) {
            std::vector<float> image(3 * pixels);
            for (float& v : image) v = normal(numbers);
            m.add(image);
        }
        const GroupMeans squares = noise_squares(m, {std::vector<double>(3 * pixels, 1.0)});
        const double truth = 0.01 / 1.01;
        if (std::abs(squares.mean() - truth) < 1.96 * squares.standard_error()) ++inside;
    }
    // 95 % less what 31 degrees of freedom cost, within three standard errors of the count
    EXPECT_GE(inside, 0.91 * trials);
    EXPECT_LE(inside, 0.985 * trials);
}

TEST(Statistics, EqualImagesAreTheSameImage) {
    Moments d;
    for (int r = 0; r < 4; ++r)
        d.add_difference({1.0f + float(r), 2.0f, 3.0f}, {1.0f + float(r), 2.0f, 3.0f});
    const DifferenceTest t = test_difference(d, {{1, 2, 3}});
    EXPECT_TRUE(t.is_same_image);
    EXPECT_FALSE(t.is_seen);
}

TEST(Statistics, OneBrightSampleIsNoBias) {
    Moments d;
    for (int r = 0; r < 8; ++r) {
        std::vector<float> a(300, 1.0f);
        const std::vector<float> b(300, 1.0f);
        if (r == 3) a[30] = a[31] = a[32] = 500.0f;
        d.add_difference(a, b);
    }
    EXPECT_FALSE(test_difference(d, {std::vector<double>(300, 1.0)}).is_seen);
}

TEST(Statistics, ChannelsThatDeviateTogetherAreNoBias) {
    // The z of the energy's shift must spread like one, or a little less
    std::mt19937_64 numbers(11);
    std::normal_distribution<float> normal(0.0f, 1.0f);
    constexpr int trials = 500, pixels = 100;
    double square = 0;
    for (int t = 0; t < trials; ++t) {
        Moments d;
        for (int r = 0; r < 8; ++r) {
            std::vector<float> a(3 * pixels);
            for (size_t i = 0; i < a.size(); i += 3) a[i] = a[i + 1] = a[i + 2] = normal(numbers);
            d.add_difference(a, std::vector<float>(3 * pixels, 0.0f));
        }
        const DifferenceTest test = test_difference(d, {std::vector<double>(3 * pixels, 1.0)});
        EXPECT_FALSE(test.is_seen);
        square += test.shift * test.shift / (test.shift_se * test.shift_se) / trials;
    }
    EXPECT_GT(square, 0.8);
    EXPECT_LT(square, 1.25);
}

TEST(Statistics, StudentsPointsAreThoseOfTables) {
    EXPECT_NEAR(student_975(1), 12.706, 1e-3);
    EXPECT_NEAR(student_975(20), 2.086, 2e-3);
    EXPECT_NEAR(student_975(60), 2.000, 1e-3);
}

TEST(Statistics, TimesAreComparedRoundByRound) {
    SettingTally a, b;
    a.points.push_back({.spp = 4, .image = {}, .cpu_s = {2, 20, 200}});
    b.points.push_back({.spp = 4, .image = {}, .cpu_s = {1, 100, 10}});
    a.rounds = {0, 1, 2};
    b.rounds = {0, 2, 3};
    b.points[0].cpu_s = {1, 100, 10};
    const auto ratio = time_ratio(a, b, 4);
    ASSERT_TRUE(ratio.has_value());
    EXPECT_NEAR(ratio->value, 2.0, 1e-12);
    EXPECT_NEAR(ratio->log_se, 0.0, 1e-12);
}

}  // namespace velatura::test
