// SPDX-License-Identifier: Apache-2.0
#include "shading/fresnel.h"

#include "albedo_quadrature.h"
#include "hard_case.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::shading {
namespace {

double exact_fresnel(double cos_i, double eta) {
    const long double c = cos_i, n = eta;
    const long double sin2_t = (1 - c * c) / (n * n);
    if (sin2_t >= 1) return 1;
    const long double t = std::sqrt(1 - sin2_t);
    const long double p = (n * c - t) / (n * c + t), s = (c - n * t) / (c + n * t);
    return double((p * p + s * s) / 2);
}

double hemispherical_mean(float eta) {
    const testing::GaussLegendre rule(64);
    // Split at the critical angle, where the derivative is infinite; μ = μ_c + (1 − μ_c)·x²
    const double critical = eta < 1.0f ? std::sqrt(1 - double(eta) * double(eta)) : 0.0;
    double sum = critical * critical;
    for (size_t i = 0; i < rule.x.size(); ++i) {
        const double x = rule.x[i], mu = critical + (1 - critical) * x * x;
        sum += rule.w[i] * 2 * mu * 2 * x * (1 - critical) *
               double(fresnel_dielectric(float(mu), eta));
    }
    return sum;
}

TEST(H22Fresnel, Table) {
    EXPECT_NEAR(double(fresnel_dielectric(1.0f, 1.5f)), 0.04, 1e-6);
    EXPECT_NEAR(double(fresnel_dielectric(1.0f, 1 / 1.5f)), 0.04, 1e-6);
    const double mean = hemispherical_mean(1.5f);
    hardcase::expect_within(
        {"hemispherical mean of index 1.5", std::abs(mean - 0.091778), 1e-6, 0, "closed form"});
    EXPECT_NEAR(hemispherical_mean(1 / 1.5f), 0.596346, 1e-6);
    EXPECT_NEAR(1 - hemispherical_mean(1 / 1.5f), (1 - hemispherical_mean(1.5f)) / 2.25, 1e-6);
    EXPECT_NEAR(double(fresnel_dielectric(1.0f, 1.0001f)), 2.5e-9, 1e-11);
    EXPECT_NEAR(double(fresnel_dielectric(float(std::cos(89 * pi_d / 180)), 1.0001f)), 0.0157,
                1e-4);
    EXPECT_NEAR(double(fresnel_dielectric(float(std::cos(89.9 * pi_d / 180)), 1.0001f)), 0.611,
                1e-3);
    // Air, glass, water; incoherent sum over the bounces inside the glass slab
    const double r1 = double(fresnel_dielectric(1.0f, 1.5f)),
                 r2 = double(fresnel_dielectric(1.0f, 1.33f / 1.5f));
    EXPECT_NEAR((1 - r1) * (1 - r2) / (1 - r1 * r2), 0.956674, 1e-6);
}

TEST(Fresnel, TotalReflectionStartsAtTheCriticalAngle) {
    const double critical = 41.81031 * pi_d / 180;
    EXPECT_EQ(fresnel_dielectric(float(std::cos(critical + 1e-5)), 1 / 1.5f), 1.0f);
    EXPECT_LT(fresnel_dielectric(float(std::cos(critical - 1e-5)), 1 / 1.5f), 0.999f);
    EXPECT_LT(refracted_cosine(float(std::cos(critical + 1e-5)), 1 / 1.5f), 0.0f);
}

TEST(H22Fresnel, NearOneAgreesWithLongDouble) {
    double worst = 0;
    for (const int sign : {-1, 1}) {
        for (int k = 1; k <= 23; ++k) {
            const float eta = 1.0f + float(sign) * std::ldexp(1.0f, -k);
            float previous = 2;
            for (int i = 0; i <= 1000; ++i) {
                const float c = float(i) / 1000;
                const float f = fresnel_dielectric(c, eta);
                ASSERT_TRUE(std::isfinite(f));
                ASSERT_LE(f, previous + 1e-6f) << eta << " " << c;
                worst = hardcase::larger(
                    worst, std::abs(double(f) - exact_fresnel(double(c), double(eta))));
                previous = f;
            }
        }
    }
    hardcase::expect_within({"reflectance for indices 1 +- 2^-k", worst, 1e-6, 0, "long double"});
    for (const float c : {0.0f, 1e-8f, 0.5f, 1.0f}) EXPECT_EQ(fresnel_dielectric(c, 1.0f), 0.0f);
}

TEST(Fresnel, FiniteEverywhere) {
    for (const float c : {0.0f, 1e-8f, 1e-30f, 1.0f, -1.0f}) {
        for (const float eta : {1e-3f, 0.5f, 0.99999994f, 1.0f, 1.0000001f, 1.5f, 1e3f}) {
            const float f = fresnel_dielectric(c, eta);
            EXPECT_TRUE(f >= 0.0f && f <= 1.0f) << c << " " << eta;
        }
    }
}

}  // namespace
}  // namespace velatura::shading
