// SPDX-License-Identifier: Apache-2.0
// White furnaces by quadrature in double, and reciprocity (H20, H21).
#include "../sampling/chi_square.h"
#include "bsdf_quadrature.h"
#include "hard_case.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

namespace velatura::shading {
namespace {

using sampling::testing::TestRandom;
using testing::direction;
using testing::energy;

const Vec3 up(0, 0, 1);
constexpr double alphas[] = {0.0, 0.001, 0.01, 0.1, 0.25, 0.5, 1.0};
constexpr double cosines[] = {0.01, 0.03, 0.1, 0.3, 0.7, 1.0};

SurfaceParameters metal(double alpha) {
    SurfaceParameters p;
    p.diffuse = Rgb(0.0f);
    p.f0 = p.f90 = Rgb(1.0f);
    p.alpha = float(alpha);
    return p;
}

SurfaceParameters dielectric(double alpha, float albedo) {
    SurfaceParameters p;
    p.diffuse = Rgb(albedo);
    p.alpha = float(alpha);
    return p;
}

TEST(H20Energy, WhiteMetalReflectsOne) {
    double worst = 0;
    for (const double alpha : alphas) {
        for (const double mu : cosines) {
            const Vec3 wo = direction(mu);
            const double e = energy(Bsdf(metal(alpha), up, up, wo), wo, alpha).total();
            worst = hardcase::larger(worst, std::abs(e - 1));
        }
    }
    hardcase::expect_within(
        {"white metal: R - 1, alpha 0 to 1", worst, 1e-3, 0, "quadrature in double"});
}

TEST(BsdfEnergy, WhiteDielectricReflectsOne) {
    for (const double alpha : alphas) {
        for (const double mu : cosines) {
            const Vec3 wo = direction(mu);
            EXPECT_NEAR(energy(Bsdf(dielectric(alpha, 1), up, up, wo), wo, alpha).total(), 1.0,
                        1e-3)
                << "alpha " << alpha << " mu " << mu;
        }
    }
}

TEST(BsdfEnergy, LambertReflectsItsAlbedo) {
    SurfaceParameters p;
    p.diffuse = Rgb(0.5f);
    p.f0 = p.f90 = Rgb(0.0f);
    p.alpha = 0;
    const Vec3 wo = direction(0.4);
    const Bsdf bsdf(p, up, up, wo);
    EXPECT_NEAR(energy(bsdf, wo, 0.5).total(), 0.5, 1e-5);
    EXPECT_NEAR(double(bsdf.f(wo, direction(0.2, 2)).x), 0.5 / pi_d, 1e-7);
    EXPECT_NEAR(double(bsdf.albedo().x), 0.5, 1e-6);
}

// The smooth dielectric's own numbers: Schlick's term in front of the diffuse base
TEST(BsdfEnergy, SmoothMirrorIsSchlick) {
    for (const double mu : cosines) {
        const Vec3 wo = direction(mu);
        const auto e = energy(Bsdf(dielectric(0, 0), up, up, wo), wo, 0);
        EXPECT_NEAR(e.mirror, 0.04 + 0.96 * std::pow(1 - mu, 5), 1e-5);
        EXPECT_EQ(e.smooth, 0.0);
    }
}

TEST(H20Energy, GlassReflectsAndTransmitsOneFromBothSides) {
    double worst = 0;
    for (const double alpha : {0.0, 0.01, 0.25, 1.0}) {  // roughness 0, 0.1, 0.5, 1
        for (const double mu : cosines) {
            for (const float side : {1.0f, -1.0f}) {
                SurfaceParameters p = dielectric(alpha, 0.5f);
                p.opacity = 0;
                const Vec3 wo = direction(mu) * side;
                const auto e = energy(Bsdf(p, up, up, wo), wo, alpha);
                worst = hardcase::larger(worst, std::abs(e.total() - 1));
                if (side < 0 && mu < std::sqrt(1 - 1 / 2.25)) {
                    EXPECT_EQ(e.transmitted, 0.0);
                } else {
                    EXPECT_GT(e.transmitted, 0.0);
                }
            }
        }
    }
    hardcase::expect_within(
        {"glass with sharp transmission: R + T - 1", worst, 2e-3, 0, "quadrature in double"});
}

TEST(BsdfEnergy, HalfOpaqueWhiteKeepsOneFromBothSides) {
    for (const double alpha : {0.0, 0.25, 1.0}) {
        for (const double mu : cosines) {
            for (const float side : {1.0f, -1.0f}) {
                SurfaceParameters p = dielectric(alpha, 1);
                p.opacity = 0.4f;
                const Vec3 wo = direction(mu) * side;
                // Total reflection starts with an infinite slope: more nodes
                EXPECT_NEAR(energy(Bsdf(p, up, up, wo), wo, alpha, 256).total(), 1.0, 3e-3)
                    << "alpha " << alpha << " mu " << mu << " side " << side;
            }
        }
    }
}

TEST(H20Energy, NothingReflectsMoreThanOne) {
    double max = 0;
    TestRandom random(31);
    for (int i = 0; i < 60; ++i) {
        SurfaceParameters p;
        p.diffuse = Rgb(random.uniform() < 0.5f ? 1.0f : random.uniform());
        p.f0 = Rgb(random.uniform());
        p.f90 = Rgb(random.uniform() < 0.5f ? 1.0f : random.uniform());
        const float roughness = random.uniform(), coat_roughness = 0.5f * random.uniform();
        p.alpha = roughness * roughness;
        p.clearcoat = random.uniform() < 0.5f ? 1.0f : random.uniform();
        p.clearcoat_alpha = coat_roughness * coat_roughness;
        p.opacity = random.uniform() < 0.5f ? 1.0f : random.uniform();
        const Vec3 wo =
            direction(0.02 + 0.98 * double(random.uniform())) * (i % 2 == 0 ? 1.0f : -1.0f);
        const Bsdf bsdf(p, up, up, wo);
        const auto e = energy(bsdf, wo, double(std::min(p.alpha, p.clearcoat_alpha)), 96);
        max = hardcase::larger(max, e.total());
        EXPECT_LE(e.total(), double(bsdf.albedo().y) + 5e-3) << i;
    }
    hardcase::expect_within({"60 random surfaces: what R + T exceeds 1 by",
                             hardcase::larger(0.0, max - 1), 1e-3, 0, "quadrature in double"});
}

// A clear coat over white loses what a specular base reflects between the two, and nothing else
TEST(BsdfEnergy, CoatOverWhiteKeepsTheEnergy) {
    double lowest = 2, lowest_matt = 2;
    for (const double mu : {0.03, 0.1, 0.3, 0.7, 1.0}) {
        for (const float coat_alpha : {1e-4f, 0.04f, 0.3f}) {
            for (const float weight : {0.3f, 1.0f}) {
                for (const float ior : {1.2f, 1.5f, 2.0f}) {
                    SurfaceParameters p = dielectric(0.25, 1);
                    p.clearcoat = weight;
                    p.clearcoat_alpha = coat_alpha;
                    p.ior = ior;
                    const Vec3 wo = direction(mu);
                    const double rule = double(coat_alpha) < 1e-3 ? 0.25 : double(coat_alpha);
                    const double e = energy(Bsdf(p, up, up, wo), wo, rule, 128).total();
                    EXPECT_LE(e, 1 + 1e-3);
                    lowest = std::min(lowest, e);
                    // Over a matt base the coupling is exact
                    p.f0 = p.f90 = Rgb(0.0f);
                    const double matt = energy(Bsdf(p, up, up, wo), wo, rule, 128).total();
                    EXPECT_NEAR(matt, 1.0, 2e-3) << mu << " " << coat_alpha << " " << ior;
                    lowest_matt = std::min(lowest_matt, matt);
                }
            }
        }
    }
    std::printf("coat over white: matt base %.4f, specular base %.4f at least\n", lowest_matt,
                lowest);
    EXPECT_GE(lowest, 0.97);
}

// The specification: ior counts for the coat as well
TEST(BsdfEnergy, CoatFollowsTheIndex) {
    for (const float ior : {1.0f, 1.2f, 1.5f, 2.0f}) {
        SurfaceParameters p = dielectric(0, 0);
        p.f0 = p.f90 = Rgb(0.0f);
        p.clearcoat = 1;
        p.clearcoat_alpha = 0;
        p.ior = ior;
        const double r = double((1 - ior) / (1 + ior));
        for (const double mu : cosines) {
            const Vec3 wo = direction(mu);
            const auto e = energy(Bsdf(p, up, up, wo), wo, 0);
            const double f = r * r + (1 - r * r) * std::pow(1 - mu, 5);
            EXPECT_NEAR(e.mirror, ior == 1.0f ? 0.0 : f, 1e-5) << ior << " " << mu;
        }
    }
}

TEST(H21Reciprocity, OfReflection) {
    TestRandom random(7);
    double worst = 0;
    const uint64_t pairs = hardcase::sized(100000, 10000000, 100000000);
    for (uint64_t i = 0; i < pairs; ++i) {
        SurfaceParameters p;
        const float roughness = random.uniform();
        p.diffuse = Rgb(random.uniform(), random.uniform(), random.uniform());
        p.f0 = Rgb(random.uniform(), random.uniform(), random.uniform());
        p.alpha = std::max(roughness * roughness, 0.002f);
        p.clearcoat = i % 3 == 0 ? random.uniform() : 0.0f;
        p.clearcoat_alpha = 0.1f * random.uniform();
        p.opacity = i % 5 == 0 ? random.uniform() : 1.0f;
        const Vec3 a =
            direction(0.01 + 0.99 * double(random.uniform()), 7 * double(random.uniform()));
        const Vec3 b =
            direction(0.01 + 0.99 * double(random.uniform()), 7 * double(random.uniform()));
        const Bsdf from_a(p, up, up, a), from_b(p, up, up, b);
        const Rgb ab = from_a.f(a, b), ba = from_b.f(b, a), same = from_a.f(b, a);
        for (int c = 0; c < 3; ++c) {
            worst = hardcase::larger(worst, std::abs(double(ab[c]) / double(ba[c]) - 1));
            ASSERT_EQ(same[c], ba[c]);
        }
    }
    hardcase::expect_within({fmt::format("f there and back of {} pairs, relative", pairs), worst,
                             1e-4, 0, "the other way"});
}

// 1 − R of a refracted pair is the same from both sides, and f carries 1/η² each way
TEST(H21Reciprocity, OfTransmissionWithEtaSquared) {
    double worst = 0;
    for (const double alpha : {0.0, 0.25}) {
        for (const double mu : {0.2, 0.5, 0.9}) {
            SurfaceParameters p = dielectric(alpha, 0);
            p.opacity = 0;
            const Vec3 wo = direction(mu);
            const Bsdf outside(p, up, up, wo);
            const auto in = outside.sample_f(wo, 0.9999f, Vec2(0.5f, 0.5f));
            ASSERT_TRUE(in && in->kind == ScatterKind::Transmit);
            // Snell
            EXPECT_NEAR(std::hypot(double(in->wi.x), double(in->wi.y)) * 1.5,
                        std::sqrt(1 - mu * mu), 1e-6);
            const Bsdf inside(p, up, up, in->wi);
            const auto out = inside.sample_f(in->wi, 0.9999f, Vec2(0.5f, 0.5f));
            ASSERT_TRUE(out && out->kind == ScatterKind::Transmit);
            EXPECT_NEAR(double((out->wi - wo).length()), 0.0, 1e-5);
            const double t_in = double(in->f.x) * double(outside.cosine(in->wi)) * 2.25;
            const double t_out = double(out->f.x) * double(inside.cosine(out->wi)) / 2.25;
            worst = hardcase::larger(worst, std::abs(t_in - t_out));
        }
    }
    hardcase::expect_within(
        {"smooth glass: what passes into it and out of it", worst, 1e-5, 0, "the other way"});
}

TEST(H22Fresnel, IndexOnePassesStraightThrough) {
    double turn = 0;
    SurfaceParameters p;
    p.f0 = p.f90 = Rgb(0.0f);
    p.ior = 1;
    p.opacity = 0;
    p.alpha = 0;
    for (const double mu : {1e-4, 0.1, 1.0}) {
        const Vec3 wo = direction(mu);
        const Bsdf bsdf(p, up, up, wo);
        const auto s = bsdf.sample_f(wo, 0.3f, Vec2(0.1f, 0.2f));
        ASSERT_TRUE(s.has_value());
        EXPECT_EQ(s->eta, 1.0f);
        turn = hardcase::larger(turn, double((s->wi + wo).length()));
        EXPECT_NEAR(double(s->f.x * bsdf.cosine(s->wi) / s->pdf), 1.0, 1e-5);
    }
    hardcase::expect_within({"index 1: turn of a ray that passes", turn, 1e-6, 0, "closed form"});
}

}  // namespace
}  // namespace velatura::shading
