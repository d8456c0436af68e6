// SPDX-License-Identifier: Apache-2.0
// The phase function's samples follow its density, its density is that of the paper, up to mean
// cosines near ±1 (H23).
#include "media/henyey_greenstein.h"

#include "../sampling/chi_square.h"
#include "hard_case.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace velatura::media {
namespace {

using sampling::testing::chi_square;
using sampling::testing::smallest_detectable;
using sampling::testing::TestRandom;

constexpr double gs[] = {0, 0.3, -0.3, 0.9, -0.9, 0.99, -0.99, 0.9999, -0.9999};

const Vec3 directions[] = {Vec3(0, 0, 1), Vec3(0, 0, -1), Vec3(0.6f, -0.48f, 0.64f)};

/// 1 − cosθ from the direction that g prefers, from the difference of the directions.
double one_minus_cosine(double g, const Vec3& d, const Vec3& wi) {
    double squares = 0;
    for (int i = 0; i < 3; ++i)
        squares += std::pow(double(wi[i]) - (g < 0 ? -1.0 : 1.0) * double(d[i]), 2);
    return squares / 2;
}

/// 1 − cosθ below which a share p of all light goes on: the inverse of the paper's distribution, in
/// long double.
double quantile(double g, double p) {
    const long double a = std::abs(g), wide_p = p;
    if (a == 0) return 2 * p;
    const long double u = 1 - wide_p, s = (1 - a * a) / (1 - a + 2 * a * u);
    return double(1 - (1 + a * a - s * s) / (2 * a));
}

TEST(H23HenyeyGreenstein, SamplesFollowTheDensity) {
    constexpr int rings = 32, sectors = 8, count = 400000;
    // Šidák: 27 tests at a joint level of 1 %
    const double limit = 3.37;
    double worst = 0;
    for (const double g : gs) {
        const HenyeyGreenstein phase{float(g)};
        std::vector<double> edges;
        for (int i = 1; i < rings; ++i)
            edges.push_back(quantile(double(phase.g()), double(i) / rings));
        for (const Vec3& d : directions) {
            TestRandom random(uint64_t(1000 * (g + 2)));
            const Frame frame = Frame::from_z(g < 0 ? -d : d);
            std::vector<double> counts(rings * sectors, 0.0),
                expected(rings * sectors, double(count) / (rings * sectors));
            for (int i = 0; i < count; ++i) {
                const Vec3 wi = phase.sample(d, Vec2(random.uniform(), random.uniform()));
                ASSERT_NEAR(wi.dot(wi), 1.0f, 1e-5f);
                const double x = one_minus_cosine(g, d, wi);
                const Vec3 local = frame.to_local(wi);
                const size_t ring =
                    size_t(std::upper_bound(edges.begin(), edges.end(), x) - edges.begin());
                const auto sector = size_t(std::min(
                    sectors - 1.0,
                    (std::atan2(double(local.y), double(local.x)) / (2 * pi_d) + 0.5) * sectors));
                ++counts[ring * sectors + sector];
            }
            worst = hardcase::larger(worst, chi_square(counts, expected).z);
            EXPECT_LT(chi_square(counts, expected).z, limit) << "g = " << g;
        }
    }
    hardcase::expect_within({"worst chi-square deviate of 27 settings, |g| to 0.9999",
                             hardcase::larger(0.0, worst), limit, 0,
                             "inverse of the paper's distribution in long double",
                             fmt::format("a cell wrong by {:.0f} %",
                                         100 * smallest_detectable(count, rings * sectors))});
}

TEST(H23HenyeyGreenstein, MeanCosineIsG) {
    const int count = int(hardcase::sized(400000, 20000000, 1000000000));
    for (const double g : gs) {
        const HenyeyGreenstein phase{float(g)};
        hardcase::expect_within(
            {fmt::format("g that was asked for, less that which is sampled, g = {}", g),
             std::abs(double(phase.g()) - g), 1.2e-7, 0, "closed form"});
        TestRandom random(7);
        double sum = 0, squares = 0;
        for (int i = 0; i < count; ++i) {
            const double x = one_minus_cosine(
                g, directions[2],
                phase.sample(directions[2], Vec2(random.uniform(), random.uniform())));
            sum += x;
            squares += x * x;
        }
        const double mean = sum / count,
                     deviation = std::sqrt((squares / count - mean * mean) / count);
        hardcase::expect_within({fmt::format("mean cosine for g = {}, in standard errors", g),
                                 std::abs(mean - 1 + std::abs(double(phase.g()))) / deviation, 5, 0,
                                 "closed form",
                                 fmt::format("{:.1e} of the cosine", 6.28 * deviation)});
    }
}

TEST(H23HenyeyGreenstein, DensityIsThePapersAndIntegratesToOne) {
    constexpr int steps = 20000;
    for (const double g : gs) {
        const HenyeyGreenstein phase{float(g)};
        const long double a = std::abs(static_cast<long double>(phase.g()));
        const Vec3 d = directions[2];
        const Frame frame = Frame::from_z(g < 0 ? -d : d);
        double integral = 0;
        // Rings of equal shares of the light: each contributes density times solid angle
        for (int i = 0; i < steps; ++i) {
            const double low = quantile(double(phase.g()), double(i) / steps),
                         high = quantile(double(phase.g()), double(i + 1) / steps);
            const double x = quantile(double(phase.g()), (i + 0.5) / steps);
            const double sine = std::sqrt(x * (2 - x));
            const Vec3 wi = normalize(frame.from_local(Vec3(float(sine), 0.0f, float(1 - x))));
            const double found = double(phase.pdf(d, wi));
            const long double y = one_minus_cosine(g, d, wi);
            const double exact =
                double((1 - a * a) / (4 * pi_d * std::pow((1 - a) * (1 - a) + 2 * a * y, 1.5L)));
            ASSERT_NEAR(found, exact, 2e-6 * exact) << "g = " << g << ", 1 - cos = " << x;
            integral += found * 2 * pi_d * (high - low);
        }
        hardcase::expect_within({fmt::format("integral of the density for g = {}, less 1", g),
                                 std::abs(integral - 1), 1e-4, 0, "closed form"});
    }
}

TEST(HenyeyGreenstein, IsReciprocal) {
    const HenyeyGreenstein phase(0.7f);
    TestRandom random(3);
    for (int i = 0; i < 1000; ++i) {
        const Vec3 d =
            HenyeyGreenstein(0.0f).sample(directions[0], Vec2(random.uniform(), random.uniform()));
        const Vec3 wi = phase.sample(d, Vec2(random.uniform(), random.uniform()));
        EXPECT_EQ(phase.pdf(d, wi), phase.pdf(-wi, -d));
    }
}

TEST(H23HenyeyGreenstein, StaysFiniteAtTheEnds) {
    for (const float g : {-2.0f, -1.0f, 1.0f, 2.0f}) {
        const HenyeyGreenstein phase(g);
        EXPECT_LT(std::abs(phase.g()), 1.0f);
        for (const float u : {0.0f, 0.5f, 0x1.fffffep-1f}) {
            const Vec3 wi = phase.sample(directions[2], Vec2(u, 0.25f));
            EXPECT_NEAR(wi.dot(wi), 1.0f, 1e-5f);
            EXPECT_TRUE(std::isfinite(phase.pdf(directions[2], wi)));
            EXPECT_GE(phase.pdf(directions[2], wi), 0.0f);
        }
    }
}

}  // namespace
}  // namespace velatura::media
