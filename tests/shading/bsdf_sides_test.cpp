// SPDX-License-Identifier: Apache-2.0
// Shading normals that disagree with the surface (H16).
#include "../sampling/chi_square.h"
#include "bsdf_quadrature.h"
#include "hard_case.h"

#include <fmt/format.h>
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

TEST(H16ShadingNormals, OpaqueWallsLeakNothing) {
    TestRandom random(4);
    SurfaceParameters p;
    p.diffuse = Rgb(1.0f);
    p.clearcoat = 0.5f;
    p.clearcoat_alpha = 0.1f;
    // One lobe alone has code of its own
    SurfaceParameters matte;
    matte.diffuse = Rgb(1.0f);
    matte.f0 = matte.f90 = Rgb(0.0f);
    const uint64_t count = hardcase::sized(50000, 10000000, 100000000);
    double leaked = 0;
    for (uint64_t i = 0; i < count; ++i) {
        const float side = i % 2 == 0 ? 1.0f : -1.0f;
        const Vec3 wo = direction(double(random.uniform()), 6 * double(random.uniform())) * side;
        const Vec3 wi = direction(double(random.uniform()), 6 * double(random.uniform())) * -side;
        const Bsdf bsdf(i % 3 == 0 ? matte : p, up, tilted(89.9 * double(random.uniform())), wo);
        leaked += double(bsdf.f(wo, wi).x);
        ASSERT_EQ(bsdf.pdf(wo, wi), 0.0f);
        const auto s =
            bsdf.sample_f(wo, random.uniform(), Vec2(random.uniform(), random.uniform()));
        if (!s) continue;
        ASSERT_EQ(s->kind, ScatterKind::Reflect);
        ASSERT_GT(s->wi.z * side, 0.0f);
    }
    hardcase::expect_within(
        {fmt::format("light through an opaque wall, {} pairs, normals tilted to 89.9 degrees",
                     count),
         leaked, 0, 0, "none", fmt::format("a share of {:.1g}", 3.0 / double(count))});
}

