// SPDX-License-Identifier: Apache-2.0
// Thin walls: closed forms, energy, reciprocity, sampling of glass and paper without thickness.
#include "shading/sheet.h"

#include "../sampling/chi_square.h"
#include "bsdf_quadrature.h"
#include "shading/fresnel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace velatura::shading {
namespace {

using sampling::testing::TestRandom;
using testing::direction;

const Vec3 up(0, 0, 1);

SurfaceParameters pane(float alpha, bool is_rough) {
    SurfaceParameters p;
    p.diffuse = Rgb(0.0f);
    p.alpha = alpha;
    p.opacity = 0;
    p.is_thin = true;
    p.is_thin_rough = is_rough;
    return p;
}

SurfaceParameters paper(float reflected, float transmitted) {
    SurfaceParameters p;
    p.diffuse = Rgb(reflected);
    p.diffuse_transmitted = Rgb(transmitted);
    p.is_thin = true;
    return p;
}

double schlick(double mu) {
    return 0.04 + 0.96 * std::pow(1 - mu, 5);
}

/// Light that is followed through the sheet, reflection by reflection.
void follow(double R, double t, double& reflected, double& transmitted) {
    reflected = R;
    transmitted = 0;
    double inside = 1 - R;
    for (int i = 0; i < 20000 && inside > 1e-18; ++i) {
        inside *= t;
        (i % 2 == 0 ? transmitted : reflected) += inside * (1 - R);
        inside *= R;
    }
}

TEST(Sheet, SharesAreTheSumOfAllReflections) {
    for (const float R : {0.0f, 0.04f, 0.3f, 0.9f, 0.999f}) {
        for (const float t : {0.0f, 0.2f, 0.9f, 1.0f}) {
            double r = 0, passed = 0;
            follow(double(R), double(t), r, passed);
            const SheetShares s = sheet_shares(Rgb(R), Rgb(t));
            EXPECT_NEAR(double(s.reflected.x), r, 2e-6) << R << " " << t;
            EXPECT_NEAR(double(s.transmitted.x), passed, 2e-6) << R << " " << t;
        }
    }
    const SheetShares mirror = sheet_shares(Rgb(1.0f), Rgb(1.0f));
    EXPECT_EQ(mirror.reflected.x, 1.0f);
    EXPECT_EQ(mirror.transmitted.x, 0.0f);
}

struct Energy {
    double reflected = 0, passed = 0, mirror = 0, straight = 0;

