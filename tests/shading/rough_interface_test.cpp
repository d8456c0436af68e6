// SPDX-License-Identifier: Apache-2.0
// Rough transmission: energy on both sides, sampling, reciprocity with η², the limit of index 1
// (docs/engineering/hard_cases.md H20 … H22).
#include "../sampling/chi_square.h"
#include "bsdf_quadrature.h"
#include "hard_case.h"
#include "shading/fresnel.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

namespace velatura::shading {
namespace {

using rough_interface::Side;
using sampling::testing::chi_square;
using sampling::testing::TestRandom;
using testing::direction;

const Vec3 up(0, 0, 1);

SurfaceParameters frosted(const RoughInterface& interface, float alpha) {
    SurfaceParameters p;
    const float r = (1 - interface.ior()) / (1 + interface.ior());
    p.diffuse = Rgb(0.0f);
    p.f0 = Rgb(r * r);
    p.alpha = alpha;
    p.opacity = 0;
    p.ior = interface.ior();
    p.interface = &interface;
    return p;
}

/// All GGX widths of one index, made once for all tests.
const RoughInterface& interface_of(float ior) {
    static std::map<float, RoughInterface> made;
    return made.try_emplace(ior, ior, 1e-3f, 1.0f).first->second;
}

struct Shares {
    double reflected = 0, transmitted = 0;  // power

