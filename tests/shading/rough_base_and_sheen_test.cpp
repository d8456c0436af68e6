// SPDX-License-Identifier: Apache-2.0
// The rough diffuse base and the sheen over everything: energy, reciprocity, samples.
#include "../sampling/chi_square.h"
#include "bsdf_quadrature.h"
#include "shading/rough_diffuse.h"
#include "shading/sheen.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

namespace velatura::shading {
namespace {

using sampling::testing::TestRandom;
using testing::direction;
using testing::energy;

const Vec3 up(0, 0, 1);
constexpr double cosines[] = {0.01, 0.03, 0.1, 0.3, 0.7, 1.0};

SurfaceParameters matte(float albedo, float roughness) {
    SurfaceParameters p;
    p.diffuse = Rgb(albedo);
    p.f0 = p.f90 = Rgb(0.0f);
    p.diffuse_roughness = roughness;
    return p;
}

SurfaceParameters with_sheen(SurfaceParameters p, float roughness, float weight = 1) {
    p.sheen = &SheenAlbedo::of_process();
    p.sheen_color = Rgb(weight);
    p.sheen_roughness = roughness;
    return p;
}

/// ∫ f·cos over the hemisphere in double, dense towards grazing angles.
double integral(const std::function<double(const Vec3&)>& f) {
    constexpr int order = 192;
    const testing::GaussLegendre rule(order);
    double sum = 0;
    for (size_t i = 0; i < rule.x.size(); ++i) {
        const double mu = rule.x[i] * rule.x[i];
        for (int k = 0; k < order; ++k) {
            const double phi = 2 * pi_d * (k + 0.5) / order;
            sum += f(direction(mu, phi)) * mu * 2 * rule.x[i] * rule.w[i] * 2 * pi_d / order;
        }
    }
    return sum;
}

// Energy-preserving by construction: white facets lose nothing, whatever the roughness
TEST(RoughDiffuse, WhiteReflectsOne) {
    for (const float roughness : {0.0f, 0.2f, 0.5f, 1.0f}) {
        for (const double mu : cosines) {
            const Vec3 wo = direction(mu);
            const double e = integral([&](const Vec3& wi) {
                return double(rough_diffuse(Rgb(1.0f), roughness, wo, wi).x) / pi_d;
            });
            EXPECT_NEAR(e, 1.0, 1e-3) << roughness << " " << mu;
        }
    }
}

TEST(RoughDiffuse, RoughnessZeroIsLambert) {
    const Rgb f = rough_diffuse(Rgb(0.2f, 0.5f, 0.9f), 0.0f, direction(0.3), direction(0.8, 1));
    EXPECT_NEAR(double(f.x), 0.2, 1e-6);
    EXPECT_NEAR(double(f.z), 0.9, 1e-6);
}

// The qualitative model's own form: single scattering at normal incidence is ρ·A
TEST(RoughDiffuse, IsOrenNayarsBrightEdge) {
    // Seen and lit from the same grazing side the surface is brighter than Lambert's, from the
    // other side darker
    const Vec3 wo = direction(0.2, 0);
    EXPECT_GT(rough_diffuse(Rgb(0.5f), 1.0f, wo, direction(0.2, 0)).x, 0.6f);
    EXPECT_LT(rough_diffuse(Rgb(0.5f), 1.0f, wo, direction(0.2, pi_d)).x, 0.4f);
}

TEST(RoughDiffuse, UnderADielectricItGainsNothing) {
    double max = 0;
    for (const float alpha : {0.01f, 0.25f, 1.0f}) {
        for (const double mu : cosines) {
            SurfaceParameters p;
            p.diffuse = Rgb(1.0f);
            p.alpha = alpha;
            p.diffuse_roughness = 1;
            const Vec3 wo = direction(mu);
            const double e = energy(Bsdf(p, up, up, wo), wo, double(alpha)).total();
            max = std::max(max, e);
            EXPECT_GT(e, 0.97) << alpha << " " << mu;
        }
    }
    std::printf("most that a white rough base under a dielectric reflects: %.4f\n", max);
    EXPECT_LT(max, 1.001);
}

// Estevez & Kulla 2017, "Production Friendly Microfacet Sheen BRDF"; Neubelt & Pettineo 2013
TEST(Sheen, IsTheFormulaOfThePapers) {
    double projected_worst = 0;
    for (const double roughness : {0.1, 0.3, 0.7, 1.0}) {
        // The distribution of normals: ∫ D cosθ dω = 1
        double projected = 0;
        const testing::GaussLegendre rule(256);
        for (size_t i = 0; i < rule.x.size(); ++i) {
            const double mu = rule.x[i], sine = std::sqrt(1 - mu * mu);
            const double d = (2 + 1 / roughness) * std::pow(sine, 1 / roughness) / (2 * pi_d);
            projected += d * mu * rule.w[i] * 2 * pi_d;
            for (const double mu_o : cosines) {
                for (const double mu_i : cosines) {
                    const double expected = d / (4 * (mu_o + mu_i - mu_o * mu_i));
                    EXPECT_NEAR(
                        double(sheen_f(float(mu_o), float(mu_i), float(mu), float(roughness))),
                        expected, 1e-3 * expected + 1e-5)
                        << roughness << " " << mu << " " << mu_o << " " << mu_i;
                }
            }
        }
        projected_worst = std::max(projected_worst, std::abs(projected - 1));
    }
    std::printf("area of the facets seen from above: off by %.1e\n", projected_worst);
    EXPECT_LT(projected_worst, 1e-4);
}

TEST(Sheen, AlbedoIsItsIntegral) {
    double worst = 0;
    for (const float roughness : {0.1f, 0.23f, 0.5f, 0.81f, 1.0f}) {
        for (const double mu : {0.02, 0.1, 0.33, 0.7, 1.0}) {
            const Vec3 wo = direction(mu);
            const double exact =
                double(SheenAlbedo::of_process().scale(roughness)) * integral([&](const Vec3& wi) {
                    const Vec3 across = wo + wi;
                    const float cos_m = across.z / std::sqrt(across.dot(across));
                    return double(sheen_f(wo.z, wi.z, std::min(cos_m, 1.0f), roughness));
                });
            worst = std::max(
                worst,
                std::abs(exact - double(SheenAlbedo::of_process().at(float(mu), roughness))));
            EXPECT_LE(exact, 1.001) << roughness << " " << mu;
        }
    }
    std::printf("worst error of the table: %.1e\n", worst);
    EXPECT_LT(worst, 3e-3);
}

TEST(Sheen, NothingReflectsMoreThanOne) {
    for (const float roughness : {0.07f, 0.2f, 0.5f, 1.0f}) {
        for (const double mu : cosines) {
            for (const float weight : {0.3f, 1.0f}) {
                SurfaceParameters white;
                white.diffuse = Rgb(1.0f);
                white.alpha = 0.3f;
                white.clearcoat = 0.5f;
                white.clearcoat_alpha = 0.1f;
                const Vec3 wo = direction(mu);
                const SurfaceParameters p = with_sheen(white, roughness, weight);
                const double e = energy(Bsdf(p, up, up, wo), wo, 0.1).total();
                EXPECT_LE(e, 1.002) << roughness << " " << mu;
                EXPECT_GE(e, 0.6) << roughness << " " << mu;
            }
        }
    }
}

TEST(Sheen, GlassBelowItGainsNothing) {
    for (const double mu : cosines) {
        for (const float side : {1.0f, -1.0f}) {
            SurfaceParameters p;
            p.opacity = 0;
            p.alpha = 0;
            const Vec3 wo = direction(mu) * side;
            const double e = energy(Bsdf(with_sheen(p, 0.4f), up, up, wo), wo, 0.5).total();
            EXPECT_LE(e, 1.002) << mu << " " << side;
        }
    }
}

std::vector<SurfaceParameters> surfaces() {
    SurfaceParameters plastic;
    plastic.diffuse = Rgb(0.7f, 0.2f, 0.4f);
    plastic.alpha = 0.2f;
    SurfaceParameters coated = plastic;
    coated.clearcoat = 0.7f;
    coated.clearcoat_alpha = 0.1f;
    coated.coat_ior = 1.3f;
    coated.diffuse_roughness = 0.6f;
    return {matte(0.6f, 0.8f), with_sheen(matte(0.6f, 0.8f), 0.3f), with_sheen(plastic, 0.5f, 0.4f),
            coated, with_sheen(coated, 0.2f)};
}

TEST(Sheen, Reciprocity) {
    TestRandom random(5);
    for (const SurfaceParameters& p : surfaces()) {
        for (int i = 0; i < 300; ++i) {
            const Vec3 a =
                direction(0.02 + 0.98 * double(random.uniform()), 6 * double(random.uniform()));
            const Vec3 b =
                direction(0.02 + 0.98 * double(random.uniform()), 6 * double(random.uniform()));
            const Rgb there = Bsdf(p, up, up, a).f(a, b), back = Bsdf(p, up, up, b).f(b, a);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(double(there[c]), double(back[c]), 1e-5 + 1e-4 * double(there[c]));
        }
    }
}

TEST(Sheen, SamplesFollowThePdfAndGiveTheIntegral) {
    constexpr int rows = 8, columns = 8, count = 40000, sub = 24;
    for (const SurfaceParameters& p : surfaces()) {
        for (const double mu : {0.9, 0.2}) {
            const Vec3 wo = direction(mu);
            const Bsdf bsdf(p, up, up, wo);
            const Frame frame = Frame::from_z(bsdf.ns());
            std::vector<double> counts(rows * columns, 0.0), expected(rows * columns, 0.0);
            TestRandom random(77);
            double sum = 0, sum2 = 0;
            int kept = 0;
            const auto cell = [&](const Vec3& local) {
                const int r = std::min(rows - 1, int(double(local.z * local.z) * rows));
                const double turn = double(std::atan2(local.y, local.x)) / (2 * pi_d) + 0.5;
                return r * columns + std::min(columns - 1, int(turn * columns));
            };
            for (int i = 0; i < count; ++i) {
                const auto s =
                    bsdf.sample_f(wo, random.uniform(), Vec2(random.uniform(), random.uniform()));
                if (!s) continue;
                ASSERT_FALSE(s->is_delta);
                ASSERT_NEAR(double(s->pdf / bsdf.pdf(wo, s->wi)), 1.0, 1e-2);
                counts[size_t(cell(frame.to_local(s->wi)))] += 1;
                ++kept;
                const double x = double(s->f.y) * double(bsdf.cosine(s->wi)) / double(s->pdf);
                sum += x / count;
                sum2 += x * x / count;
            }
            double inside = 0;
            for (int r = 0; r < rows * sub * 4; ++r) {
                for (int k = 0; k < columns * sub; ++k) {
                    const double z = std::sqrt((r + 0.5) / (rows * sub * 4));
                    const double phi = ((k + 0.5) / (columns * sub) - 0.5) * 2 * pi_d;
                    const Vec3 local = direction(z, phi);
                    const double mass = double(bsdf.pdf(wo, frame.from_local(local))) * pi_d / z /
                                        (rows * sub * 4 * columns * sub);
                    expected[size_t(cell(local))] += mass * count;
                    inside += mass;
                }
            }
            EXPECT_NEAR(inside, double(kept) / count, 0.02);
            EXPECT_LT(sampling::testing::chi_square(counts, expected).z, 4.5) << mu;
            const double sigma = std::sqrt(std::max(sum2 - sum * sum, 0.0) / count);
            EXPECT_NEAR(sum, energy(bsdf, wo, 0.1).total(), 4.5 * sigma + 2e-3) << mu;
        }
    }
}

}  // namespace
}  // namespace velatura::shading
