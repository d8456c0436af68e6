// SPDX-License-Identifier: Apache-2.0
#include "sampling/distribution.h"

#include "chi_square.h"
#include "hard_case.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace velatura::sampling {
namespace {

using testing::TestRandom;

Distribution1D make(const std::vector<double>& weights) {
    return Distribution1D(std::span<const double>(weights));
}

TEST(Distribution1D, MatchesItsWeights) {
    const std::vector<double> weights = {1, 0, 3, 0, 0, 4, 2, 0};
    const Distribution1D d = make(weights);
    EXPECT_DOUBLE_EQ(d.integral(), 10.0 / 8);
    for (size_t i = 0; i < weights.size(); ++i) {
        EXPECT_DOUBLE_EQ(d.pmf(i), weights[i] / 10);
        EXPECT_DOUBLE_EQ(d.pdf((double(i) + 0.5) / 8), weights[i] / 10 * 8);
    }
    EXPECT_EQ(d.pdf(-0.1), 0.0);
    EXPECT_EQ(d.pdf(1.1), 0.0);
    // Inversion: u = 0.25 lies a half into the third bin, which covers [0.1, 0.4)
    const Distribution1D::Sample s = d.sample(0.25f);
    EXPECT_EQ(s.index, 2u);
    EXPECT_NEAR(s.x, 2.5 / 8, 1e-15);
    EXPECT_NEAR(double(s.u_remapped), 0.5, 1e-7);
    EXPECT_DOUBLE_EQ(s.pdf, d.pdf(s.x));
}

TEST(H28WildWeights, ZerosAreNeverDrawn) {
    TestRandom random(3);
    std::vector<double> weights(hardcase::sized(1 << 16, 1 << 22, 100000000));
    long double sum = 0, total = 0;
    for (double& w : weights) {
        w = random.bits() % 3 == 0 ? 0.0 : std::pow(10.0, -30 + 60 * double(random.uniform()));
    }
    weights.front() = weights.back() = 0;
    const Distribution1D d = make(weights);
    for (size_t i = 0; i < weights.size(); ++i) {
        sum += static_cast<long double>(d.pmf(i));
        total += static_cast<long double>(weights[i]);
        if (weights[i] == 0) {
            ASSERT_EQ(d.pmf(i), 0.0);
        }
    }
    hardcase::expect_within(
        {"sum of the probabilities, less 1", double(std::abs(sum - 1)), 1e-12, 0, "long double"});
    // A probability is a difference of doubles below 1: relative to itself where it is no smaller
    double worst = 0;
    for (size_t i = 0; i < weights.size(); ++i) {
        const auto expected = double(static_cast<long double>(weights[i]) / total);
        if (expected > 0x1p-32) worst = hardcase::larger(worst, std::abs(d.pmf(i) / expected - 1));
    }
    hardcase::expect_within({"a probability above 2^-32, relative", worst, 1e-6, 0, "long double"});
    const uint64_t draws = hardcase::sized(200000, 100000000, 1000000000);
    for (uint64_t i = 0; i < draws; ++i) {
        const Distribution1D::Sample s = d.sample(random.uniform());
        ASSERT_GT(weights[s.index], 0.0);
        ASSERT_GT(s.pdf, 0.0);
        ASSERT_GE(s.u_remapped, 0.0f);
        ASSERT_LT(s.u_remapped, 1.0f);
        ASSERT_LT(s.x, 1.0);
    }
    for (const float u : {0.0f, 0x1.fffffep-1f, 1.0f}) EXPECT_GT(weights[d.sample(u).index], 0.0);
}

TEST(Distribution1D, HugeAndTinyWeightsKeepTheirRatio) {
    for (const double scale : {1e-300, 1.0, 1e300}) {
        const Distribution1D d = make({1e5 * scale, 2e5 * scale, 3e5 * scale});
        EXPECT_NEAR(d.pmf(0), 1.0 / 6, 1e-12);
        EXPECT_NEAR(d.pmf(2), 3.0 / 6, 1e-12);
        EXPECT_NEAR(d.integral() / scale, 2e5, 1e-6);
    }
}

// Smallest and largest that a double can be: the power of two that scales them is itself no double
TEST(Distribution1D, WeightsAtTheEndsOfDoublesKeepTheirRatio) {
    for (const double unit : {0x1p-1074, 0x1p1021}) {
        const Distribution1D d = make({1 * unit, 0.0, 3 * unit, 4 * unit});
        EXPECT_EQ(d.pmf(0), 1.0 / 8);
        EXPECT_EQ(d.pmf(1), 0.0);
        EXPECT_EQ(d.pmf(2), 3.0 / 8);
        EXPECT_EQ(d.pmf(3), 4.0 / 8);
        EXPECT_EQ(d.integral(), 2 * unit);
    }
}

TEST(Distribution1D, UnusableWeightsCountAsZero) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinite = std::numeric_limits<double>::infinity();
    const Distribution1D d = make({nan, 1, -5, infinite, 1});
    EXPECT_EQ(d.pmf(0), 0.0);
    EXPECT_EQ(d.pmf(1), 0.5);
    EXPECT_EQ(d.pmf(2), 0.0);
    EXPECT_EQ(d.pmf(3), 0.0);
    const Distribution1D none = make({0, 0, nan});
    EXPECT_EQ(none.sample(0.3f).pdf, 0.0);
    EXPECT_EQ(none.pdf(0.3), 0.0);
    EXPECT_EQ(Distribution1D().sample(0.3f).pdf, 0.0);
    EXPECT_EQ(Distribution1D().pdf(0.3), 0.0);
}