    double total() const { return reflected + transmitted; }
};

/// ∫ f·cos in double, transmission as power. Two lattices are joined by the balance heuristic over
/// the reflections: one follows the visible normals, the other covers the hemisphere, dense towards
/// grazing angles.
Shares quadrature_energy(const Bsdf& bsdf, const SurfaceParameters& p, const Vec3& wo) {
    constexpr int count = 6765;  // of the Fibonacci numbers
    const double side = wo.z > 0 ? 1 : -1, alpha = std::max(double(p.alpha), 1e-3);
    const double eta = side > 0 ? double(p.ior) : 1 / double(p.ior);
    const Vec3d o(double(wo.x), double(wo.y), double(wo.z) * side);
    static const std::vector<Vec2d> turns = [] {
        std::vector<Vec2d> all;
        for (int i = 0; i < count; ++i) {
            const double phi = 2 * pi_d * std::fmod(i * 0.61803398874989485, 1.0);
            all.emplace_back(std::cos(phi), std::sin(phi));
        }
        return all;
    }();
    Shares s;
    const auto f = [&](const Vec3d& wi) {
        const Vec3 w(float(wi.x), float(wi.y), float(wi.z * side));
        return double(bsdf.f(wo, w).y) * double(bsdf.cosine(w)) / count;
    };
    const auto add_reflected = [&](const Vec3d& wi) {
        if (wi.z <= 0) return;
        Vec3d m = o + wi;
        m /= std::sqrt(m.dot(m));
        const double cos_m = o.dot(m);
        s.reflected += f(wi) / (ggx_normal_pdf(o, m, cos_m, alpha) / (4 * cos_m) +
                                1 / (4 * pi_d * std::sqrt(wi.z)));
    };
    for (int i = 0; i < count; ++i) {
        const Vec2d& turn = turns[size_t(i)];
        const double height = (i + 0.5) / count, z = height * height, r = std::sqrt(1 - z * z);
        add_reflected(Vec3d(r * turn.x, r * turn.y, z));
        const Vec3d m = ggx_sample_normal(o, alpha, turn, height);
        const double cos_o = o.dot(m);
        if (cos_o <= 0) continue;
        add_reflected(m * (2 * cos_o) - o);
        const double cos2_t = 1 - (1 - cos_o * cos_o) / (eta * eta);
        if (cos2_t <= 0) continue;
        const double cos_t = std::sqrt(cos2_t), across = cos_o - eta * cos_t;
        const Vec3d refracted = m * (cos_o / eta - cos_t) - o / eta;
        if (refracted.z >= 0) continue;
        s.transmitted +=
            f(refracted) * across * across / (ggx_normal_pdf(o, m, cos_o, alpha) * cos_t);
    }
    // The delta lobes
    float last = -1;
    for (int i = 0; i < 1000; ++i) {
        const auto d = bsdf.sample_f(wo, (float(i) + 0.5f) / 1000, Vec2(0.4f, 0.6f));
        if (!d || !d->is_delta || d->pdf == last) continue;
        last = d->pdf;
        const double power = double(d->f.y) * double(bsdf.cosine(d->wi));
        const double squared = double(d->eta) * double(d->eta);
        (d->kind == ScatterKind::Transmit ? s.transmitted : s.reflected) += power * squared;
    }
    return s;
}

// Rough glass: R + T = 1
TEST(H20Energy, RoughGlassReflectsAndTransmitsOneFromBothSides) {
    double worst = 0;
    for (const float ior : {1.05f, 1.2f, 1.5f, 2.0f, 2.5f, 1 / 1.5f}) {
        const RoughInterface& interface = interface_of(ior);
        for (const float alpha : {0.0f, 1e-3f, 0.01f, 0.05f, 0.2f, 0.5f, 1.0f}) {
            const SurfaceParameters p = frosted(interface, alpha);
            for (const double mu : {0.05, 0.2, 0.5, 0.76, 0.9, 1.0}) {
                for (const float side : {1.0f, -1.0f}) {
                    const Vec3 wo = direction(mu) * side;
                    const Bsdf bsdf(p, up, up, wo);
                    const Shares s = quadrature_energy(bsdf, p, wo);
                    worst = hardcase::larger(worst, std::abs(s.total() - 1));
                    // What the Bsdf says of itself
                    EXPECT_NEAR(double(bsdf.albedo().y), 1.0, 1e-5);
                }
            }
        }
    }
    hardcase::expect_within(
        {"rough glass of index 1/1.5 to 2.5: R + T - 1", worst, 2e-3, 0, "quadrature in double"});
}

TEST(RoughInterface, PartOpaqueWhiteKeepsOneFromBothSides) {
    const RoughInterface& interface = interface_of(1.5f);
    for (const float alpha : {0.05f, 0.3f, 1.0f}) {
        for (const double mu : {0.2, 0.6, 1.0}) {
            for (const float side : {1.0f, -1.0f}) {
                SurfaceParameters p = frosted(interface, alpha);
                p.diffuse = Rgb(1.0f);
                p.opacity = 0.6f;
                const Vec3 wo = direction(mu) * side;
                EXPECT_NEAR(quadrature_energy(Bsdf(p, up, up, wo), p, wo).total(), 1.0, 4e-3)
                    << "alpha " << alpha << " mu " << mu << " side " << side;
            }
        }
    }
}

// Light through the surface is what detailed balance asks for: ∫T_in = ∫T_out / η²
TEST(RoughInterface, MeanTransmissionScalesWithEtaSquared) {
    for (const float ior : {1.2f, 1.5f, 2.5f}) {
        const RoughInterface& interface = interface_of(ior);
        for (const float alpha : {0.01f, 0.1f, 0.5f, 1.0f}) {
            const double outside = double(interface.curve(alpha, Side::Light).average().passed);
            const double inside = double(interface.curve(alpha, Side::Dense).average().passed);
            EXPECT_NEAR(inside * double(ior) * double(ior), outside, 4e-3) << ior << " " << alpha;
        }
    }
}

TEST(RoughInterface, TablesAgreeWithQuadrature) {
    TestRandom random(5);
    double worst[2] = {};
    for (const float ior : {1.05f, 1.5f, 2.5f}) {
        const RoughInterface& interface = interface_of(ior);
        for (int i = 0; i < 60; ++i) {
            const float root = 0.0317f + 0.9683f * random.uniform(), alpha = root * root;
            const float critical = std::sqrt(1 - 1 / (ior * ior));
            const float spread = i % 2 == 0 ? 1.0f : alpha;
            const float mu = std::clamp(critical + spread * (random.uniform() - 0.5f), 0.01f, 1.0f);
            for (const Side side : {Side::Light, Side::Dense}) {
                const auto exact = rough_interface::exact_shares(double(mu), double(alpha),
                                                                 double(ior), side, 28657);
                const auto table = interface.curve(alpha, side).at(mu);
                worst[0] =
                    hardcase::larger(worst[0], std::abs(exact.passed - double(table.passed)));
                worst[1] =
                    hardcase::larger(worst[1], std::abs(exact.excess - double(table.excess)));
            }
        }
    }
    std::printf("worst table error: passed %.1e, excess %.1e\n", worst[0], worst[1]);
    EXPECT_LT(worst[0], 7e-3);
    EXPECT_LT(worst[1], 1.5e-3);
}

/// ∫ pdf and ∫ f·cos over the sphere of directions, by a plain grid that knows nothing of
/// microfacets.
void integrate(const Bsdf& bsdf, const Vec3& wo, double& pdf, double& power) {
    constexpr int rows = 1000, columns = 600;
    pdf = power = 0;
    for (int i = 0; i < rows; ++i) {
        for (int j = 0; j < columns; ++j) {
            const double theta = pi_d * (i + 0.5) / rows, z = std::cos(theta), r = std::sin(theta);
            const double phi = pi_d * (j + 0.5) / columns;  // wo lies in the plane of symmetry
            const double area = r * 2 * pi_d * pi_d / (rows * columns);
            const Vec3 wi(float(r * std::cos(phi)), float(r * std::sin(phi)), float(z));
            const BsdfValue v = bsdf.evaluate(wo, wi);
            const bool crosses = wo.z * wi.z < 0;
            const double eta = wo.z > 0 ? 1.5 : 1 / 1.5;
            pdf += double(v.pdf) * area;
            power += double(v.f().y) * std::abs(z) * area * (crosses ? eta * eta : 1.0);
        }
    }
}

TEST(RoughInterface, DensityAndPowerIntegrateToOneOverPlainDirections) {
    const RoughInterface& interface = interface_of(1.5f);
    for (const float alpha : {0.2f, 0.5f, 1.0f}) {
        for (const double mu : {0.3, 0.75, 1.0}) {
            for (const float side : {1.0f, -1.0f}) {
                const Vec3 wo = direction(mu) * side;
                const Bsdf bsdf(frosted(interface, alpha), up, up, wo);
                double pdf = 0, power = 0;
                integrate(bsdf, wo, pdf, power);
                EXPECT_NEAR(power, 1.0, 3e-3) << alpha << " " << mu << " " << side;
                // The rest of the density are microfacets that send light back into the surface
                int lost = 0;
                TestRandom random(3);
                constexpr int n = 200000;
                for (int i = 0; i < n; ++i) {
                    const Vec2 u(random.uniform(), random.uniform());
                    lost += bsdf.sample_f(wo, random.uniform(), u) ? 0 : 1;
                }
                EXPECT_NEAR(pdf, 1.0 - double(lost) / n, 3e-3) << alpha << " " << mu << " " << side;
            }
        }
    }
}

/// χ² over cells of the microfacet normal, reflection and refraction apart.
double chi_square_z(const SurfaceParameters& p,
                    const Vec3& wo,
                    int count,
                    unsigned long long seed) {
    constexpr int rows = 6, columns = 8, sub = 24, cells = rows * columns;
    const Bsdf bsdf(p, up, up, wo);
    const double side = wo.z > 0 ? 1 : -1, alpha = double(p.alpha);
    const double eta = side > 0 ? double(p.ior) : 1 / double(p.ior);
    const Vec3d o(double(wo.x), double(wo.y), std::abs(double(wo.z)));
    std::vector<double> counts(2 * cells + 1, 0.0), expected(2 * cells + 1, 0.0);
    TestRandom random(seed);
    for (int i = 0; i < count; ++i) {
        const auto s =
            bsdf.sample_f(wo, random.uniform(), Vec2(random.uniform(), random.uniform()));
        if (!s) {
            counts.back() += 1;
            continue;
        }
        const Vec3d wi(double(s->wi.x), double(s->wi.y), double(s->wi.z) * side);
        Vec3d m =
            s->kind == ScatterKind::Transmit ? (o + wi * eta) * (eta > 1 ? -1.0 : 1.0) : o + wi;
        m /= std::sqrt(m.dot(m));
        const double slope = std::hypot(m.x, m.y) / m.z / alpha;
        const int r = std::min(rows - 1, int(rows / std::sqrt(1 + slope * slope)));
        const int c =
            std::min(columns - 1, int((std::atan2(m.y, m.x) / (2 * pi_d) + 0.5) * columns));
        counts[size_t((s->kind == ScatterKind::Transmit ? cells : 0) + r * columns + c)] += 1;
    }
    double inside = 0;
    for (int r = 0; r < rows * sub; ++r) {
        for (int c = 0; c < columns * sub; ++c) {
            const double y = (r + 0.5) / (rows * sub);
            const double phi = ((c + 0.5) / (columns * sub) - 0.5) * 2 * pi_d;
            const double slope = alpha * std::sqrt(1 - y * y) / y;
            const double z = 1 / std::sqrt(1 + slope * slope);
            const Vec3d m(slope * z * std::cos(phi), slope * z * std::sin(phi), z);
            const double cos_o = o.dot(m);
            if (cos_o <= 0) continue;
            const double normals = 2 * y / (ggx_d(m, alpha) * z) / (rows * sub * columns * sub);
            const auto add = [&](const Vec3d& wi, double stretch, int offset) {
                const Vec3 w(float(wi.x), float(wi.y), float(wi.z * side));
                const double mass = double(bsdf.pdf(wo, w)) * stretch * normals;
                expected[size_t(offset + r / sub * columns + c / sub)] += mass * count;
                inside += mass;
            };
            const Vec3d mirrored = m * (2 * cos_o) - o;
            if (mirrored.z > 0) add(mirrored, 4 * cos_o, 0);
            const double cos2_t = 1 - (1 - cos_o * cos_o) / (eta * eta);
            if (cos2_t <= 0) continue;
            const double cos_t = std::sqrt(cos2_t), across = cos_o - eta * cos_t;
            const Vec3d refracted = m * (cos_o / eta - cos_t) - o / eta;
            if (refracted.z < 0) add(refracted, across * across / (eta * eta * cos_t), cells);
        }
    }
    expected.back() = std::max(0.0, 1 - inside) * count;
    EXPECT_LE(inside, 1 + 1e-2);
    return chi_square(counts, expected).z;
}

TEST(RoughInterface, SamplesFollowThePdf) {
    constexpr int count = 40000;
    double worst = -10;
    int tests = 0;
    for (const float ior : {1.05f, 1.5f, 2.5f}) {
        const RoughInterface& interface = interface_of(ior);
        for (const float alpha : {0.03f, 0.2f, 0.5f, 1.0f}) {
            for (const double mu : {1.0, 0.5, 0.1, 1e-2, 1e-3}) {
                for (const float side : {1.0f, -1.0f}) {
                    SurfaceParameters p = frosted(interface, alpha);
                    // Part opaque moves the choice between the two; the narrow normals stay
                    // without the wide compensation lobe only where it is small
                    const double z = chi_square_z(p, direction(mu) * side, count,
                                                  static_cast<unsigned long long>(++tests));
                    worst = hardcase::larger(worst, z);
                }
            }
        }
    }
    // Šidák over 120 tests at 1 %: one-sided normal deviate of 1 − 0.99^(1/120)
    std::printf("%d tests, worst z %.2f; smallest detectable error of a cell: %.0f %%\n", tests,
                worst, 100 * sampling::testing::smallest_detectable(count, 96));
    EXPECT_LT(worst, 3.8);
}

// f(wo, wi)·η_o² = f(wi, wo)·η_i² across the interface
TEST(H21Reciprocity, OfRoughInterfaces) {
    TestRandom random(11);
    double worst = 0;
    int pairs = 0;
    const RoughInterface &glass = interface_of(1.5f), &diamond = interface_of(2.5f);
    for (int i = 0; i < 200000; ++i) {
        const RoughInterface& interface = i % 2 == 0 ? glass : diamond;
        const float root = 0.2f + 0.8f * random.uniform();
        SurfaceParameters p = frosted(interface, root * root);
        p.opacity = i % 3 == 0 ? 0.5f : 0.0f;
        p.diffuse = Rgb(random.uniform());
        const auto any = [&] {
            return direction(0.02 + 0.98 * double(random.uniform()), 7 * double(random.uniform())) *
                   (random.uniform() < 0.5f ? 1.0f : -1.0f);
        };
        const Vec3 a = any(), b = any();
        const double ab = double(Bsdf(p, up, up, a).f(a, b).y);
        const double ba = double(Bsdf(p, up, up, b).f(b, a).y);
        const double n = double(interface.ior());
        const double a2 = a.z > 0 ? 1 : n * n, b2 = b.z > 0 ? 1 : n * n;
        ASSERT_EQ(ab > 0, ba > 0) << i;
        if (!(ab > 0)) continue;
        ++pairs;
        // f(wo, wi) / η_i² on both ways; far out in the tail only the absolute size counts
        const double x = ab / a2, y = ba / b2;
        worst = hardcase::larger(worst, std::abs(x - y) / (std::max(x, y) + 1e-4));
    }
    EXPECT_GT(pairs, 50000);
    hardcase::expect_within(
        {fmt::format("rough glass: f there and back of {} pairs, relative", pairs), worst, 1e-4, 0,
         "the other way"});
}

// No interface is left as the index tends to 1
TEST(H22Fresnel, RoughInterfacesPassStraightAsTheIndexTendsToOne) {
    for (const float alpha : {0.1f, 1.0f}) {
        for (const double mu : {0.3, 0.8}) {
            const Vec3 wo = direction(mu);
            double last_turn = 10, error = 0;
            for (int k = 2; k <= 20; k += 3) {
                const float ior = 1 + std::ldexp(1.0f, -k);
                const RoughInterface interface(ior, alpha, alpha);
                const Bsdf bsdf(frosted(interface, alpha), up, up, wo);
                double turn = 0, squares = 0, passed = 0;
                TestRandom random(1);
                for (int i = 0; i < 4000; ++i) {
                    const auto s = bsdf.sample_f(wo, random.uniform(),
                                                 Vec2(random.uniform(), random.uniform()));
                    if (!s) continue;
                    ASSERT_TRUE(is_finite(s->f) && is_finite(s->wi) && std::isfinite(s->pdf));
                    if (s->kind != ScatterKind::Transmit) continue;
                    const double power =
                        double(s->f.y * bsdf.cosine(s->wi) / s->pdf * s->eta * s->eta);
                    passed += power / 4000;
                    const double turned = power * double((s->wi + wo).length());
                    turn += turned / 4000;
                    squares += turned * turned / 4000;
                }
                EXPECT_GT(passed, 0.8);
                EXPECT_LT(turn, last_turn + 1e-3);
                last_turn = turn;
                error = std::sqrt(squares / 4000);
            }
            hardcase::expect_within(
                {fmt::format("index 1 + 2^-20, alpha {}: mean turn of a ray that passes", alpha),
                 last_turn, 1e-5, 5.2816 * error, "no interface"});
        }
    }
}

// Without a table for the material transmission stays sharp, as the specification has it
TEST(RoughInterface, IsOnlyUsedWhenGiven) {
    const RoughInterface interface(1.5f, 0.25f, 0.25f);
    SurfaceParameters p = frosted(interface, 0.25f);
    const Vec3 wo = direction(0.8), below = direction(0.9) * -1.0f;
    EXPECT_GT(Bsdf(p, up, up, wo).f(wo, below).y, 0.0f);
    EXPECT_GT(Bsdf(p, up, up, wo).pdf(wo, below), 0.0f);
    p.interface = nullptr;
    EXPECT_EQ(Bsdf(p, up, up, wo).f(wo, below).y, 0.0f);
    // Roughness 0 and opaque are what they are without
    p.interface = &interface;
    p.alpha = 0;
    EXPECT_FALSE(Bsdf(p, up, up, wo).has_non_delta());
    p.alpha = 0.25f;
    p.opacity = 1;
    EXPECT_EQ(Bsdf(p, up, up, wo).f(wo, below).y, 0.0f);
}

}  // namespace
}  // namespace velatura::shading
