// SPDX-License-Identifier: Apache-2.0
#include "shading/ggx.h"

#include "../sampling/chi_square.h"
#include "albedo_quadrature.h"
#include "half_vector_cells.h"
#include "hard_case.h"
#include "shading/albedo.h"
#include "shading/bsdf.h"
#include "shading/fresnel.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

namespace velatura::shading {
namespace {

using sampling::testing::TestRandom;
using testing::albedo_by_quadrature;
using testing::cell_probabilities;
using testing::GaussLegendre;
using testing::run_chi_square;

Vec3d direction(double mu) {
    return Vec3d(std::sqrt(std::max(0.0, 1 - mu * mu)), 0, mu);
}

TEST(H18GgxDistribution, AgreesWithLongDouble) {
    TestRandom random(1);
    double worst = 0;
    for (const float alpha : {1.0f, 0.5f, 0.1f, 0.01f, 1e-3f, 1e-4f}) {
        const uint64_t count = hardcase::sized(2000, 200000, 20000000);
        for (uint64_t i = 0; i < count; ++i) {
            // Normals around the peak and in the tail
            const float slope = alpha * std::exp(8 * random.uniform() - 5);
            const float phi = 6.2831853f * random.uniform();
            const float z = 1 / std::sqrt(1 + slope * slope);
            const Vec3 m(slope * z * std::cos(phi), slope * z * std::sin(phi), z);
            const long double a = alpha, x = m.x / a, y = m.y / a, w = m.z;
            const long double s = x * x + y * y + w * w;
            const long double exact = 1 / (3.14159265358979323846L * a * a * s * s);
            worst = hardcase::larger(worst, double(std::abs(ggx_d(m, alpha) / exact - 1)));
        }
    }
    hardcase::expect_within({"D, relative, alpha 1 to 1e-4", worst, 1e-5, 0, "long double"});
}

// Smith-GGX, F = 1, without compensation
TEST(Ggx, SingleScatteringAlbedoIsThatOfTheLiterature) {
    const GaussLegendre rule(128);
    EXPECT_NEAR(albedo_by_quadrature(1, 1, rule, 32).one, 1 - std::log(2.0), 1e-4);
    EXPECT_NEAR(albedo_by_quadrature(1, 0.5, rule, 32).one, 0.688, 2e-3);
    const auto mean = [](double alpha) {
        const GaussLegendre mu(24), inner(48);
        double sum = 0;
        for (size_t i = 0; i < mu.x.size(); ++i) {
            sum += mu.w[i] * 2 * mu.x[i] * albedo_by_quadrature(mu.x[i], alpha, inner, 48).one;
        }
        return sum;
    };
    EXPECT_NEAR(mean(1), 0.409, 2e-3);
    EXPECT_NEAR(mean(0.5), 0.700, 2e-3);
    EXPECT_NEAR(double(1 - GgxAlbedoCurve(1.0f).average().loss), 0.409, 2e-3);
}

// A quadrature that shares no change of variables with ggx_sample: over (μ_i, φ) for wide lobes
TEST(Ggx, AlbedoAgreesWithPlainQuadrature) {
    const GaussLegendre rule(96), phi(96);
    for (const double alpha : {0.3, 0.7, 1.0}) {
        for (const double mu : {0.2, 0.7, 1.0}) {
            const Vec3d wo = direction(mu);
            double one = 0, schlick = 0;
            for (size_t i = 0; i < rule.x.size(); ++i) {
                for (size_t j = 0; j < phi.x.size(); ++j) {
                    const double z = rule.x[i] * rule.x[i], r = std::sqrt(1 - z * z);
                    const Vec3d wi(r * std::cos(pi_d * phi.x[j]), r * std::sin(pi_d * phi.x[j]), z);
                    Vec3d m = wo + wi;
                    m /= std::sqrt(m.dot(m));
                    const double f = ggx_d(m, alpha) * ggx_visibility(mu, z, alpha) * z *
                                     rule.w[i] * phi.w[j] * 2 * rule.x[i] * 2 * pi_d;
                    one += f;
                    schlick += f * std::pow(1 - wo.dot(m), 5);
                }
            }
            const auto e = albedo_by_quadrature(mu, alpha, rule, 96);
            EXPECT_NEAR(one, e.one, 2e-4) << alpha << " " << mu;
            EXPECT_NEAR(schlick, e.schlick, 2e-4) << alpha << " " << mu;
        }
    }
}

TEST(AlbedoTables, AgreeWithQuadratureBetweenTheirNodes) {
    const GaussLegendre rule(96);
    TestRandom random(9);
    double worst_loss = 0, worst_schlick = 0;
    for (int i = 0; i < 300; ++i) {
        const double root = 0.0317 + 0.9683 * double(random.uniform());
        const double alpha = root * root;
        const double mu = std::pow(double(random.uniform()), 2) * 0.99 + 0.01;
        const auto e = albedo_by_quadrature(mu, alpha, rule, 96);
        const GgxAlbedo table = GgxAlbedoCurve(float(alpha)).at(float(mu));
        worst_loss = hardcase::larger(worst_loss, std::abs(1 - e.one - double(table.loss)));
        worst_schlick =
            hardcase::larger(worst_schlick, std::abs(e.schlick - double(table.schlick)));
    }
    std::printf("worst table error: loss %.1e, schlick %.1e\n", worst_loss, worst_schlick);
    EXPECT_LT(worst_loss, 6e-4);
    EXPECT_LT(worst_schlick, 1e-3);
}

// What the switch to a mirror changes, seen by light that varies over a third of a radian
TEST(H18SpecularSwitch, MirrorAndNarrowestLobeSeeTheSame) {
    double worst = 0;
    const double alpha = double(specular_switch_alpha);
    const GaussLegendre rule(64);
    for (const double mu : {0.1, 0.3, 0.7, 1.0}) {
        const Vec3d wo = direction(mu), mirrored(-wo.x, 0, wo.z);
        const auto radiance = [](const Vec3d& w) {
            return 1 + 0.9 * std::sin(3 * w.x) * std::cos(3 * w.y);
        };
        double L = 0;
        for (size_t i = 0; i < rule.x.size(); ++i) {
            for (int j = 0; j < 128; ++j) {
                const Vec3d wi = ggx_sample(wo, alpha, Vec2d((j + 0.5) / 128, rule.x[i]));
                if (wi.z <= 0) continue;
                L += rule.w[i] / 128 * radiance(wi) * ggx_visibility(mu, wi.z, alpha) * wi.z *
                     ggx_pdf_divisor(wo, alpha);
            }
        }
        worst = hardcase::larger(worst, std::abs(L / radiance(mirrored) - 1));
    }
    hardcase::expect_within({"radiance of a mirror against the narrowest lobe, relative", worst,
                             1e-3, 0, "quadrature in double"});
}

TEST(H18SpecularSwitch, AlbedoIsTheSame) {
    for (const float mu : {0.1f, 0.3f, 0.7f, 1.0f}) {
        const GgxAlbedo rough = GgxAlbedoCurve(specular_switch_alpha).at(mu);
        const GgxAlbedo mirror = GgxAlbedoCurve(0.0f).at(mu);
        EXPECT_NEAR(double(rough.schlick), double(mirror.schlick), 1e-3);
        EXPECT_EQ(mirror.loss, 0.0f);
    }
}

// Anisotropy is no part of UsdPreviewSurface: αx = αy
TEST(H19VisibleNormals, BoundedSamplingFollowsItsDensity) {
    double worst = -10;
    for (const double mu : {1.0, 0.5, 0.1, 1e-2, 1e-3, 1e-4}) {
        for (const double alpha : {1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 0.5, 0.75, 1.0}) {
            const Vec3d wo = direction(mu);
            const std::vector<double> probabilities = cell_probabilities(wo, alpha);
            constexpr int count = 60000;
            const auto seed = static_cast<unsigned long long>(mu * 1e6) +
                              static_cast<unsigned long long>(alpha * 1e4);
            std::vector<testing::ChiSquareRun> runs = {
                run_chi_square<double>(wo, alpha, probabilities, count, seed)};
            // Rounding a direction moves the half vector that it is told by, by so much of a width
            if (0x1p-24 / (mu * alpha) < 0.1)
                runs.push_back(run_chi_square<float>(wo, alpha, probabilities, count, seed));
            for (const testing::ChiSquareRun& run : runs) {
                // 3.74: family-wise 1 % over 106 tests (Šidák), one-sided, 1 − 0.99^(1/106)
                // = 9.5e-5
                worst = hardcase::larger(worst, run.z);
                EXPECT_LE(run.heaviest, 1 + 1e-5);
                // The density integrates to 1 less what falls below the surface; lost is a count of
                // 60000
                const double sigma = std::sqrt(run.lost * (1 - run.lost) / count);
                EXPECT_NEAR(run.inside, 1 - run.lost, 1e-3 + 4 * sigma) << mu << " " << alpha;
            }
        }
    }
    hardcase::expect_within(
        {"worst chi-square deviate of 54 settings in double and 52 in float",
         hardcase::larger(0.0, worst), 3.74, 0, "the density, integrated over cells",
         fmt::format("a cell wrong by {:.0f} %",
                     100 * sampling::testing::smallest_detectable(60000, 120))});
}

TEST(H19VisibleNormals, WeightsStayBelowOneInFloat) {
    TestRandom random(77);
    double heaviest = 0;
    for (const float mu : {1.0f, 0.5f, 0.1f, 1e-2f, 1e-3f, 1e-4f}) {
        for (const float alpha : {1e-3f, 1e-2f, 0.1f, 0.5f, 1.0f}) {
            const Vec3 wo(safe_sqrt(1 - mu * mu), 0, mu);
            for (int i = 0; i < 2000; ++i) {
                const Vec3 wi = ggx_sample(wo, alpha, Vec2(random.uniform(), random.uniform()));
                ASSERT_TRUE(is_finite(wi));
                if (wi.z <= 0) continue;
                ASSERT_NEAR(double(wi.dot(wi)), 1.0, 1e-5);
                heaviest = hardcase::larger(heaviest, double(ggx_visibility(mu, wi.z, alpha) *
                                                             wi.z * ggx_pdf_divisor(wo, alpha)));
            }
        }
    }
    hardcase::expect_within({"what a weight exceeds 1 by, F = 1",
                             hardcase::larger(0.0, heaviest - 1), 1e-5, 0, "bound of the method"});
}

}  // namespace
}  // namespace velatura::shading
