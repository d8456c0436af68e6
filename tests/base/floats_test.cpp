// SPDX-License-Identifier: Apache-2.0
#include "base/floats.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

namespace velatura {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

TEST(Floats, NextFloatIsTheNextOne) {
    // std::nextafter is the second opinion
    for (const float v :
         {1.0f, -1.0f, 1e-30f, -1e-30f, 1e30f, 16777216.0f, 1.4e-45f, -1.4e-45f, 3.4028235e38f}) {
        EXPECT_EQ(next_float_up(v), std::nextafter(v, infinity)) << v;
        EXPECT_EQ(next_float_down(v), std::nextafter(v, -infinity)) << v;
    }
    EXPECT_EQ(next_float_up(0.0f), std::numeric_limits<float>::denorm_min());
    EXPECT_EQ(next_float_up(-0.0f), std::numeric_limits<float>::denorm_min());
    EXPECT_EQ(next_float_up(infinity), infinity);
    EXPECT_EQ(next_float_down(-infinity), -infinity);
}

TEST(Floats, GammaBoundsRealSums) {
    // A sum of n + 1 positive floats is n rounded additions: the error stays within gamma_n of the
    // exact sum
    std::mt19937 random(7);
    std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
    for (int trial = 0; trial < 200; ++trial) {
        float sum = 0.0f;
        double exact = 0.0;
        for (int i = 0; i <= 64; ++i) {
            const float x = uniform(random);
            sum += x;
            exact += double(x);
        }
        EXPECT_LE(std::abs(double(sum) - exact), double(gamma_bound(64)) * exact);
    }
    EXPECT_EQ(gamma_bound(1), machine_epsilon / (1.0f - machine_epsilon));
    EXPECT_EQ(machine_epsilon, 0x1p-24f);
}

TEST(Floats, DifferenceOfProductsIsRoundedOnce) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> uniform(0.5f, 1.0f);
    for (int trial = 0; trial < 20000; ++trial) {
        const float a = uniform(random);
        const float b = uniform(random);
        // Nearly equal products: the plain formula loses most digits here
        const float c = a * (1.0f + 1e-6f * uniform(random));
        const float d = b;
        // 64 bits hold both products and, as near as they are, their difference
        using Long = long double;
        const double exact = double(Long(a) * Long(b) - Long(c) * Long(d));
        const float result = difference_of_products(a, b, c, d);
        const double ulp =
            double(next_float_up(std::abs(float(exact)))) - std::abs(double(float(exact)));
        EXPECT_LE(std::abs(double(result) - exact), 0.51 * ulp) << a << " " << b << " " << c;
    }
}

TEST(Floats, NormalizingScaleBringsNumbersNearOne) {
    for (int k = -125; k <= 126; ++k) {
        const float x = std::ldexp(1.5f, k);
        EXPECT_EQ(x * normalizing_scale(x), 1.5f) << k;
    }
    for (int k = -1021; k <= 1022; ++k) {
        const double x = std::ldexp(1.5, k);
        EXPECT_EQ(x * normalizing_scale(x), 1.5) << k;
    }
    // At the ends of the range a power of two is left over, but squares are safe and no digit is
    // lost
    for (const float x : {std::numeric_limits<float>::denorm_min(), 0x1.8p-140f, 0x1.8p127f}) {
        const float scaled = x * normalizing_scale(x);
        EXPECT_GT(scaled * scaled, 1e-14f) << x;
        EXPECT_LT(scaled, 4.0f) << x;
        EXPECT_EQ(scaled / normalizing_scale(x), x);
    }
    EXPECT_TRUE(std::isfinite(normalizing_scale(0.0f)));
    EXPECT_TRUE(std::isfinite(normalizing_scale(0.0)));
}

TEST(Floats, SafeFunctionsStayInTheirDomain) {
    EXPECT_EQ(safe_sqrt(-1e-20f), 0.0f);
    EXPECT_EQ(safe_sqrt(4.0), 2.0);
    EXPECT_EQ(safe_acos(1.0000001f), 0.0f);
    EXPECT_FLOAT_EQ(safe_acos(-1.1f), 3.14159265f);
}

}  // namespace

}  // namespace velatura
