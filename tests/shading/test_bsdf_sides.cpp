// SPDX-License-Identifier: Apache-2.0
// Shading normals that disagree with the surface (RIGOR H16).
#include "../sampling/chi_square.h"
#include "bsdf_quadrature.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::shading {
namespace {

using sampling::testing::TestRandom;
using testing::direction;

const Vec3 up(0, 0, 1);

Vec3 tilted(double degrees) {
    const double a = degrees * pi_d / 180;
    return Vec3(float(std::sin(a)), 0, float(std::cos(a)));
}

TEST(BsdfSides, OpaqueWallsLeakNothing) {
    TestRandom random(4);
    SurfaceParameters p;
    p.diffuse = Rgb(1.0f);
    p.clearcoat = 0.5f;
    p.clearcoat_alpha = 0.1f;
    for (int i = 0; i < 20000; ++i) {
        const float side = i % 2 == 0 ? 1.0f : -1.0f;
        const Vec3 wo = direction(double(random.uniform()), 6 * double(random.uniform())) * side;
        const Vec3 wi = direction(double(random.uniform()), 6 * double(random.uniform())) * -side;
        const Bsdf bsdf(p, up, tilted(89.9 * double(random.uniform())), wo);
        ASSERT_TRUE(is_black(bsdf.f(wo, wi)));
        ASSERT_EQ(bsdf.pdf(wo, wi), 0.0f);
        const auto s =
            bsdf.sample_f(wo, random.uniform(), Vec2(random.uniform(), random.uniform()));
        if (!s) continue;
        ASSERT_EQ(s->kind, ScatterKind::Reflect);
        ASSERT_GT(s->wi.z * side, 0.0f);
    }
}

TEST(BsdfSides, TransmissionAlwaysCrosses) {
    TestRandom random(8);
    SurfaceParameters p;
    p.opacity = 0;
    p.alpha = 0;
    int crossed = 0;
    for (int i = 0; i < 20000; ++i) {
        const float side = i % 2 == 0 ? 1.0f : -1.0f;
        const Vec3 wo = direction(double(random.uniform()), 6 * double(random.uniform())) * side;
        const Bsdf bsdf(p, up, tilted(60 * double(random.uniform())), wo);
        const auto s = bsdf.sample_f(wo, random.uniform(), Vec2(0.5f, 0.5f));
        if (!s) continue;
        ASSERT_EQ(s->kind == ScatterKind::Transmit, s->wi.z * side < 0);
        crossed += s->kind == ScatterKind::Transmit ? 1 : 0;
    }
    EXPECT_GT(crossed, 5000);
}

TEST(BsdfSides, TiltedNormalsGainNoEnergy) {
    for (const double alpha : {0.0, 0.1, 0.5}) {
        for (const double tilt : {0.0, 10.0, 45.0, 80.0, 89.9}) {
            for (const double mu : {0.05, 0.4, 1.0}) {
                for (const double phi : {0.0, 2.0, pi_d}) {
                    SurfaceParameters p;
                    p.diffuse = Rgb(1.0f);
                    p.alpha = float(alpha);
                    const Vec3 wo = direction(mu, phi);
                    const Bsdf bsdf(p, up, tilted(tilt), wo);
                    EXPECT_LE(testing::energy(bsdf, wo, std::max(alpha, 0.1)).total(), 1 + 1e-3)
                        << alpha << " " << tilt << " " << mu << " " << phi;
                }
            }
        }
    }
}

TEST(BsdfSides, ShadingNormalBehindTheViewerIsBentForward) {
    const Vec3 wo = direction(0.1, pi_d);  // from −x, the normal leans to +x
    SurfaceParameters p;
    const Bsdf bsdf(p, up, tilted(80), wo);
    EXPECT_GT(bsdf.ns().dot(wo), 0.0f);
    EXPECT_GT(bsdf.ns().z, 0.0f);
    EXPECT_FALSE(is_black(bsdf.f(wo, up)));
}

TEST(BsdfSides, OpaqueSurfacesShadeBothSidesAlike) {
    SurfaceParameters p;
    p.diffuse = Rgb(0.6f);
    p.alpha = 0.2f;
    const Vec3 wo = direction(0.3, 1), wi = direction(0.8, 4);
    const Bsdf front(p, up, up, wo), back(p, up, up, -wo);
    EXPECT_FLOAT_EQ(front.f(wo, wi).x, back.f(-wo, -wi).x);
    EXPECT_LT(back.ns().z, 0.0f);
}

}  // namespace
}  // namespace velatura::shading
