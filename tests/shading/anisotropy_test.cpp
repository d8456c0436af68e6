// SPDX-License-Identifier: Apache-2.0
// GGX with two widths: sampling, albedo, energy, reciprocity, rough transmission
// (docs/engineering/hard_cases.md H18 … H21).
#include "../sampling/chi_square.h"
#include "bsdf_quadrature.h"
#include "half_vector_cells.h"
#include "hard_case.h"
#include "shading/anisotropic_albedo.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace velatura::shading {
namespace {

using sampling::testing::TestRandom;
using testing::direction;
using testing::GaussLegendre;

const Vec3 up(0, 0, 1);

Vec3d direction_d(double mu, double phi) {
    const double r = std::sqrt(std::max(0.0, 1 - mu * mu));
    return {r * std::cos(phi), r * std::sin(phi), mu};
}

AnisotropicAlbedo albedo_of(const Vec2& alpha) {
    return AnisotropicAlbedo({alpha.x, alpha.x, alpha.y / alpha.x, alpha.y / alpha.x});
}

/// Frame of the widths: x along the tangent.
SurfaceParameters brushed(const AnisotropicAlbedo& albedo, const Vec2& alpha) {
    SurfaceParameters p;
    p.diffuse = Rgb(0.0f);
    p.f0 = p.f90 = Rgb(1.0f);
    p.alpha = alpha.x;
    p.alpha_y = alpha.y;
    p.anisotropic = &albedo;
    p.tangent = Vec3(1, 0, 0);
    return p;
}

struct AlbedoByNormals {
    double loss = 0, schlick = 0;  ///< as in GgxAlbedo
};

/// Albedo by Gauss quadrature over all visible normals: neither the lattice nor the bounded cap of
/// the tables.
AlbedoByNormals albedo_by_normals(const Vec3d& wo, const Vec2d& alpha) {
    static const GaussLegendre rule(96);
    constexpr int phi_count = 160;
    AlbedoByNormals e{1, 0};
    for (size_t i = 0; i < rule.x.size(); ++i) {
        for (int j = 0; j < phi_count; ++j) {
            const Vec3d m = ggx_sample_normal(wo, alpha, Vec2d((j + 0.5) / phi_count, rule.x[i]));
            const double c = wo.dot(m);
            const Vec3d wi = m * (2 * c) - wo;
            if (wi.z <= 0) continue;
            const double weight = rule.w[i] / phi_count * 4 * wo.z * wi.z *
                                  ggx_visibility(wo, wi, alpha) / ggx_g1(wo, alpha);
            e.loss -= weight;
            e.schlick += weight * std::pow(1 - std::min(c, 1.0), 5);
        }
    }
    return e;
}

TEST(Anisotropy, WidthsFollowOpenPbr) {
    const Vec2 isotropic = anisotropic_alpha(0.5f, 0.0f);
    EXPECT_FLOAT_EQ(isotropic.x, 0.25f);
    EXPECT_FLOAT_EQ(isotropic.y, 0.25f);
    for (const float a : {0.2f, 0.7f, 0.95f}) {
        const Vec2 alpha = anisotropic_alpha(0.6f, a);
        EXPECT_NEAR(double(alpha.y / alpha.x), 1 - double(a), 1e-6);
        EXPECT_NEAR(double(alpha.x * alpha.x + alpha.y * alpha.y), 2 * std::pow(0.6, 4), 1e-6);
    }
    EXPECT_EQ(anisotropic_alpha(0.6f, 1.0f).y, min_alpha);
}

TEST(Anisotropy, DistributionAgreesWithLongDouble) {
    TestRandom random(3);
    double worst = 0;
    const float widths[] = {1.0f, 0.1f, 0.01f, 1e-3f, 1e-4f};
    for (const float alpha_x : widths) {
        for (const float alpha_y : widths) {
            for (int i = 0; i < 500; ++i) {
                const float s = std::exp(8 * random.uniform() - 5), phi = 6.28f * random.uniform();
                const Vec3 slopes(alpha_x * s * std::cos(phi), alpha_y * s * std::sin(phi), 1.0f);
                const Vec3 m = normalize(slopes);
                const long double a = alpha_x, b = alpha_y, x = m.x / a, y = m.y / b, z = m.z;
                const long double sum = x * x + y * y + z * z;
                const long double exact = 1 / (3.14159265358979323846L * a * b * sum * sum);
                worst =
                    std::max(worst, double(std::abs(ggx_d(m, Vec2(alpha_x, alpha_y)) / exact - 1)));
            }
        }
    }
    EXPECT_LT(worst, 1e-5);
}

TEST(H19VisibleNormals, OfTwoWidthsFollowTheirDensity) {
    double worst = -10;
    const double widths[] = {1e-3, 1e-2, 0.1, 1.0};
    for (const double mu : {1.0, 0.5, 0.1, 1e-2, 1e-3, 1e-4}) {
        for (const double alpha_x : widths) {
            for (const double alpha_y : widths) {
                const Vec3d wo = direction_d(mu, 0.7);
                const Vec2d alpha(alpha_x, alpha_y);
                constexpr int count = 40000;
                const testing::ChiSquareRun run = testing::run_chi_square<double>(
                    wo, alpha, testing::cell_probabilities(wo, alpha), count,
                    static_cast<unsigned long long>(mu * 1e6 + alpha_x * 1e4 + alpha_y * 1e7));
                worst = hardcase::larger(worst, run.z);
                EXPECT_LE(run.heaviest, 1 + 1e-5);
                const double sigma = std::sqrt(run.lost * (1 - run.lost) / count);
                EXPECT_NEAR(run.inside, 1 - run.lost, 1e-3 + 4 * sigma)
                    << mu << " " << alpha_x << " " << alpha_y;
            }
        }
    }
    // 3.71: family-wise 1 % over 96 tests (Šidák), one-sided
    hardcase::expect_within(
        {"worst chi-square deviate of 96 settings of two widths", hardcase::larger(0.0, worst),
         3.71, 0, "the density, integrated over cells",
         fmt::format("a cell wrong by {:.0f} %",
                     100 * sampling::testing::smallest_detectable(40000, 120))});
}

TEST(AnisotropicAlbedo, AgreesWithQuadratureBetweenItsNodes) {
    TestRandom random(5);
    double worst_loss = 0, worst_schlick = 0;
    const Vec2 pairs[] = {{1.0f, 0.5f},   {1.0f, 1e-3f},  {0.5f, 0.05f}, {0.3f, 0.1f},
                          {0.05f, 0.01f}, {0.01f, 1e-3f}, {1.4f, 1e-4f}, {1.2f, 0.6f}};
    for (const Vec2& alpha : pairs) {
        const AnisotropicAlbedo albedo = albedo_of(alpha);
        const AnisotropicAlbedo::Curve curve = albedo.curve(alpha);
        for (int i = 0; i < 40; ++i) {
            const double mu = 0.01 + 0.99 * std::pow(double(random.uniform()), 2);
            const double phi = 2 * pi_d * double(random.uniform());
            const AlbedoByNormals e = albedo_by_normals(direction_d(mu, phi), Vec2d(alpha));
            const GgxAlbedo a = curve.at(direction(mu, phi));
            worst_loss = hardcase::larger(worst_loss, std::abs(e.loss - double(a.loss)));
            worst_schlick =
                hardcase::larger(worst_schlick, std::abs(e.schlick - double(a.schlick)));
        }
    }
    std::printf("one pair: worst error of loss %.1e, schlick %.1e\n", worst_loss, worst_schlick);
    EXPECT_LT(worst_loss, 1e-3);
    EXPECT_LT(worst_schlick, 1e-3);
}

TEST(AnisotropicAlbedo, RangesAgreeWithQuadratureToo) {
    TestRandom random(6);

    struct Case {
        AnisotropyRange range;
        const char* name;
    };

    const float high = anisotropic_alpha(1.0f, 0.7f).x;
    for (const Case& k : {Case{{1e-3f, high, 0.3f, 0.3f}, "roughness varies"},
                          Case{{0.25f, 0.35f, 1e-4f, 1.0f}, "anisotropy varies"},
                          Case{{1e-3f, std::sqrt(2.0f), 1e-4f, 1.0f}, "both vary"}}) {
        const AnisotropicAlbedo albedo(k.range);
        double worst_loss = 0, worst_schlick = 0, worst_mean = 0;
        for (int i = 0; i < 150; ++i) {
            const auto between = [&](float low, float top) {
                const float t = random.uniform();
                const float root = std::sqrt(low) + (std::sqrt(top) - std::sqrt(low)) * t;
                return root * root;
            };
            const float x = between(k.range.alpha_low, k.range.alpha_high);
            const float ratio = between(k.range.ratio_low, k.range.ratio_high);
            const Vec2 alpha(x, std::min(std::max(x * ratio, min_alpha), x));
            const AnisotropicAlbedo::Curve curve = albedo.curve(alpha);
            const double mu = 0.01 + 0.99 * std::pow(double(random.uniform()), 2);
            const double phi = 2 * pi_d * double(random.uniform());
            const AlbedoByNormals e = albedo_by_normals(direction_d(mu, phi), Vec2d(alpha));
            const GgxAlbedo a = curve.at(direction(mu, phi));
            worst_loss = hardcase::larger(worst_loss, std::abs(e.loss - double(a.loss)));
            worst_schlick =
                hardcase::larger(worst_schlick, std::abs(e.schlick - double(a.schlick)));
            if (i % 30 != 0) continue;
            const float mean = albedo_of(alpha).curve(alpha).average().loss;
            worst_mean =
                hardcase::larger(worst_mean, double(std::abs(mean - curve.average().loss)));
        }
        std::printf("%s: worst error of loss %.1e, schlick %.1e, mean loss %.1e\n", k.name,
                    worst_loss, worst_schlick, worst_mean);
        EXPECT_LT(worst_loss, 5e-3) << k.name;
        EXPECT_LT(worst_schlick, 5e-3) << k.name;
        EXPECT_LT(worst_mean, 2e-3) << k.name;
    }
}

/// ∫ f·cos in double over the upper hemisphere by two lattices joined by the balance heuristic: one
/// follows the lobe, the other covers the hemisphere. passed: the other side, as power.
struct Shares {
    double reflected = 0, passed = 0;
};

Shares quadrature_energy(const Bsdf& bsdf, const SurfaceParameters& p, const Vec3& wo) {
    constexpr int count = 17711;  // of the Fibonacci numbers
    const double side = wo.z > 0 ? 1 : -1;
    const Vec2d alpha{double(p.alpha), double(p.alpha_y)};
    const double eta = side > 0 ? double(p.ior) : 1 / double(p.ior);
    const Vec3d o(double(wo.x), double(wo.y), double(wo.z) * side);
    Shares s;
    const auto f = [&](const Vec3d& wi) {
        const Vec3 w(float(wi.x), float(wi.y), float(wi.z * side));
        return double(bsdf.f(wo, w).y) * double(bsdf.cosine(w)) / count;
    };
    const auto add_reflected = [&](const Vec3d& wi) {
        if (wi.z <= 0) return;
        Vec3d m = o + wi;
        m /= std::sqrt(m.dot(m));
        s.reflected += f(wi) / (ggx_pdf(o, m, alpha) + 1 / (4 * pi_d * std::sqrt(wi.z)));
    };
    for (int i = 0; i < count; ++i) {
        const Vec2d u(std::fmod(i * 0.61803398874989485, 1.0), (i + 0.5) / count);
        const double z = u.y * u.y, r = std::sqrt(1 - z * z), phi = 2 * pi_d * u.x;
        add_reflected(Vec3d(r * std::cos(phi), r * std::sin(phi), z));
        add_reflected(ggx_sample(o, alpha, u));
        if (!p.interface) continue;
        const Vec3d m = ggx_sample_normal(o, alpha, u);
        const double cos_o = o.dot(m);
        const double cos2_t = 1 - (1 - cos_o * cos_o) / (eta * eta);
        if (cos_o <= 0 || cos2_t <= 0) continue;
        const double cos_t = std::sqrt(cos2_t), across = cos_o - eta * cos_t;
        const Vec3d refracted = m * (cos_o / eta - cos_t) - o / eta;
        if (refracted.z >= 0) continue;
        s.passed += f(refracted) * across * across / (ggx_normal_pdf(o, m, cos_o, alpha) * cos_t);
    }
    return s;
}

// docs/engineering/hard_cases.md H20
TEST(AnisotropicEnergy, WhiteMetalReflectsOne) {
    double worst = 0, worst_without = 0;
    const Vec2 pairs[] = {{1.0f, 0.5f}, {1.0f, 0.05f}, {0.5f, 0.1f}, {0.2f, 0.02f}, {0.05f, 0.01f}};
    for (const Vec2& alpha : pairs) {
        const AnisotropicAlbedo albedo = albedo_of(alpha);
        const AnisotropicAlbedo::Curve curve = albedo.curve(alpha);
        const SurfaceParameters p = brushed(albedo, alpha);
        for (const double mu : {0.03, 0.1, 0.3, 0.7, 1.0}) {
            for (const double phi : {0.0, 0.5, 1.2, 1.5}) {
                const Vec3 wo = direction(mu, phi);
                const double e = quadrature_energy(Bsdf(p, up, up, wo), p, wo).reflected;
                worst = hardcase::larger(worst, std::abs(e - 1));
                worst_without = hardcase::larger(worst_without, double(curve.at(wo).loss));
                EXPECT_NEAR(e, 1.0, 1e-3) << alpha.x << " " << alpha.y << " " << mu << " " << phi;
            }
        }
    }
    std::printf("worst |R - 1|: %.1e; without compensation %.2f\n", worst, worst_without);
}

TEST(AnisotropicEnergy, WhitePlasticReflectsOne) {
    double worst = 0;
    for (const Vec2& alpha : {Vec2(0.8f, 0.1f), Vec2(0.2f, 0.05f)}) {
        const AnisotropicAlbedo albedo = albedo_of(alpha);
        SurfaceParameters p = brushed(albedo, alpha);
        p.diffuse = Rgb(1.0f);
        p.f0 = Rgb(0.04f);
        for (const double mu : {0.05, 0.2, 0.6, 1.0}) {
            for (const double phi : {0.0, 0.8, 1.5}) {
                const Vec3 wo = direction(mu, phi);
                const double e = quadrature_energy(Bsdf(p, up, up, wo), p, wo).reflected;
                worst = hardcase::larger(worst, std::abs(e - 1));
            }
        }
    }
    std::printf("worst |R - 1|: %.1e\n", worst);
    EXPECT_LT(worst, 1.5e-3);
}

TEST(AnisotropicEnergy, EqualWidthsAreTheIsotropicLobe) {
    const float alpha = 0.3f;
    const AnisotropicAlbedo albedo({alpha, alpha, 1.0f, 1.0f});
    SurfaceParameters p = brushed(albedo, Vec2(alpha));
    p.f0 = Rgb(0.9f, 0.5f, 0.1f);
    SurfaceParameters isotropic = p;
    isotropic.anisotropic = nullptr;
    TestRandom random(8);
    for (int i = 0; i < 2000; ++i) {
        const Vec3 a =
            direction(0.02 + 0.98 * double(random.uniform()), 7 * double(random.uniform()));
        const Vec3 b =
            direction(0.02 + 0.98 * double(random.uniform()), 7 * double(random.uniform()));
        const Bsdf one(p, up, up, a), other(isotropic, up, up, a);
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(double(one.f(a, b)[c] / other.f(a, b)[c]), 1.0, 5e-3);
    }
}

TEST(AnisotropicEnergy, Reciprocity) {
    TestRandom random(7);
    double worst = 0;
    const Vec2 alpha(0.6f, 0.08f);
    const AnisotropicAlbedo albedo = albedo_of(alpha);
    const RoughInterface interface(1.5f, alpha, &albedo);
    for (int i = 0; i < 5000; ++i) {
        SurfaceParameters p = brushed(albedo, alpha);
        p.diffuse = Rgb(random.uniform());
        p.f0 = Rgb(random.uniform(), random.uniform(), random.uniform());
        p.tangent = direction(0, 7 * double(random.uniform()));
        p.clearcoat = i % 3 == 0 ? random.uniform() : 0.0f;
        const bool transmits = i % 2 == 0;
        if (transmits) {
            p.opacity = 0;
            p.f0 = Rgb(0.04f);
            p.interface = &interface;
        }
        const Vec3 a =
            direction(0.02 + 0.98 * double(random.uniform()), 7 * double(random.uniform()));
        Vec3 b = direction(0.02 + 0.98 * double(random.uniform()), 7 * double(random.uniform()));
        double scale = 1;
        if (transmits && i % 4 == 0) {
            p.clearcoat = 0;
            b.z = -b.z;
            scale = 2.25;
        }
        const double ab = double(Bsdf(p, up, up, a).f(a, b).y) * scale;
        const double ba = double(Bsdf(p, up, up, b).f(b, a).y);
        if (ab < 1e-9 && ba < 1e-9) continue;
        worst = hardcase::larger(worst, std::abs(ab / ba - 1));
    }
    std::printf("worst relative difference %.1e\n", worst);
    EXPECT_LT(worst, 5e-4);
}

TEST(AnisotropicEnergy, RoughGlassReflectsAndTransmitsOne) {
    double worst = 0;
    for (const Vec2& alpha : {Vec2(0.4f, 0.05f), Vec2(0.9f, 0.3f)}) {
        const AnisotropicAlbedo albedo = albedo_of(alpha);
        const RoughInterface interface(1.5f, alpha, &albedo);
        SurfaceParameters p = brushed(albedo, alpha);
        p.f0 = Rgb(0.04f);
        p.f90 = Rgb(1.0f);
        p.opacity = 0;
        p.interface = &interface;
        for (const double mu : {0.05, 0.3, 0.76, 1.0}) {
            for (const double phi : {0.0, 0.8, 1.5}) {
                for (const float side : {1.0f, -1.0f}) {
                    const Vec3 wo = direction(mu, phi) * side;
                    const Bsdf bsdf(p, up, up, wo);
                    const Shares s = quadrature_energy(bsdf, p, wo);
                    worst = hardcase::larger(worst, std::abs(s.reflected + s.passed - 1));
                }
            }
        }
    }
    std::printf("worst |R + T - 1|: %.1e\n", worst);
    EXPECT_LT(worst, 3e-3);
}

// The mean of the sampler's estimator is what quadrature finds
TEST(AnisotropicEnergy, EstimatorAgreesWithQuadrature) {
    const Vec2 alpha(0.5f, 0.1f);
    const AnisotropicAlbedo albedo = albedo_of(alpha);
    const RoughInterface interface(1.5f, alpha, &albedo);
    for (const bool transmits : {false, true}) {
        SurfaceParameters p = brushed(albedo, alpha);
        p.f0 = Rgb(transmits ? 0.04f : 0.6f);
        p.opacity = transmits ? 0.0f : 1.0f;
        p.interface = transmits ? &interface : nullptr;
        for (const double mu : {0.9, 0.2}) {
            const Vec3 wo = direction(mu, 0.6);
            const Bsdf bsdf(p, up, up, wo);
            double sum = 0, sum2 = 0;
            constexpr int n = 60000;
            for (int i = 0; i < n; ++i) {
                TestRandom random(static_cast<unsigned long long>(i) * 7919);
                const auto s =
                    bsdf.sample_f(wo, random.uniform(), Vec2(random.uniform(), random.uniform()));
                double x = s ? double(s->f.y) * double(bsdf.cosine(s->wi)) / double(s->pdf) : 0;
                if (s) x *= double(s->eta) * double(s->eta);
                if (s) {
                    ASSERT_NEAR(double(s->pdf / bsdf.pdf(wo, s->wi)), 1.0, 2e-2);
                }
                sum += x / n;
                sum2 += x * x / n;
            }
            const double sigma = std::sqrt(std::max(sum2 - sum * sum, 0.0) / n);
            const Shares e = quadrature_energy(bsdf, p, wo);
            EXPECT_NEAR(sum, e.reflected + e.passed, 4.5 * sigma + 2e-3) << transmits << " " << mu;
        }
    }
}

}  // namespace
}  // namespace velatura::shading