TEST(H16ShadingNormals, TransmissionAlwaysCrosses) {
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

TEST(H16ShadingNormals, GainNoEnergy) {
    double max = 0;
    for (const double alpha : {0.0, 0.1, 0.5}) {
        for (const double tilt : {0.0, 10.0, 45.0, 80.0, 89.9}) {
            for (const double mu : {0.05, 0.4, 1.0}) {
                for (const double phi : {0.0, 2.0, pi_d}) {
                    SurfaceParameters p;
                    p.diffuse = Rgb(1.0f);
                    p.alpha = float(alpha);
                    const Vec3 wo = direction(mu, phi);
                    const Bsdf bsdf(p, up, tilted(tilt), wo);
                    max = hardcase::larger(max,
                                           testing::energy(bsdf, wo, std::max(alpha, 0.1)).total());
                }
            }
        }
    }
    hardcase::expect_within({"what a furnace exceeds 1 by, normals tilted to 89.9 degrees",
                             hardcase::larger(0.0, max - 1), 1e-3, 0, "quadrature in double"});
}

// No mirror image of the viewer is swallowed by a normal map, and none is gained
TEST(H16ShadingNormals, TiltedMirrorsReflectEveryRay) {
    double worst = 0;
    for (const double tilt : {0.0, 10.0, 30.0, 45.0, 60.0, 80.0, 89.9}) {
        for (const double mu : {1e-3, 0.05, 0.4, 1.0}) {
            for (const double phi : {0.0, 0.7, 2.0, pi_d, 5.0}) {
                for (const float side : {1.0f, -1.0f}) {
                    SurfaceParameters p;
                    p.diffuse = Rgb(0.0f);
                    p.f0 = p.f90 = Rgb(1.0f);
                    p.alpha = 0;
                    const Vec3 wo = direction(mu, phi) * side;
                    const Bsdf bsdf(p, up, tilted(tilt), wo);
                    const auto s = bsdf.sample_f(wo, 0.5f, Vec2(0.5f, 0.5f));
                    ASSERT_TRUE(s) << tilt << " " << mu << " " << phi << " " << side;
                    EXPECT_GT(s->wi.z * side, 0.0f);
                    worst = hardcase::larger(
                        worst, std::abs(double(s->f.x * bsdf.cosine(s->wi) / s->pdf) - 1));
                    // Rough ones gain nothing
                    p.alpha = 0.1f;
                    EXPECT_LE(testing::energy(Bsdf(p, up, tilted(tilt), wo), wo, 0.1).total(),
                              1 + 1e-3)
                        << tilt << " " << mu << " " << phi << " " << side;
                }
            }
        }
    }
    hardcase::expect_within(
        {"what a tilted mirror reflects, less 1", worst, 1e-4, 0, "closed form"});
}

// A normal that need not be turned is not, to the bit
TEST(BsdfSides, NormalsThatReflectUpwardsStay) {
    TestRandom random(6);
    for (int i = 0; i < 20000; ++i) {
        SurfaceParameters p;
        const Vec3 wo = direction(double(random.uniform()), 6 * double(random.uniform()));
        if (wo.z < 1e-2f) continue;
        EXPECT_EQ(Bsdf(p, up, up, wo).ns(), up);
        const Vec3 ns = tilted(80 * double(random.uniform()));
        const Vec3 mirrored = ns * (2 * ns.dot(wo)) - wo;
        if (ns.dot(wo) > 1e-2f && mirrored.z > 0.011f) {
            EXPECT_EQ(Bsdf(p, up, ns, wo).ns(), ns);
        }
        // Lambert does not mirror
        p.f0 = p.f90 = Rgb(0.0f);
        if (ns.dot(wo) > 1e-2f) {
            EXPECT_EQ(Bsdf(p, up, ns, wo).ns(), ns);
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

// Above the smooth surface that a facet stands for counts as above (docs/engineering/hard_cases.md
// H15), behind both does not
TEST(BsdfSides, TheHorizonIsThatOfTheSmoothSurface) {
    const Vec3 smooth = tilted(15), wo = direction(0.9, 0.3);
    TestRandom random(2);
    for (const float alpha : {0.0f, 0.2f}) {
        SurfaceParameters p;
        p.alpha = alpha;
        const Bsdf facet(p, up, smooth, wo), lifted(p, up, smooth, wo, smooth);
        const Vec3 between = normalize(Vec3(1, 0, -0.1f)), behind = normalize(Vec3(1, 0, -0.4f));
        EXPECT_TRUE(is_black(facet.f(wo, between)));
        EXPECT_GT(lifted.f(wo, between).x, 0.0f);
        EXPECT_GT(lifted.pdf(wo, between), 0.0f);
        EXPECT_TRUE(is_black(lifted.f(wo, behind)));
        EXPECT_EQ(facet.f(wo, up).x, lifted.f(wo, up).x);
        int below = 0;
        for (int i = 0; i < 20000; ++i) {
            const auto s =
                lifted.sample_f(wo, random.uniform(), Vec2(random.uniform(), random.uniform()));
            if (!s || s->is_delta) continue;
            below += s->wi.z < 0 ? 1 : 0;
            ASSERT_GT(s->wi.dot(smooth), 0.0f);
            ASSERT_NEAR(double(s->pdf / lifted.pdf(wo, s->wi)), 1.0, 1e-2);
        }
        EXPECT_GT(below, 50);
    }
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

// What solvers of specular chains take is what paths bring in the mean
TEST(BsdfDelta, IsTheMeanOfItsSamples) {
    TestRandom random(12);
    int lobes = 0;
    for (int i = 0; i < 200; ++i) {
        SurfaceParameters p;
        p.diffuse = Rgb(0.5f);
        p.alpha = i % 3 == 0 ? 0.2f : 0.0f;
        p.clearcoat = i % 2 == 0 ? random.uniform() : 0.0f;
        p.clearcoat_alpha = i % 5 == 0 ? 0.1f : 0.0f;
        p.opacity = i % 7 == 0 ? 1.0f : random.uniform();
        const float side = random.uniform() < 0.5f ? 1.0f : -1.0f;
        const Vec3 wo =
            direction(0.05 + 0.95 * double(random.uniform()), 6 * double(random.uniform())) * side;
        const Bsdf bsdf(p, up, tilted(5), wo);

        // Every lobe has a share of the numbers that choose: add up over a fine grid of them
        constexpr int steps = 1 << 14;
        double mean[2] = {0, 0};
        Vec3 wi[2] = {Vec3(0.0f), Vec3(0.0f)};
        for (int k = 0; k < steps; ++k) {
            const auto s = bsdf.sample_f(wo, (float(k) + 0.5f) / steps, Vec2(0.5f));
            if (!s || !s->is_delta) continue;
            const size_t kind = s->kind == ScatterKind::Transmit ? 1 : 0;
            mean[kind] += double(s->f.y * bsdf.cosine(s->wi) / s->pdf) / steps;
            wi[kind] = s->wi;
        }
        for (const ScatterKind kind : {ScatterKind::Reflect, ScatterKind::Transmit}) {
            const size_t k = kind == ScatterKind::Transmit ? 1 : 0;
            const auto delta = bsdf.delta(kind);
            // A lobe may be too seldom for the grid
            EXPECT_NEAR(delta ? double(delta->weight.y) : 0.0, mean[k], 1e-3 * (1 + mean[k])) << i;
            if (mean[k] == 0) continue;
            ASSERT_TRUE(delta.has_value());
            EXPECT_EQ(delta->wi, wi[k]);
            ++lobes;
        }
    }
    EXPECT_GT(lobes, 150);
}

// Whatever the lobes, a value is its narrow and its wide part, and lobes are one or the other.
TEST(BsdfParts, NarrowAndWideMakeTheWhole) {
    for (const float alpha : {0.01f, 0.3f}) {
        for (const float coat_alpha : {0.01f, 0.3f}) {
            SurfaceParameters p;
            p.alpha = alpha;
            p.clearcoat = 0.7f;
            p.clearcoat_alpha = coat_alpha;
            const Vec3 wo = normalize(Vec3(0.3f, 0.2f, 0.9f)),
                       wi = normalize(Vec3(-0.31f, -0.2f, 0.9f));
            const Bsdf bsdf(p, up, up, wo);
            const BsdfValue value = bsdf.evaluate(wo, wi), narrow = bsdf.narrow_part(value),
                            wide = bsdf.wide_part(value);
            for (int c = 0; c < 3; ++c) {
                EXPECT_NEAR(narrow.f()[c] + wide.f()[c], value.f()[c], 1e-5f * value.f()[c]);
                EXPECT_EQ(narrow.diffuse[c], 0.0f);
                EXPECT_EQ(wide.diffuse[c], value.diffuse[c]);
            }
            EXPECT_FLOAT_EQ(narrow.coat + wide.coat, value.coat);
            EXPECT_EQ(narrow.coat > 0.0f, coat_alpha < narrow_lobe_alpha);
            EXPECT_EQ(narrow.specular[0] > narrow.coat, alpha < narrow_lobe_alpha);
            EXPECT_EQ(wide.specular[0] > 1e-4f * value.specular[0],
                      alpha > narrow_lobe_alpha || coat_alpha > narrow_lobe_alpha);
        }
    }
    const Bsdf lambert(Rgb(0.5f), up, up, up, up);
    EXPECT_TRUE(is_black(lambert.narrow_part(lambert.evaluate(up, up)).f()));
}

}  // namespace
}  // namespace velatura::shading
