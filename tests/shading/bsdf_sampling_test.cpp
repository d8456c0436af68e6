// SPDX-License-Identifier: Apache-2.0
// sample_f against pdf, and both against f.
#include "../sampling/chi_square.h"
#include "bsdf_quadrature.h"
#include "sampling/sampler.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

namespace velatura::shading {
namespace {

using sampling::testing::chi_square;
using sampling::testing::TestRandom;
using testing::direction;

const Vec3 up(0, 0, 1);

struct Case {
    const char* name;
    SurfaceParameters p;
    double alpha;  // of the cells: that of the narrowest smooth lobe
};

std::vector<Case> cases() {
    std::vector<Case> list;
    for (const double alpha : {0.01, 0.1, 0.5, 1.0}) {
        Case c{"metal", {}, alpha};
        c.p.diffuse = Rgb(0.0f);
        c.p.f0 = c.p.f90 = Rgb(1.0f, 0.8f, 0.3f);
        c.p.alpha = float(alpha);
        list.push_back(c);
    }
    Case plastic{"plastic", {}, 0.1};
    plastic.p.diffuse = Rgb(0.5f, 0.2f, 0.1f);
    plastic.p.alpha = 0.1f;
    list.push_back(plastic);
    Case shiny{"shiny plastic", {}, 0.01};
    shiny.p.diffuse = Rgb(1.0f);
    shiny.p.alpha = 0.01f;
    list.push_back(shiny);
    Case coated = plastic;
    coated.name = "coated";
    coated.p.clearcoat = 0.7f;
    coated.p.clearcoat_alpha = 0.04f;
    coated.alpha = 0.04;
    list.push_back(coated);
    Case glass = plastic;
    glass.name = "half opaque";
    glass.p.opacity = 0.5f;
    list.push_back(glass);
    Case mirror = coated;
    mirror.name = "mirror coat";
    mirror.p.clearcoat_alpha = 1e-4f;
    mirror.alpha = 0.1;
    list.push_back(mirror);
    return list;
}

/// Cells: slope of the half vector in units of alpha × azimuth, as in ggx_test.cpp; the last cell
/// holds everything that is not a smooth reflection.
void expect_samples_match_pdf(const Case& k, double mu, float side) {
    constexpr int rows = 8, columns = 10, count = 20000;
    // A wide lobe beside a narrow one crowds into the last row of cells: more nodes
    const int sub = k.alpha < 0.03 && !is_black(k.p.diffuse) ? 120 : 24;
    const Vec3 wo = direction(mu) * side;
    const Bsdf bsdf(k.p, up, up, wo);
    const Frame frame = Frame::from_z(bsdf.ns());
    const Vec3d o = Vec3d(frame.to_local(wo));
    TestRandom random(static_cast<unsigned long long>(mu * 1e6) + 99);
    std::vector<double> counts(rows * columns + 1, 0.0), expected(rows * columns + 1, 0.0);
    for (int i = 0; i < count; ++i) {
        const auto s =
            bsdf.sample_f(wo, random.uniform(), Vec2(random.uniform(), random.uniform()));
        if (!s || s->is_delta) {
            counts.back() += 1;
            continue;
        }
        ASSERT_NEAR(double(s->wi.length()), 1.0, 1e-5);
        ASSERT_NEAR(double(s->pdf / bsdf.pdf(wo, s->wi)), 1.0, 2e-2);
        Vec3d m = o + Vec3d(frame.to_local(s->wi));
        m /= std::sqrt(m.dot(m));
        const double slope = std::hypot(m.x, m.y) / m.z / k.alpha;
        const int r = std::min(rows - 1, int(rows / std::sqrt(1 + slope * slope)));
        const int c =
            std::min(columns - 1, int((std::atan2(m.y, m.x) / (2 * pi_d) + 0.5) * columns));
        counts[size_t(r * columns + c)] += 1;
    }
    double inside = 0;
    for (int r = 0; r < rows * sub; ++r) {
        for (int c = 0; c < columns * sub; ++c) {
            const double y = (r + 0.5) / (rows * sub);
            const double phi = ((c + 0.5) / (columns * sub) - 0.5) * 2 * pi_d;
            const double slope = k.alpha * std::sqrt(1 - y * y) / y;
            const double z = 1 / std::sqrt(1 + slope * slope);
            const Vec3d m(slope * z * std::cos(phi), slope * z * std::sin(phi), z);
            const double cos_m = o.dot(m);
            const Vec3d wi = m * (2 * cos_m) - o;
            if (cos_m <= 0 || wi.z <= 0) continue;
            const double pdf = double(bsdf.pdf(wo, frame.from_local(Vec3(wi))));
            const double mass =
                pdf * 2 * y * 4 * cos_m / (ggx_d(m, k.alpha) * m.z) / (rows * sub * columns * sub);
            expected[size_t(r / sub * columns + c / sub)] += mass * count;
            inside += mass;
        }
    }
    EXPECT_LE(inside, 1 + 1e-2);
    expected.back() = std::max(0.0, 1 - inside) * count;
    EXPECT_LT(chi_square(counts, expected).z, 4.5)
        << k.name << " alpha " << k.alpha << " mu " << mu;
}

TEST(BsdfSampling, SamplesFollowThePdf) {
    for (const Case& k : cases()) {
        for (const double mu : {1.0, 0.5, 0.1, 0.01}) expect_samples_match_pdf(k, mu, 1);
        expect_samples_match_pdf(k, 0.8, -1);
        expect_samples_match_pdf(k, 0.3, -1);
    }
    std::printf("smallest detectable error of a cell: %.0f %%\n",
                100 * sampling::testing::smallest_detectable(20000, 80));
}

// The estimator f·cos/pdf over all lobes has the mean that quadrature finds
TEST(BsdfSampling, EstimatorAgreesWithQuadrature) {
    for (const Case& k : cases()) {
        for (const double mu : {0.9, 0.2}) {
            const Vec3 wo = direction(mu);
            const Bsdf bsdf(k.p, up, up, wo);
            double sum = 0, sum2 = 0;
            constexpr int n = 40000;
            for (int i = 0; i < n; ++i) {
                TestRandom random(static_cast<unsigned long long>(i) * 7919);
                const auto s =
                    bsdf.sample_f(wo, random.uniform(), Vec2(random.uniform(), random.uniform()));
                double x = s ? double(s->f.y) * double(bsdf.cosine(s->wi)) / double(s->pdf) : 0;
                if (s && s->kind == ScatterKind::Transmit) x *= double(s->eta * s->eta);
                sum += x / n;
                sum2 += x * x / n;
            }
            const double sigma = std::sqrt(std::max(sum2 - sum * sum, 0.0) / n);
            const auto e = testing::energy(bsdf, wo, k.alpha);
            EXPECT_NEAR(sum, e.total(), 4.5 * sigma + 2e-3) << k.name << " " << mu;
        }
    }
}

TEST(BsdfSampling, NothingIsEverNan) {
    TestRandom random(12);
    const double mus[] = {0, 1e-8, 1e-4, 0.5, 1};
    for (int i = 0; i < 20000; ++i) {
        SurfaceParameters p;
        const float grid[] = {0.0f, 1e-4f, 1e-3f, 0.3f, 1.0f};
        p.alpha = grid[random.bits() % 5];
        p.clearcoat = grid[random.bits() % 5];
        p.clearcoat_alpha = grid[random.bits() % 5];
        p.opacity = grid[random.bits() % 5];
        p.diffuse = Rgb(grid[random.bits() % 5]);
        p.f0 = Rgb(grid[random.bits() % 5]);
        p.f90 = Rgb(grid[random.bits() % 5]);
        const float iors[] = {1e-3f, 0.7f, 1.0f, 1.0000001f, 1.5f, 1e3f};
        p.ior = iors[random.bits() % 6];
        const Vec3 wo = direction(mus[random.bits() % 5], 6 * double(random.uniform())) *
                        (random.bits() % 2 == 0 ? 1.0f : -1.0f);
        const Vec3 ns = direction(double(random.uniform()), 6 * double(random.uniform()));
        const Bsdf bsdf(p, up, ns, wo);
        const float edges[] = {0.0f, 0.5f, 0x1.fffffep-1f};
        const auto s = bsdf.sample_f(wo, random.uniform(),
                                     Vec2(edges[random.bits() % 3], edges[random.bits() % 3]));
        if (s) {
            ASSERT_TRUE(is_finite(s->f) && is_finite(s->wi) && std::isfinite(s->pdf)) << i;
            ASSERT_GT(s->pdf, 0.0f);
            ASSERT_GE(s->f.x, 0.0f);
        }
        const Vec3 wi = direction(mus[random.bits() % 5], 6 * double(random.uniform())) *
                        (random.bits() % 2 == 0 ? 1.0f : -1.0f);
        const BsdfValue v = bsdf.evaluate(wo, wi);
        ASSERT_TRUE(is_finite(v.f()) && std::isfinite(v.pdf)) << i;
        ASSERT_GE(v.f().x, 0.0f);
        ASSERT_TRUE(is_finite(bsdf.albedo()));
    }
}

TEST(BsdfSampling, BelowTheSwitchIsDelta) {
    SurfaceParameters p;
    p.diffuse = Rgb(0.0f);
    p.f0 = p.f90 = Rgb(1.0f);
    const Vec3 wo = direction(0.6);
    p.alpha = 0.9e-3f;
    const Bsdf mirror(p, up, up, wo);
    EXPECT_FALSE(mirror.has_non_delta());
    const auto s = mirror.sample_f(wo, 0.5f, Vec2(0.5f, 0.5f));
    ASSERT_TRUE(s && s->is_delta);
    EXPECT_EQ(s->pdf, 1.0f);
    EXPECT_NEAR(double((s->wi - Vec3(-wo.x, 0, wo.z)).length()), 0.0, 1e-6);
    EXPECT_EQ(mirror.f(wo, s->wi).x, 0.0f);
    EXPECT_EQ(mirror.pdf(wo, s->wi), 0.0f);
    p.alpha = 1.1e-3f;
    const Bsdf rough(p, up, up, wo);
    EXPECT_TRUE(rough.has_non_delta());
    EXPECT_FALSE(rough.sample_f(wo, 0.5f, Vec2(0.5f, 0.5f))->is_delta);
}

TEST(BsdfSampling, ARaisedMirrorKeepsEveryMeanAndTheDensitiesFollow) {
    SurfaceParameters p;
    p.diffuse = Rgb(0.5f, 0.3f, 0.2f);
    p.alpha = 0.0f;
    const Vec3 wo = direction(0.6), wi = direction(0.8, 2.0);
    const Bsdf plain(p, up, up, wo);
    Bsdf raised(p, up, up, wo);
    const float before = plain.mirror_probability();
    ASSERT_GT(before, 0.01f);
    ASSERT_LT(before, 0.5f);
    raised.raise_mirror(0.5f);
    EXPECT_NEAR(raised.mirror_probability(), 0.5f, 1e-6f);
    // What is scattered stays, as seldom as it is sampled
    EXPECT_EQ(raised.f(wo, wi), plain.f(wo, wi));
    EXPECT_NEAR(raised.pdf(wo, wi), plain.pdf(wo, wi) * 0.5f / (1.0f - before), 1e-6f);
    double mirrored = 0;
    constexpr int count = 1000;
    for (int k = 0; k < count; ++k) {
        const auto s = raised.sample_f(wo, (float(k) + 0.5f) / count, Vec2(0.3f, 0.6f));
        ASSERT_TRUE(s.has_value());
        if (s->is_delta) {
            mirrored += double(s->f.y * raised.cosine(s->wi) / s->pdf) / count;
        } else {
            EXPECT_EQ(s->f, plain.f(wo, s->wi));
            EXPECT_NEAR(s->pdf, plain.pdf(wo, s->wi) * 0.5f / (1.0f - before), 1e-6f);
        }
    }
    const double weight = double(plain.delta(ScatterKind::Reflect)->weight.y);
    EXPECT_NEAR(mirrored, weight, 2.0 / count * weight / 0.5);
    // Nothing to raise
    p.alpha = 0.3f;
    Bsdf rough(p, up, up, wo);
    EXPECT_EQ(rough.mirror_probability(), 0.0f);
    rough.raise_mirror(0.5f);
    EXPECT_EQ(rough.pdf(wo, wi), Bsdf(p, up, up, wo).pdf(wo, wi));
}

}  // namespace
}  // namespace velatura::shading