/// |sampled mass − weight/Σ| relative to the latter, over all texels; mass from the CDF, not from
/// samples. Masses are differences of doubles below 1, hence 2^-51 is taken off the difference.
double worst_mass_error(const std::vector<float>& weights, size_t width, size_t height) {
    const Distribution2D d(weights, width, height);
    double total = 0;
    for (const float w : weights) total += double(w);
    double worst = 0;
    for (size_t y = 0; y < height; ++y) {
        for (size_t x = 0; x < width; ++x) {
            const double w = double(weights[y * width + x]);
            const Vec2d center((double(x) + 0.5) / double(width),
                               (double(y) + 0.5) / double(height));
            const double mass = d.pdf(center) / double(width * height);
            if (w == 0) {
                if (mass != 0) return 1;
            } else {
                const double expected = w / total;
                worst = hardcase::larger(worst, (std::abs(mass - expected) - 0x1p-51) / expected);
            }
        }
    }
    return worst;
}

TEST(H27EnvironmentMass, FlatMapAndSunKeepTheirMass) {
    constexpr size_t width = 1024, height = 512;
    std::vector<float> flat(width * height, 1.0f);
    const auto expect_mass = [&](const char* what, double bound) {
        hardcase::expect_within({what, worst_mass_error(flat, width, height), bound, 0,
                                 "weight over the sum of weights, all texels"});
    };
    expect_mass("mass of a texel of a flat map, relative", 1e-9);
    flat[200 * width + 300] = 6.4e10f;
    expect_mass("the same below a sun of 6.4e10", 1e-6);
    for (size_t i = 0; i < flat.size(); i += 3) flat[i] = 0;
    expect_mass("the same with every third texel black", 1e-6);
}

TEST(Distribution2D, SamplesItsDensity) {
    constexpr size_t width = 16, height = 8;
    TestRandom random(41);
    std::vector<float> weights(width * height);
    double total = 0;
    for (float& w : weights) {
        w = random.bits() % 4 == 0 ? 0.0f : random.uniform();
        total += double(w);
    }
    const Distribution2D d(weights, width, height);
    EXPECT_NEAR(d.integral(), total / double(width * height), 1e-9);
    constexpr int count = 100000;
    std::vector<double> counts(weights.size(), 0.0), expected(weights.size());
    for (size_t i = 0; i < weights.size(); ++i) expected[i] = double(weights[i]) / total * count;
    for (int i = 0; i < count; ++i) {
        const Distribution2D::Sample s = d.sample(Vec2(random.uniform(), random.uniform()));
        ASSERT_EQ(size_t(s.xy.x * double(width)), s.column);
        ASSERT_EQ(size_t(s.xy.y * double(height)), s.row);
        ASSERT_NEAR(s.pdf, d.pdf(s.xy), 1e-12);
        counts[s.row * width + s.column] += 1;
    }
    EXPECT_LT(testing::chi_square(counts, expected).z, 4.0);
}

TEST(Distribution2D, BlackMapDrawsNothing) {
    const std::vector<float> black(12, 0.0f);
    const Distribution2D d(black, 4, 3);
    EXPECT_EQ(d.sample(Vec2(0.2f, 0.9f)).pdf, 0.0);
    EXPECT_EQ(d.pdf(Vec2d(0.2, 0.9)), 0.0);
}

}  // namespace
}  // namespace velatura::sampling
