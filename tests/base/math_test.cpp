// SPDX-License-Identifier: Apache-2.0
#include "base/math.h"

#include "hard_case.h"

#include <gtest/gtest.h>

#include <random>

namespace velatura {

namespace {

Vec3 random_direction(std::mt19937& random) {
    std::normal_distribution<float> normal;
    return normalize(Vec3(normal(random), normal(random), normal(random)));
}

TEST(Math, NormalizeKeepsTheDirectionAtAnyScale) {
    for (int k = -140; k <= 120; k += 10) {
        const Vec3 v(std::ldexp(3.0f, k), std::ldexp(-4.0f, k), 0.0f);
        const Vec3 n = normalize(v);
        EXPECT_FLOAT_EQ(n.x, 0.6f) << k;
        EXPECT_FLOAT_EQ(n.y, -0.8f) << k;
    }
}

TEST(Math, NormalizeIsExactlyInvariantUnderPowersOfTwo) {
    const Vec3 v(0.3f, -1.7f, 2.9f);
    const Vec3 n = normalize(v);
    for (const int k : {-60, -20, -1, 1, 20, 60}) {
        EXPECT_EQ(normalize(Vec3(std::ldexp(v.x, k), std::ldexp(v.y, k), std::ldexp(v.z, k))), n)
            << k;
    }
}

TEST(Math, RenormalizeLeavesTheSquareOfTheError) {
    std::mt19937 random(5);
    for (const double e : {1e-3, 1e-5, -1e-7}) {
        const Vec3d v = Vec3d(random_direction(random)).normalized() * (1.0 + e);
        EXPECT_NEAR(renormalize(v).length(), 1.0 - 1.5 * e * e, std::abs(e * e * e) + 1e-15) << e;
    }
}

TEST(H17Frames, AreOrthonormalAndRightHandedEverywhere) {
    std::mt19937 random(3);
    double worst = 0;
    const auto check = [&](const Vec3& n) {
        const Frame f = Frame::from_z(n);
        const Vec3d x(f.x), y(f.y), z(f.z), v(0.2, -0.5, 0.8);
        EXPECT_EQ(f.z, n);
        const double errors[] = {x.dot(x) - 1,
                                 y.dot(y) - 1,
                                 x.dot(y),
                                 x.dot(z),
                                 y.dot(z),
                                 x.cross(y).dot(z) - 1,
                                 (Vec3d(f.from_local(f.to_local(Vec3(v)))) - v).length()};
        for (const double error : errors) {
            EXPECT_FALSE(std::isnan(error)) << n;
            worst = hardcase::larger(worst, std::abs(error));
        }
    };
    // South pole and its neighbors are where a careless formula divides by zero
    const float denormal = std::numeric_limits<float>::denorm_min();
    for (const Vec3& n :
         {Vec3(0, 0, 1), Vec3(0, 0, -1), Vec3(-0.0f, 0.0f, -1.0f), Vec3(1e-20f, 1e-30f, -1.0f),
          Vec3(denormal, -denormal, -1.0f), Vec3(1, denormal, -denormal), Vec3(1, 0, -0.0f)})
        check(n);
    const uint64_t count = hardcase::sized(200000, 100000000, 1000000000);
    for (uint64_t i = 0; i < count; ++i) check(random_direction(random));
    // Down to 2^-149 off the south pole
    for (int k = 1; k < 149; ++k) {
        const float s = std::ldexp(1.0f, -k);
        for (const Vec3& aside : {Vec3(s, 0, -1), Vec3(0, s, -1), Vec3(s, -s, -1)})
            check(normalize(aside));
    }
    hardcase::expect_within(
        {"products of the axes of a frame, and there and back", worst, 1e-6, 0, "double"});
}

TEST(Math, TransformsAreThoseOfRowVectors) {
    // v' = v · M: scale by 2, turn +x to +y about z, then move by (10, 20, 30)
    Mat4d m;
    m[0][0] = 0, m[0][1] = 2, m[1][0] = -2, m[1][1] = 0, m[2][2] = 2;
    m[3][0] = 10, m[3][1] = 20, m[3][2] = 30;
    EXPECT_EQ(transform_point(Vec3d(1, 0, 0), m), Vec3d(10, 22, 30));
    EXPECT_EQ(transform_direction(Vec3d(1, 0, 0), m), Vec3d(0, 2, 0));
    EXPECT_EQ(determinant3(m), 8.0);
}

TEST(Math, CofactorMatrixKeepsNormalsPerpendicular) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-2.0, 2.0);
    for (int trial = 0; trial < 500; ++trial) {
        Mat4d m;
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) m[i][j] = uniform(random);
        }
        // One axis squashed flat, every third time: the inverse transpose does not exist there
        if (trial % 3 == 0) m[2][0] = m[2][1] = m[2][2] = 0.0;
        const Vec3d a(uniform(random), uniform(random), uniform(random));
        const Vec3d b(uniform(random), uniform(random), uniform(random));
        const Vec3d n = a.cross(b) * cofactor_matrix(m);
        EXPECT_NEAR(n.dot(transform_direction(a, m)), 0.0, 1e-11);
        EXPECT_NEAR(n.dot(transform_direction(b, m)), 0.0, 1e-11);
        // Cofactors turn cross products into cross products, length and sign included
        EXPECT_LT((n - transform_direction(a, m).cross(transform_direction(b, m))).length(), 1e-11);
    }
}

TEST(Math, LuminanceOfWhiteIsOne) {
    EXPECT_FLOAT_EQ(luminance(Rgb(1.0f)), 1.0f);
}

TEST(Math, FiniteMatrixChecksEveryEntry) {
    EXPECT_TRUE(is_finite(Mat4()));
    EXPECT_TRUE(is_finite(Mat4d(), 2.0));
    EXPECT_FALSE(is_finite(Mat4d(), 1.0));
    const float bad[] = {std::numeric_limits<float>::quiet_NaN(),
                         std::numeric_limits<float>::infinity(),
                         -std::numeric_limits<float>::infinity()};
    for (int i = 0; i < 16; ++i) {
        for (const float x : bad) {
            Mat4 m;
            m[i / 4][i % 4] = x;
            EXPECT_FALSE(is_finite(m));
        }
    }
}

}  // namespace

}  // namespace velatura
