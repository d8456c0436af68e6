// SPDX-License-Identifier: Apache-2.0
#include "chi_square.h"
#include "hard_case.h"
#include "sampling/filter.h"

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

TEST(PixelFilter, SamplesItsAbsoluteValue) {
    constexpr int cells = 24, count = 200000;
    for (const FilterKind kind : kinds) {
        const PixelFilter filter(kind);
        const double r = double(filter.radius());
        testing::TestRandom random(101);
        std::vector<double> counts(cells * cells, 0.0), expected(cells * cells, 0.0);
        for (int i = 0; i < count; ++i) {
            const FilterSample s = filter.sample(Vec2(random.uniform(), random.uniform()));
            const double x = double(s.offset.x), y = double(s.offset.y);
            ASSERT_LE(std::abs(x), r);
            ASSERT_LE(std::abs(y), r);
            if (filter.evaluate(x, y) != 0.0) {
                ASSERT_NEAR(double(s.weight),
                            std::copysign(filter.absolute_integral(), filter.evaluate(x, y)), 1e-6);
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
                    mass += std::abs(filter.evaluate(x, y));
                }
                expected[size_t(d * cells + c)] = mass / (sub * sub) * (2 * r / cells) *
                                                  (2 * r / cells) * count /
                                                  filter.absolute_integral();
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
            const double x = double(filter.sample(Vec2(float(u), 0.5f)).offset.x);
            sampled += x * x / n;
            const double y = r * (2 * u - 1);
            exact += y * y * filter.evaluate(y, 0);
            mass += filter.evaluate(y, 0);
        }
        EXPECT_NEAR(sampled / (exact / mass), 1.0, 1e-4) << filter_name(kind);
    }
}

TEST(H49NegativeLobes, MeanWeightOfMitchellIsThatOfItsProfile) {
    // Along one axis the mean is that of the other axis' fixed positive sign: ∫|w| of one axis
    const PixelFilter filter(FilterKind::Mitchell);
    double sum = 0;
    constexpr int n = 1 << 16;
    for (int i = 0; i < n; ++i) {
        sum += double(filter.sample(Vec2((float(i) + 0.5f) / n, 0.5f)).weight) / n;
    }
    hardcase::expect_within({"mean weight of Mitchell's filter along an axis",
                             std::abs(sum - std::sqrt(filter.absolute_integral())), 2e-3, 0,
                             "integral of its absolute value"});
    EXPECT_GT(filter.absolute_integral(), 1.05);
}

TEST(PixelFilter, NamesRoundTrip) {
    for (const FilterKind kind : kinds) EXPECT_EQ(filter_kind(filter_name(kind)), kind);
    EXPECT_FALSE(filter_kind("sinc").has_value());
    EXPECT_EQ(PixelFilter().kind(), FilterKind::BlackmanHarris);
}

}  // namespace
}  // namespace velatura::sampling
