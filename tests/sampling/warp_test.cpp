// SPDX-License-Identifier: Apache-2.0
#include "sampling/warp.h"

#include "chi_square.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

namespace velatura::sampling {
namespace {

using testing::chi_square;
using testing::TestRandom;

constexpr int rows = 16, columns = 32, count = 200000;

/// χ² of directions in cells of equal (z, φ) size; `density(z)` in 1/sr depends on z alone, as do
/// all of these.
void expect_density(const std::function<Vec3(const Vec2&)>& warp,
                    const std::function<double(double)>& density,
                    double z_low) {
    TestRandom random(17);
    std::vector<double> counts(rows * columns, 0.0), expected(rows * columns, 0.0);
    for (int i = 0; i < count; ++i) {
        const Vec3 w = warp(Vec2(random.uniform(), random.uniform()));
        ASSERT_NEAR(double(w.dot(w)), 1.0, 2e-6);
        ASSERT_GE(double(w.z), z_low - 1e-6);
        const double phi = std::atan2(double(w.y), double(w.x)) / (2 * pi_d) + 0.5;
        const int r = std::min(rows - 1, int((double(w.z) - z_low) / (1 - z_low) * rows));
        const int c = std::min(columns - 1, int(phi * columns));
        counts[size_t(std::max(r, 0) * columns + c)] += 1;
    }
    for (int r = 0; r < rows; ++r) {
        double mass = 0;
        for (int k = 0; k < 64; ++k) {
            mass += density(z_low + (1 - z_low) * (r + (k + 0.5) / 64) / rows) / 64;
        }
        for (int c = 0; c < columns; ++c) {
            expected[size_t(r * columns + c)] =
                mass * count * (1 - z_low) / rows * 2 * pi_d / columns;
        }
    }
    const auto result = chi_square(counts, expected);
    std::printf("smallest detectable error of a cell: %.1f %%\n",
                100 * testing::smallest_detectable(count, rows * columns));
    EXPECT_NEAR(result.expected_total / count, 1.0, 1e-3);
    EXPECT_LT(result.z, 4.0);
}

TEST(Warp, CosineHemisphere) {
    expect_density([](const Vec2& u) { return cosine_hemisphere(u); },
                   [](double z) { return double(cosine_hemisphere_pdf(float(z))); }, 0);
}

TEST(Warp, UniformHemisphere) {
    expect_density([](const Vec2& u) { return uniform_hemisphere(u); },
                   [](double) { return double(uniform_hemisphere_pdf); }, 0);
}

TEST(Warp, UniformSphere) {
    expect_density([](const Vec2& u) { return uniform_sphere(u); },
                   [](double) { return double(uniform_sphere_pdf); }, -1);
}

TEST(Warp, ConcentricDiskIsUniform) {
    TestRandom random(23);
    std::vector<double> counts(rows * columns, 0.0);
    const std::vector<double> expected(rows * columns, double(count) / (rows * columns));
    for (int i = 0; i < count; ++i) {
        const Vec2 d = concentric_disk(Vec2(random.uniform(), random.uniform()));
        const double r2 = double(d.x) * double(d.x) + double(d.y) * double(d.y);
        ASSERT_LE(r2, 1.0 + 1e-6);
        const double phi = std::atan2(double(d.y), double(d.x)) / (2 * pi_d) + 0.5;
        counts[size_t(std::min(rows - 1, int(r2 * rows)) * columns +
                      std::min(columns - 1, int(phi * columns)))] += 1;
    }
    EXPECT_LT(chi_square(counts, expected).z, 4.0);
}

TEST(Warp, ConcentricDiskInFloatFollowsDouble) {
    TestRandom random(31);
    for (int i = 0; i < 20000; ++i) {
        const Vec2 u(random.uniform(), random.uniform());
        const Vec2 d = concentric_disk(u);
        const Vec2d exact = concentric_disk(Vec2d(u));
        ASSERT_NEAR(double(d.x), exact.x, 4e-7);
        ASSERT_NEAR(double(d.y), exact.y, 4e-7);
    }
    // The map's own series against the library's functions
    for (int i = 0; i <= 4000; ++i) {
        const double a = -1.0 + i / 2000.0;
        const Vec2d d = concentric_disk(Vec2d(1.0, 0.5 + a / 2.0));
        ASSERT_NEAR(d.x, std::cos(a * pi_d / 4.0), 3e-16);
        ASSERT_NEAR(d.y, std::sin(a * pi_d / 4.0), 3e-16);
    }
    // Squares about the center become circles
    EXPECT_EQ(concentric_disk(Vec2d(0.5, 0.5)), Vec2d(0.0));
    EXPECT_EQ(concentric_disk(Vec2d(1.0, 0.5)), Vec2d(1.0, 0.0));
    EXPECT_NEAR(concentric_disk(Vec2d(0.75, 0.75)).length(), 0.5, 1e-15);
}

TEST(Warp, CornersOfTheSquareAreFinite) {
    const float last = 0x1.fffffep-1f;
    for (const float x : {0.0f, 0.5f, last}) {
        for (const float y : {0.0f, 0.5f, last}) {
            const Vec2 u(x, y);
            EXPECT_TRUE(is_finite(cosine_hemisphere(u)));
            EXPECT_TRUE(is_finite(uniform_hemisphere(u)));
            EXPECT_TRUE(is_finite(uniform_sphere(u)));
        }
    }
}

}  // namespace
}  // namespace velatura::sampling
