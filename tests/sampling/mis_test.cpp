// SPDX-License-Identifier: Apache-2.0
#include "sampling/mis.h"

#include "hard_case.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace velatura::sampling {
namespace {

TEST(H30MisWeights, AreFiniteAndSumToOne) {
    double worst = 0;
    const float grid[] = {0.0f,
                          std::numeric_limits<float>::denorm_min(),
                          1e-38f,
                          1.0f,
                          1e19f,
                          1e30f,
                          std::numeric_limits<float>::max(),
                          std::numeric_limits<float>::infinity()};
    for (const float a : grid) {
        for (const float b : grid) {
            for (const auto heuristic : {balance_heuristic, power_heuristic}) {
                const float wa = heuristic(a, b), wb = heuristic(b, a);
                ASSERT_TRUE(std::isfinite(wa) && std::isfinite(wb)) << a << " " << b;
                ASSERT_GE(wa, 0.0f);
                ASSERT_LE(wa, 1.0f);
                worst = hardcase::larger(worst, std::abs(double(wa) + double(wb) - 1));
            }
        }
    }
    hardcase::expect_within({"sum of both weights, less 1, densities 0 to infinity", worst, 1e-6, 0,
                             "partition of unity"});
    EXPECT_EQ(balance_heuristic(0.0f, 1.0f), 0.0f);
    EXPECT_EQ(balance_heuristic(1.0f, 0.0f), 1.0f);
}

TEST(Mis, AgreesWithTheTextbook) {
    for (const double a : {0.01, 0.3, 1.0, 7.0, 500.0}) {
        for (const double b : {0.02, 0.3, 2.0, 90.0}) {
            EXPECT_NEAR(double(balance_heuristic(float(a), float(b))), a / (a + b), 2e-7);
            EXPECT_NEAR(double(power_heuristic(float(a), float(b))), a * a / (a * a + b * b), 3e-7);
            // Of f = 1: each strategy adds weight² / density
            const double w = a * a / (a * a + b * b), moment = w * w / a + (1 - w) * (1 - w) / b;
            EXPECT_NEAR(double(power_heuristic_density(float(a), float(b))) * moment, 1, 1e-6);
        }
    }
}

TEST(Mis, TheDensityOfBothStrategiesIsFinite) {
    EXPECT_EQ(power_heuristic_density(0.0f, 0.0f), 0.0f);
    EXPECT_EQ(power_heuristic_density(0.0f, 3.0f), 3.0f);
    EXPECT_EQ(power_heuristic_density(3.0f, 0.0f), 3.0f);
    EXPECT_EQ(power_heuristic_density(2.0f, 2.0f), 4.0f);
    EXPECT_EQ(power_heuristic_density(1e-38f, 1e30f), 1e30f);
}

}  // namespace
}  // namespace velatura::sampling
