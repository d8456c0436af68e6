// SPDX-License-Identifier: Apache-2.0
#include "geometry/round_curves.h"

#include "curve_fixtures.h"
#include "geometry/quadric.h"

#include <gtest/gtest.h>

namespace velatura::geometry::test {
namespace {

using Interpolation = scene::Interpolation;

TEST(RoundCurves, AreMetWhereTheFirstOfTheirBallsIs) {
    Random random(1);
    size_t hits = 0, misses = 0, grazing = 0;
    double worst = 0;
    for (int kind = 0; kind < 48; ++kind) {
        const double thickness = std::pow(10.0, -random.between(0.3, 3.0));
        const scene::Curves curves = some_curve(random, kind, thickness);
        const auto set = RoundCurves::make(curves);
        ASSERT_TRUE(set);
        const Balls balls(curves, 1500);
        for (int i = 0; i < 40; ++i) {
            // Aimed at the outline and into it, from all around and end on
            const auto& [center, r] =
                balls.balls[size_t(random.between(0, double(balls.balls.size())))];
            Vec3d aim(center);
            aim += random.direction() * (random.between(0, 1.1) * double(r));
            const Vec3d o = i % 5 == 0
                                ? Vec3d(curves.points[0]) + random.in_cube(4 * thickness) +
                                      normalize(Vec3d(curves.points[0] - curves.points[1])) * 3.0
                                : random.direction() * 6.0;
            const Vec3d d = normalize(aim - o);
            if (balls.outside(VecL(o)) <= 0) continue;
            const auto expected = balls.first_entry(VecL(o), VecL(d));
            const auto hit = first_hit(*set, o, d);
            if (!hit) {
                EXPECT_FALSE(expected) << kind << ' ' << i << " r " << thickness;
                ++misses;
                continue;
            }
            const Real error = expected ? *expected - Real(hit->hit.t) : 1;
            if (error < 1e-9) {
                EXPECT_GT(double(error), -1e-9) << kind << ' ' << i;
                worst = std::max(worst, std::abs(double(error)));
                ++hits;
                continue;
            }
            // Between samples the outline reaches a little further
            const Vec3d p = o + d * hit->hit.t;
            EXPECT_LT(double(std::abs(balls.outside(VecL(p)))), 1e-9) << kind << ' ' << i;
            ++grazing;
        }
    }
    RecordProperty("worst", std::to_string(worst));
    RecordProperty("grazing", std::to_string(grazing));
    EXPECT_GT(hits, 1200u);
    EXPECT_GT(misses, 15u);
    EXPECT_LT(grazing, 60u);
}

TEST(RoundCurves, OfOneWidthThatAreStraightAreCapsules) {
    Random random(2);
    size_t hits = 0;
    double worst = 0;
    for (int i = 0; i < 300; ++i) {
        const auto half = float(random.between(0.05, 2.5));
        scene::Curves curves = bezier({Vec3(0, 0, -half), Vec3(0, 0, half)},
                                      {float(std::pow(10.0, -random.between(-0.3, 3.7)))});
        curves.basis = scene::Curves::Basis::Linear;
        const double length = 2 * double(curves.points[1].z),
                     radius = 0.5 * double(curves.widths[0]);
        scene::Gprim capsule;
        capsule.kind = scene::Gprim::Kind::Capsule;
        capsule.radius = radius;
        capsule.height = length;
        const auto exact = Quadric::make(capsule);
        const auto set = RoundCurves::make(curves);
        ASSERT_TRUE(set);
        for (int k = 0; k < 100; ++k) {
            const Vec3d o = random.direction() * (k % 3 ? 10.0 : 1e4);
            Vec3d aim(0, 0, random.between(-0.5, 0.5) * (length + 2 * radius));
            aim += random.in_cube(1.2 * radius);
            const Vec3d d = (aim - o) * 0.37;
            const auto expected = exact->intersect(0, o, d, far_away);
            const auto hit = first_hit(*set, o, d);
            const double cosine =
                expected
                    ? std::abs(normalize(d).dot(normalize(exact->surface(0, o, d, *expected).n)))
                    : 0;
            if (expected.has_value() != hit.has_value()) {
                EXPECT_LT(cosine, 1e-3);
                continue;
            }
            if (!hit) continue;
            ++hits;
            const double fuzz = 0x1p-50 * o.length() / std::max(cosine, 1e-3);
            const double error = std::abs(hit->hit.t - expected->t) * d.length();
            worst = std::max(worst, error / fuzz);
            const PrimitiveSurface a = exact->surface(0, o, d, *expected);
            const PrimitiveSurface b = set->surface(hit->index, o, d, hit->hit);
            EXPECT_LT((a.p - b.p).length(), 8 * fuzz);
            EXPECT_LT((normalize(a.n) - b.n).length(), 8 * fuzz / radius);
        }
    }
    RecordProperty("worst_in_roundings", std::to_string(worst));
    EXPECT_LT(worst, 8);
    EXPECT_GT(hits, 10000u);
}

TEST(RoundCurves, NothingPassesThroughThem) {
    // Rays to places on the axis, many of them joints, from outside
    Random random(3);
    size_t rays = 0;
    for (int kind = 0; kind < 60; ++kind) {
        const double thickness = std::pow(10.0, -random.between(0.5, 5.0));
        scene::Curves curves = some_curve(random, kind, thickness);
        if (kind % 5 == 4) curves.basis = scene::Curves::Basis::Linear;
        if (kind % 5 == 3) curves.basis = scene::Curves::Basis::CatmullRom;
        const auto set = RoundCurves::make(curves);
        const CurveOracle oracle(curves, 0);
        for (int i = 0; i < 3000; ++i) {
            const double places[] = {0, 1, 0.5, 0.25, 0.75, random.between(0, 1)};
            const auto segment = size_t(random.between(0, double(oracle.segments()) - 1e-9));
            const Vec3d aim(oracle.point(segment, Real(places[i % 6])));
            const Vec3d o = aim + random.direction() * 10.0;
            const auto hit = first_hit(*set, o, aim - o);
            ASSERT_TRUE(hit) << kind << ' ' << i;
            EXPECT_LT(hit->hit.t, 1.0);
            ++rays;
        }
    }
    EXPECT_EQ(rays, 180000u);
}

TEST(RoundCurves, OfAWidthThatGrowsEvenlyAreConesBetweenBalls) {
    // Balls along a straight line touch the cone whose sine is the slope of the radius
    Random random(4);
    size_t hits = 0;
    for (int i = 0; i < 200; ++i) {
        const auto length = float(random.between(0.5, 4.0));
        scene::Curves curves = bezier({Vec3(0), Vec3(0, 0, -length)},
                                      {0.0f, float(random.between(0.01, 0.6)) * length});
        curves.basis = scene::Curves::Basis::Linear;
        curves.width_interpolation = i % 2 ? Interpolation::Varying : Interpolation::Vertex;
        const auto set = RoundCurves::make(curves);
        const double sine = 0.5 * double(curves.widths[1]) / -double(curves.points[1].z);
        const double tangent = sine / std::sqrt(1 - sine * sine);
        // As far as it touches balls
        const double height = -double(curves.points[1].z) * (1 - sine * sine);
        scene::Gprim cone;
        cone.kind = scene::Gprim::Kind::Cone;
        cone.height = height;
        cone.radius = height * tangent;
        cone.shape_from_gprim.setTranslation(Vec3d(0, 0, -height / 2));
        const auto exact = Quadric::make(cone);
        for (int k = 0; k < 60; ++k) {
            const Vec3d o = random.direction() * 8.0;
            const Vec3d d = Vec3d(0, 0, -random.between(0, 1) * height) + random.in_cube(0.1) - o;
            const auto expected = exact->intersect(0, o, d, far_away);
            if (!expected) continue;
            const PrimitiveSurface a = exact->surface(0, o, d, *expected);
            if (a.face != 0 || a.p.z < -0.99 * height || a.p.z > -0.01 * height) continue;
            const auto hit = first_hit(*set, o, d);
            ASSERT_TRUE(hit);
            const double cosine = std::abs(normalize(d).dot(normalize(a.n)));
            if (cosine < 0.01) continue;
            EXPECT_NEAR(hit->hit.t, expected->t, 1e-12);
            const PrimitiveSurface b = set->surface(hit->index, o, d, hit->hit);
            EXPECT_LT((normalize(a.n) - b.n).length(), 1e-10 / cosine);
            // The last ball shows through the cone's base
            ++hits;
        }
    }
    EXPECT_GT(hits, 3000u);
}

TEST(RoundCurves, AreLeftWhereTheLastOfTheirBallsIs) {
    // From inside: no wall at joints, and out where all balls end
    Random random(5);
    size_t exits = 0;
    for (int kind = 0; kind < 40; ++kind) {
        const double thickness = random.between(0.02, 0.2);
        const scene::Curves curves = some_curve(random, kind, thickness);
        const auto set = RoundCurves::make(curves);
        const Balls balls(curves, 1000);
        for (int i = 0; i < 100; ++i) {
            const auto& [center, r] =
                balls.balls[size_t(random.between(0, double(balls.balls.size())))];
            const Vec3d o = Vec3d(center) + random.direction() * (0.5 * double(r));
            Vec3d d = random.direction();
            // Many along the curve
            if (i % 2) d = normalize(Vec3d(balls.balls[balls.balls.size() / 2].c) - o + d * 0.05);
            const auto hit = first_hit(*set, o, d);
            ASSERT_TRUE(hit);
            const Vec3d p = o + d * hit->hit.t;
            const double off = double(balls.outside(VecL(p)));
            // On the inner side of a kink the sides of one segment may be inside of the other
            const bool has_kink = kind % 2 == 0;
            EXPECT_LT(has_kink ? off : std::abs(off), 1e-9) << kind << ' ' << i;
            const PrimitiveSurface at = set->surface(hit->index, o, d, hit->hit);
            if (std::abs(off) < 1e-9) {
                EXPECT_GT(at.n.dot(d), -1e-9);
                ++exits;
            }
        }
    }
    EXPECT_GT(exits, 3900u);
}

}  // namespace
}  // namespace velatura::geometry::test