    double total() const { return reflected + passed + mirror + straight; }
};

/// ∫ f·cos over both hemispheres in double: two lattices joined by the balance heuristic, one after
/// the lobe and its mirror image, one over the hemispheres; then the delta lobes.
Energy energy(const Bsdf& bsdf, const Vec3& wo, double alpha) {
    constexpr int count = 10946;  // of the Fibonacci numbers
    const double side = wo.z > 0 ? 1 : -1, width = std::max(alpha, 1e-3);
    const Vec3d o(double(wo.x), double(wo.y), double(wo.z) * side);
    Energy e;
    const auto add = [&](const Vec3d& wi) {
        if (wi.z <= 0) return;
        const double weight =
            1 / (testing::half_vector_pdf(o, wi, width) + 1 / (4 * pi_d * std::sqrt(wi.z))) / count;
        for (const double to : {1.0, -1.0}) {
            const Vec3 w(float(wi.x), float(wi.y), float(wi.z * side * to));
            (to > 0 ? e.reflected : e.passed) +=
                double(bsdf.f(wo, w).y) * double(bsdf.cosine(w)) * weight;
        }
    };
    for (int i = 0; i < count; ++i) {
        const Vec2d u(std::fmod(i * 0.61803398874989485, 1.0), (i + 0.5) / count);
        const double z = u.y * u.y, r = std::sqrt(1 - z * z), phi = 2 * pi_d * u.x;
        add(Vec3d(r * std::cos(phi), r * std::sin(phi), z));
        add(ggx_sample(o, width, u));
    }
    if (const auto d = bsdf.delta(ScatterKind::Reflect)) e.mirror = double(d->weight.y);
    if (const auto d = bsdf.delta(ScatterKind::Transmit)) e.straight = double(d->weight.y);
    return e;
}

TEST(ThinGlass, SmoothSheetIsTheClosedForm) {
    for (const float tint : {1.0f, 0.5f, 0.0f}) {
        for (const double mu : {1e-3, 0.1, 0.5, 1.0}) {
            for (const float side : {1.0f, -1.0f}) {
                SurfaceParameters p = pane(0, false);
                p.transmission_tint = Rgb(tint);
                const Vec3 wo = direction(mu, 0.3) * side;
                const Bsdf bsdf(p, up, up, wo);
                const double inside = std::sqrt(1 - (1 - mu * mu) / 2.25);
                double r = 0, t = 0;
                follow(schlick(mu), tint > 0 ? std::pow(double(tint), 1 / inside) : 0, r, t);
                const auto reflected = bsdf.delta(ScatterKind::Reflect);
                const auto passed = bsdf.delta(ScatterKind::Transmit);
                ASSERT_TRUE(reflected);
                EXPECT_NEAR(double(reflected->weight.y), r, 1e-5) << tint << " " << mu;
                if (t < 1e-9) {
                    EXPECT_FALSE(passed);
                    continue;
                }
                ASSERT_TRUE(passed);
                EXPECT_NEAR(double(passed->weight.y), t, 1e-5) << tint << " " << mu;
                EXPECT_EQ(passed->eta, 1.0f);
                EXPECT_NEAR(double((passed->wi + wo).length()), 0, 1e-6);
                EXPECT_FALSE(bsdf.has_non_delta());
            }
        }
    }
}

TEST(ThinGlass, KeepsTheEnergyFromBothSides) {
    double worst = 0;
    for (const bool is_rough : {false, true}) {
        for (const double alpha : {0.0, 0.002, 0.05, 0.3, 1.0}) {
            for (const float opacity : {0.0f, 0.4f}) {
                for (const double mu : {0.05, 0.3, 0.7, 1.0}) {
                    for (const float side : {1.0f, -1.0f}) {
                        SurfaceParameters p = pane(float(alpha), is_rough);
                        p.opacity = opacity;
                        p.diffuse = Rgb(0.3f);
                        p.diffuse_transmitted = Rgb(0.7f);
                        const Vec3 wo = direction(mu, 0.3) * side;
                        const Energy e = energy(Bsdf(p, up, up, wo), wo, alpha);
                        worst = std::max(worst, std::abs(e.total() - 1));
                        EXPECT_NEAR(e.total(), 1.0, 1.5e-3)
                            << is_rough << " " << alpha << " " << opacity << " " << mu;
                    }
                }
            }
        }
    }
    std::printf("worst |R + T - 1|: %.1e\n", worst);
}

TEST(ThinGlass, TintTakesAndNeverGives) {
    for (const double alpha : {0.05, 0.5, 1.0}) {
        for (const double mu : {0.05, 0.5, 1.0}) {
            double last = 2;
            for (const float tint : {1.0f, 0.7f, 0.3f, 0.0f}) {
                SurfaceParameters p = pane(float(alpha), true);
                p.transmission_tint = Rgb(tint);
                const Vec3 wo = direction(mu, 0.3);
                const Bsdf bsdf(p, up, up, wo);
                const Energy e = energy(bsdf, wo, alpha);
                EXPECT_LT(e.total(), last + 1e-3);
                last = e.total();
                if (tint == 0.0f) {
                    EXPECT_NEAR(e.passed, 0.0, 1e-6);
                }
            }
        }
    }
}

TEST(ThinGlass, BlurMirrorsTheReflection) {
    // Without absorption f through the sheet over f of the reflection is T'/R' of the microfacet
    const SurfaceParameters p = pane(0.02f, true);
    TestRandom random(4);
    for (int i = 0; i < 500; ++i) {
        const Vec3 wo =
            direction(0.3 + 0.7 * double(random.uniform()), 6 * double(random.uniform()));
        const Bsdf bsdf(p, up, up, wo);
        Vec3 wi(-wo.x, -wo.y, wo.z);
        wi = normalize(wi + Vec3(0.01f, -0.02f, 0.0f));
        const Vec3 wm = normalize(wo + wi);
        const double F = schlick(double(wo.dot(wm)));
        const double ratio = double(bsdf.f(wo, Vec3(wi.x, wi.y, -wi.z)).y / bsdf.f(wo, wi).y);
        EXPECT_NEAR(ratio / ((1 - F) / (2 * F)), 1.0, 2e-2);
    }
}

TEST(ThinPaper, SplitsAndKeepsTheEnergy) {
    for (const float share : {0.0f, 0.3f, 1.0f}) {
        for (const double mu : {0.05, 0.3, 1.0}) {
            for (const float side : {1.0f, -1.0f}) {
                SurfaceParameters p = paper(1 - share, share);
                const Vec3 wo = direction(mu, 0.3) * side;
                const Energy glossy = energy(Bsdf(p, up, up, wo), wo, double(p.alpha));
                EXPECT_NEAR(glossy.total(), 1.0, 1.5e-3);
                p.f0 = p.f90 = Rgb(0.0f);
                const Bsdf matt(p, up, up, wo);
                const Energy e = energy(matt, wo, 0.5);
                EXPECT_NEAR(e.reflected, 1 - double(share), 1e-4);
                EXPECT_NEAR(e.passed, double(share), 1e-4);
                EXPECT_EQ(matt.has_transmission(), share > 0.0f);
                EXPECT_NEAR(double(matt.albedo().y), 1.0, 1e-5);
                const Vec3 behind = direction(0.4, 2) * -side;
                EXPECT_NEAR(double(matt.f(wo, behind).y), double(share) / pi_d, 1e-6);
            }
        }
    }
}

TEST(ThinWalls, Reciprocity) {
    TestRandom random(11);
    double worst = 0;
    for (int i = 0; i < 10000; ++i) {
        SurfaceParameters p = pane(0.05f + random.uniform(), true);
        p.alpha = std::min(p.alpha, 1.0f);
        p.opacity = random.uniform();
        p.diffuse = Rgb(0.5f * random.uniform());
        p.diffuse_transmitted = Rgb(0.5f * random.uniform());
        p.transmission_tint = Rgb(random.uniform());
        p.clearcoat = i % 3 == 0 ? random.uniform() : 0.0f;
        p.clearcoat_alpha = 0.05f;
        const Vec3 a =
            direction(0.02 + 0.98 * double(random.uniform()), 7 * double(random.uniform()));
        const Vec3 b =
            direction(0.02 + 0.98 * double(random.uniform()), 7 * double(random.uniform())) *
            (i % 2 == 0 ? 1.0f : -1.0f);
        const double ab = double(Bsdf(p, up, up, a).f(a, b).y);
        const double ba = double(Bsdf(p, up, up, b).f(b, a).y);
        if (ab < 1e-9) continue;
        worst = std::max(worst, std::abs(ab / ba - 1));
    }
    std::printf("worst relative difference %.1e\n", worst);
    EXPECT_LT(worst, 2e-4);
}

// χ² over the whole sphere: cosine × azimuth; the last cell is the delta lobes and nothing
TEST(ThinWalls, SamplesFollowThePdf) {
    constexpr int rows = 16, columns = 8, sub = 60, count = 40000;
    std::vector<SurfaceParameters> cases = {pane(0.3f, true), pane(1.0f, true), paper(0.3f, 0.6f)};
    cases.push_back(pane(0.4f, true));
    cases.back().opacity = 0.5f;
    cases.back().diffuse = Rgb(0.5f);
    cases.back().diffuse_transmitted = Rgb(0.2f);
    cases.back().transmission_tint = Rgb(0.4f);
    cases.back().clearcoat = 1.0f;
    cases.back().clearcoat_alpha = 0.2f;
    for (const SurfaceParameters& p : cases) {
        for (const double mu : {1.0, 0.5, 0.15}) {
            const Vec3 wo = direction(mu, 0.4);
            const Bsdf bsdf(p, up, up, wo);
            std::vector<double> counts(rows * columns + 1, 0.0), expected(rows * columns + 1, 0.0);
            TestRandom random(static_cast<unsigned long long>(mu * 1e6) + 5);
            for (int i = 0; i < count; ++i) {
                const auto s =
                    bsdf.sample_f(wo, random.uniform(), Vec2(random.uniform(), random.uniform()));
                if (!s || s->is_delta) {
                    counts.back() += 1;
                    continue;
                }
                ASSERT_NEAR(double(s->pdf / bsdf.pdf(wo, s->wi)), 1.0, 2e-2);
                ASSERT_EQ(s->kind == ScatterKind::Transmit, s->wi.z < 0.0f);
                const int r = std::min(rows - 1, int((double(s->wi.z) + 1) / 2 * rows));
                const double turn = std::atan2(double(s->wi.y), double(s->wi.x)) / (2 * pi_d) + 0.5;
                counts[size_t(r * columns + std::min(columns - 1, int(turn * columns)))] += 1;
            }
            double inside = 0;
            for (int r = 0; r < rows * sub; ++r) {
                for (int c = 0; c < columns * sub; ++c) {
                    const double z = 2 * (r + 0.5) / (rows * sub) - 1;
                    const double phi = ((c + 0.5) / (columns * sub) - 0.5) * 2 * pi_d;
                    const Vec3 wi(float(std::sqrt(1 - z * z) * std::cos(phi)),
                                  float(std::sqrt(1 - z * z) * std::sin(phi)), float(z));
                    const double mass =
                        double(bsdf.pdf(wo, wi)) * 4 * pi_d / (rows * sub * columns * sub);
                    expected[size_t(r / sub * columns + c / sub)] += mass * count;
                    inside += mass;
                }
            }
            EXPECT_LE(inside, 1 + 1e-2);
            expected.back() = std::max(0.0, 1 - inside) * count;
            // Family-wise 1 % over 12 tests (Šidák), one-sided
            EXPECT_LT(sampling::testing::chi_square(counts, expected).z, 3.2)
                << p.alpha << " " << p.opacity << " " << mu;
        }
    }
}

TEST(ThinWalls, NothingIsEverNan) {
    TestRandom random(12);
    const AnisotropicAlbedo brushed({0.3f, 0.3f, 0.1f, 0.1f});
    const RoughInterface frosted(1.5f, {0.3f, 0.03f}, &brushed);
    const double mus[] = {0, 1e-8, 1e-4, 0.5, 1};
    const float grid[] = {0.0f, 1e-4f, 1e-3f, 0.3f, 1.0f};
    const auto any = [&] { return grid[random.bits() % 5]; };
    for (int i = 0; i < 20000; ++i) {
        SurfaceParameters p;
        p.alpha = any();
        if (i % 3 == 0) {
            p.alpha = 0.3f;
            p.alpha_y = 0.03f;
            p.anisotropic = &brushed;
            p.tangent = i % 2 == 0 ? up : Vec3(any(), any(), any());
        }
        p.clearcoat = any();
        p.clearcoat_alpha = any();
        p.opacity = any();
        p.diffuse = Rgb(any());
        p.diffuse_transmitted = Rgb(any());
        p.transmission_tint = Rgb(any());
        p.f0 = Rgb(any());
        p.f90 = Rgb(any());
        p.is_thin = i % 4 != 0;
        p.is_thin_rough = i % 8 < 4;
        const float iors[] = {1e-3f, 0.7f, 1.0f, 1.0000001f, 1.5f, 1e3f};
        p.ior = iors[random.bits() % 6];
        if (p.anisotropic && i % 5 == 0) {
            p.ior = 1.5f;
            p.interface = &frosted;
        }
        const auto anywhere = [&] {
            return direction(mus[random.bits() % 5], 6 * double(random.uniform())) *
                   (random.bits() % 2 == 0 ? 1.0f : -1.0f);
        };
        const Vec3 wo = anywhere();
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
        const BsdfValue v = bsdf.evaluate(wo, anywhere());
        ASSERT_TRUE(is_finite(v.f()) && std::isfinite(v.pdf)) << i;
        ASSERT_GE(v.f().x, 0.0f);
        ASSERT_TRUE(is_finite(bsdf.albedo()));
    }
}

TEST(Tint, MultipliesWhatCrossesABody) {
    for (const double mu : {0.3, 1.0}) {
        SurfaceParameters p;
        p.diffuse = Rgb(0.0f);
        p.alpha = 0;
        p.opacity = 0;
        const Vec3 wo = direction(mu);
        const auto clear = Bsdf(p, up, up, wo).delta(ScatterKind::Transmit);
        p.transmission_tint = Rgb(0.5f, 0.25f, 1.0f);
        const auto tinted = Bsdf(p, up, up, wo).delta(ScatterKind::Transmit);
        ASSERT_TRUE(clear && tinted);
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(double(tinted->weight[c]),
                        double(clear->weight[c] * p.transmission_tint[c]), 1e-6);
    }
}

}  // namespace
}  // namespace velatura::shading
