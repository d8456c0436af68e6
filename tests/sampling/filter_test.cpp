// SPDX-License-Identifier: Apache-2.0
#include "sampling/filter.h"

#include "chi_square.h"
#include "hard_case.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

namespace velatura::sampling {
namespace {

constexpr FilterKind kinds[] = {FilterKind::Box, FilterKind::Triangle, FilterKind::Gaussian,
                                FilterKind::BlackmanHarris, FilterKind::Mitchell};

TEST(PixelFilter, IntegratesToOne) {
    for (const FilterKind kind : kinds) {
        const PixelFilter filter(kind);
        constexpr int n = 800;
        const double r = double(filter.radius());
        double sum = 0, absolute = 0;
        for (int j = 0; j < n; ++j) {
            for (int i = 0; i < n; ++i) {
                const double w =
                    filter.evaluate(r * (2 * (i + 0.5) / n - 1), r * (2 * (j + 0.5) / n - 1));
                sum += w;
                absolute += std::abs(w);
            }
        }
        const double cell = (2 * r / n) * (2 * r / n);
        EXPECT_NEAR(sum * cell, 1.0, 1e-5) << filter_name(kind);
        EXPECT_NEAR(absolute * cell, filter.absolute_integral(), 1e-4) << filter_name(kind);
        EXPECT_EQ(filter.evaluate(r * 1.001, 0), 0.0);
    }
}

// Density times weight is the filter: samples are as dense as it, over the weight that its sign has
TEST(PixelFilter, SamplesItsValueOverTheWeight) {
    constexpr int cells = 24, count = 200000;
    for (const FilterKind kind : kinds) {
        const PixelFilter filter(kind);
        const double r = double(filter.radius());
        // A quarter of the samples where the filter subtracts
        const double adding = (filter.absolute_integral() + 1) / 2, taking = adding - 1;
        const double positive = filter.has_negative_lobes() ? adding / 0.75 : 1.0,
                     negative = -taking / 0.25;
        testing::TestRandom random(101);
        std::vector<double> counts(cells * cells, 0.0), expected(cells * cells, 0.0);
        for (int i = 0; i < count; ++i) {
            const Vec2 u(random.uniform(), random.uniform());
            const FilterSample s = filter.sample(u, random.uniform());
            const double x = double(s.offset.x), y = double(s.offset.y);
            ASSERT_LE(std::abs(x), r);
            ASSERT_LE(std::abs(y), r);
            // Within a step of the table of where it changes sign the filter is hardly anything
            if (std::abs(filter.evaluate(x, y)) >
                0.02 * (std::abs(filter.evaluate(0, y)) + std::abs(filter.evaluate(x, 0)))) {
                ASSERT_NEAR(double(s.weight), filter.evaluate(x, y) < 0.0 ? negative : positive,
                            1e-5);
            }
            const int c = std::min(cells - 1, int((x / r + 1) / 2 * cells));
            const int d = std::min(cells - 1, int((y / r + 1) / 2 * cells));
            counts[size_t(d * cells + c)] += 1;
        }
        constexpr int sub = 16;
        for (int d = 0; d < cells; ++d) {
            for (int c = 0; c < cells; ++c) {
                double mass = 0;
                for (int k = 0; k < sub * sub; ++k) {
                    const double x = r * (2 * (c + (k % sub + 0.5) / sub) / cells - 1);
                    const double y = r * (2 * (d + (k / sub + 0.5) / sub) / cells - 1);
                    const double value = filter.evaluate(x, y);
                    mass += value < 0.0 ? value / negative : value / positive;
                }
                expected[size_t(d * cells + c)] =
                    mass / (sub * sub) * (2 * r / cells) * (2 * r / cells) * count;
            }
        }
        const auto result = testing::chi_square(counts, expected);
        EXPECT_LT(result.z, 4.0) << filter_name(kind);
        EXPECT_NEAR(result.expected_total / count, 1.0, 1e-3);
    }
    std::printf("smallest detectable error of a cell: %.1f %%\n",
                100 * testing::smallest_detectable(count, cells * cells));
}

TEST(PixelFilter, InvertsTheExactCumulativeDistribution) {
    // Second moment of the profile by quadrature against that of evenly spaced u, to 1e-4
    for (const FilterKind kind :
         {FilterKind::Triangle, FilterKind::Gaussian, FilterKind::BlackmanHarris}) {
        const PixelFilter filter(kind);
        const double r = double(filter.radius());
        constexpr int n = 1 << 16;
        double sampled = 0, exact = 0, mass = 0;
        for (int i = 0; i < n; ++i) {
            const double u = (i + 0.5) / n;
            const double x = double(filter.sample(Vec2(float(u), 0.5f), 0.0f).offset.x);
            sampled += x * x / n;
            const double y = r * (2 * u - 1);
            exact += y * y * filter.evaluate(y, 0);
            mass += filter.evaluate(y, 0);
        }
        EXPECT_NEAR(sampled / (exact / mass), 1.0, 1e-4) << filter_name(kind);
    }
}

TEST(H49NegativeLobes, WeightsOfFourStratifiedSamplesSumToFour) {
    const PixelFilter filter(FilterKind::Mitchell);
    double worst = 0;
    constexpr int n = 1 << 12;
    for (int i = 0; i < n; ++i) {
        double sum = 0;
        for (int k = 0; k < 4; ++k)
            sum += double(filter.sample(Vec2(0.5f), (float(k) + (float(i) + 0.5f) / n) / 4).weight);
        worst = hardcase::larger(worst, std::abs(sum / 4 - 1));
    }
    hardcase::expect_within({"mean weight of four stratified samples of Mitchell's filter, less 1",
                             worst, 1e-6, 0, "integral of the filter"});
    EXPECT_GT(filter.absolute_integral(), 1.05);
}

/// ∫ of Mitchell's filter (B = C = 1/3) from -2 to x, by its polynomials. Ref: Mitchell & Netravali
/// 1988, section 4.
double mitchell_integral(double x) {
    // Of the halves [0, 1] and [1, 2], from 0 on
    const auto inner = [](double y) {
        return (7.0 / 4 * std::pow(y, 4) - 4 * std::pow(y, 3) + 16.0 / 3 * y) / 6;
    };
    const auto outer = [](double y) {
        return (-7.0 / 12 * std::pow(y, 4) + 4 * std::pow(y, 3) - 10 * y * y + 32.0 / 3 * y) / 6;
    };
    const double y = std::min(std::abs(x), 2.0);
    const double half = y < 1 ? inner(y) : inner(1) + outer(y) - outer(1);
    return 0.5 + std::copysign(half, x);
}

TEST(H49NegativeLobes, OvershootOfAStepIsThatOfTheFilter) {
    // A pixel x away from the step sees ∫ of the filter up to there: less than 0 and more than 1
    // beside it
    const PixelFilter filter(FilterKind::Mitchell);
    constexpr int n = 1 << 9;
    double worst = 0, max = 0;
    for (int step = -20; step <= 20; ++step) {
        const double x = step / 8.0;
        double seen = 0, weights = 0;
        for (int i = 0; i < n * n; ++i) {
            const float u = (float(i % n) + 0.5f) / n, part = (float(i / n) + 0.5f) / n;
            const auto across = float(std::fmod(0.6180339887498949 * i, 1.0));
            const FilterSample s = filter.sample(Vec2(u, across), part);
            weights += double(s.weight);
            if (double(s.offset.x) < x) seen += double(s.weight);
        }
        worst = hardcase::larger(worst, std::abs(seen / weights - mitchell_integral(x)));
        max = hardcase::larger(max, seen / weights);
    }
    hardcase::expect_within({"a step by Mitchell's filter, at 41 places, from its integral", worst,
                             2e-3, 0, "closed form"});
    hardcase::expect_within({"overshoot of a step by Mitchell's filter, from 0.0174",
                             std::abs(max - mitchell_integral(9.0 / 8)), 2e-3, 0, "closed form"});
}

TEST(PixelFilter, NamesRoundTrip) {
    for (const FilterKind kind : kinds) EXPECT_EQ(filter_kind(filter_name(kind)), kind);
    EXPECT_FALSE(filter_kind("sinc").has_value());
    EXPECT_EQ(PixelFilter().kind(), FilterKind::BlackmanHarris);
}

}  // namespace
}  // namespace velatura::sampling
