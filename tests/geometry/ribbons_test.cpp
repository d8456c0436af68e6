// SPDX-License-Identifier: Apache-2.0
#include "geometry/ribbons.h"

#include "curve_fixtures.h"

#include <gtest/gtest.h>

namespace velatura::geometry::test {
namespace {

scene::Curves some_ribbon(Random& random, int kind, double width) {
    // Along y, turning and winding on the way; normals stand well off it
    scene::Curves curves = some_curve(random, kind, width);
    for (size_t i = 0; i < curves.points.size(); ++i) {
        curves.points[i] = to_float(Vec3d(0, 0.4 * double(i) - 1.2, 0) + random.in_cube(0.15));
        const double turn = (kind % 3 == 2 ? 0.1 : 0.6) * double(i);
        curves.normals.push_back(
            to_float(Vec3d(std::sin(turn), 0, std::cos(turn)) + random.in_cube(0.2)));
    }
    if (kind % 2 == 1) curves.points[4] = curves.points[3] * 2.0f - curves.points[2];
    curves.normal_interpolation = scene::Interpolation::Vertex;
    return curves;
}

// A strip of triangles from the definition: the curve, and to both sides along c' × n.
struct Strip {
    std::vector<Vec3d> left, right;

    Strip(const scene::Curves& curves, int steps) {
        const CurveOracle oracle(curves, 0);
        for (size_t s = 0; s < oracle.segments(); ++s) {
            for (int k = 0; k <= steps; ++k) {
                const Real u = Real(k) / steps, e = 1e-5L;
                const VecL c = oracle.point(s, u);
                const VecL along = oracle.point(s, u + e) - oracle.point(s, u - e);
                const VecL n = oracle.at(s, u, [&](size_t i) { return VecL(curves.normals[i]); });
                const VecL side = along.cross(n);
                const VecL half = side * (oracle.radius(s, u) / side.length());
                left.push_back(Vec3d(c - half));
                right.push_back(Vec3d(c + half));
            }
        }
    }

    std::vector<double> hits(const Vec3d& o, const Vec3d& d) const {
        std::vector<double> found;
        const auto test = [&](const Vec3d& a, const Vec3d& b, const Vec3d& c) {
            const Vec3d e = b - a, f = c - a, h = d.cross(f);
            const double det = e.dot(h);
            if (det == 0) return;
            const Vec3d q = o - a;
            const double u = q.dot(h) / det, v = d.dot(q.cross(e)) / det;
            if (u < 0 || v < 0 || u + v > 1) return;
            found.push_back(f.dot(q.cross(e)) / det);
        };
        for (size_t i = 0; i + 1 < left.size(); ++i) {
            test(left[i], right[i], right[i + 1]);
            test(left[i], right[i + 1], left[i + 1]);
        }
        return found;
    }
};

TEST(Ribbons, AreMetWhereAFineStripOfTrianglesIs) {
    Random random(1);
    size_t hits = 0, at_edges = 0;
    double worst = 0;
    for (int kind = 1; kind < 60; kind += 2) {
        const double width = std::pow(10.0, -random.between(0.5, 2.5));
        const scene::Curves curves = some_ribbon(random, kind, width);
        const auto set = Ribbons::make(curves);
        ASSERT_TRUE(set);
        const Strip strip(curves, 600);
        for (int i = 0; i < 200; ++i) {
            // Between rungs and off the diagonals, where the triangles leak
            const auto at = size_t(random.between(0, double(strip.left.size() - 1)));
            const double w = random.between(-0.1, 1.1), f = random.between(0.1, 0.9);
            const Vec3d left = strip.left[at] * (1 - f) + strip.left[at + 1] * f;
            const Vec3d right = strip.right[at] * (1 - f) + strip.right[at + 1] * f;
            const Vec3d aim = left * (1 - w) + right * w;
            const Vec3d o = random.direction() * 5.0, d = normalize(aim - o);
            const std::vector<double> expected = strip.hits(o, d);
            const auto hit = first_hit(*set, o, d);
            if (expected.empty() && !hit) continue;
            const double first =
                expected.empty() ? 1e9 : *std::min_element(expected.begin(), expected.end());
            const bool agrees = hit && std::abs(hit->hit.t - first) < 0.02 * width;
            if (agrees) {
                ++hits;
                const PrimitiveSurface s = set->surface(hit->index, o, d, hit->hit);
                EXPECT_LT((s.p - (o + d * hit->hit.t)).length(), 1e-12);
                const double slant = std::abs(normalize(s.n).dot(d));
                // What the strip's own facets and the fit of the edges stray by
                worst = std::max(worst, slant * std::abs(hit->hit.t - first) / width);
                continue;
            }
            // Edges are fitted to 2^-8 of the half width; along a grazing line that may be far
            const bool is_edge = std::abs(w) < 0.02 || std::abs(w - 1) < 0.02 || !hit ||
                                 std::abs(hit->hit.v - 0.5f) > 0.48f || w < 0 || w > 1;
            const bool is_slanting =
                hit &&
                std::abs(normalize(set->surface(hit->index, o, d, hit->hit).n).dot(d)) < 0.05;
            EXPECT_TRUE(is_edge || is_slanting) << kind << ' ' << i << " w " << w;
            ++at_edges;
        }
    }
    RecordProperty("worst_in_widths", std::to_string(worst));
    EXPECT_GT(hits, 3500u);
    EXPECT_LT(at_edges, 120u);
    EXPECT_LT(worst, 0x1p-7);
}

TEST(Ribbons, OfOneDirectionAreRectangles) {
    Random random(2);
    for (int i = 0; i < 100; ++i) {
        scene::Curves curves =
            bezier({Vec3(0, -1.5f, 0), Vec3(0, 0.25f, 0), Vec3(0, 2, 0)}, {0.5f});
        curves.basis = scene::Curves::Basis::Linear;
        curves.normals = {Vec3(0, 0, 3)};
        curves.normal_interpolation = scene::Interpolation::Constant;
        const auto set = Ribbons::make(curves);
        for (int k = 0; k < 100; ++k) {
            const Vec3d aim(random.between(-0.3, 0.3), random.between(-1.6, 2.1), 0);
            const Vec3d o(random.between(-3, 3), random.between(-3, 3), k % 2 ? 2 : -2);
            const Vec3d d = (aim - o) * 0.5;
            const auto hit = first_hit(*set, o, d);
            const bool is_within = std::abs(aim.x) < 0.25 && aim.y > -1.5 && aim.y < 2;
            ASSERT_EQ(hit.has_value(), is_within) << aim.x << ' ' << aim.y;
            if (!hit) continue;
            EXPECT_NEAR(hit->hit.t, 2, 1e-14);
            const PrimitiveSurface s = set->surface(hit->index, o, d, hit->hit);
            // Towards the normal that was given, whatever side is seen
            EXPECT_LT((normalize(s.n) - Vec3d(0, 0, 1)).length(), 1e-14);
            EXPECT_LT((s.p - aim).length(), 1e-14);
            const double along = aim.y < 0.25 ? (aim.y + 1.5) / 1.75 : (aim.y - 0.25) / 1.75;
            EXPECT_NEAR(double(hit->hit.u), along, 1e-6);
        }
    }
}

TEST(Ribbons, NothingPassesTheirJoints) {
    Random random(3);
    for (int kind = 0; kind < 60; ++kind) {
        scene::Curves curves = some_ribbon(random, kind, 0.05);
        if (kind % 4 == 1) curves.basis = scene::Curves::Basis::Linear;
        if (kind % 4 == 2) curves.basis = scene::Curves::Basis::Bspline;
        if (kind % 8 == 2) curves.wrap = scene::Curves::Wrap::Periodic;
        const auto set = Ribbons::make(curves);
        const CurveOracle oracle(curves, 0);
        size_t misses = 0;
        for (int i = 0; i < 2000; ++i) {
            const double places[] = {0, 0.5, 0.25, 0.75, 0.125, random.between(0, 1)};
            const auto segment = size_t(random.between(0, double(oracle.segments()) - 1e-9));
            // Its very ends are edges
            if (places[i % 6] == 0 && segment == 0) continue;
            const Vec3d aim(oracle.point(segment, Real(places[i % 6])));
            // From where it faces: a kink that is seen from the side is an edge, as one is to which
            // the normals lean too far
            const VecL n = oracle.at(segment, Real(places[i % 6]),
                                     [&](size_t v) { return VecL(curves.normals[v]); });
            const Vec3d o = aim + (Vec3d(n) * (i % 2 ? 4.0 : -4.0) + random.in_cube(1));
            const auto leans = [&](Real from, Real to, size_t on) {
                const VecL along = oracle.point(on, to) - oracle.point(on, from);
                return std::abs(double(along.dot(n) / (along.length() * n.length()))) > 0.8;
            };
            const Real u = Real(places[i % 6]);
            if (leans(u, u + 1e-4L, segment) || (segment > 0 && leans(0.9999L, 1, segment - 1)))
                continue;
            misses += !first_hit(*set, o, aim - o);
        }
        EXPECT_EQ(misses, 0u) << kind;
    }
}

TEST(Ribbons, TurnAsTheirNormalsSay) {
    Random random(4);
    size_t tested = 0;
    for (int kind = 0; kind < 40; ++kind) {
        const scene::Curves curves = some_ribbon(random, kind, 0.3);
        const auto set = Ribbons::make(curves);
        for (int i = 0; i < 100; ++i) {
            const auto piece = uint32_t(random.between(0, double(set->size()) - 1e-9));
            const Vec3d aim =
                set->point(piece, {random.between(0.1, 0.9), random.between(0.1, 0.9)});
            const Vec3d d = random.direction(), o = aim - d;
            const auto hit = set->intersect(piece, o, d, far_away);
            if (!hit) continue;
            const Box3d box = set->bounds(piece).box;
            const PrimitiveSurface at = set->surface(piece, o, d, *hit);
            EXPECT_TRUE(box.intersects(at.p) && box.intersects(o + d * hit->t));
            if (std::abs(normalize(at.n).dot(d)) < 0.2) continue;
            const Vec3d step = normalize(at.n).cross(random.direction()) * 1e-6;
            const auto other = set->intersect(piece, o + step, d, far_away);
            if (!other || std::abs(other->t - hit->t) > 1e-4) continue;
            const PrimitiveSurface there = set->surface(piece, o + step, d, *other);
            const Vec3d turned = there.n - at.n, said = (there.p - at.p) * at.normal_by_p;
            EXPECT_LT((turned - said).length(), 1e-3 * said.length() + 1e-9 * at.n.length());
            Vec3d dpdu(0.0), dpdv(0.0);
            ASSERT_TRUE(set->tangents(piece, 0, at.p, *hit, dpdu, dpdv));
            EXPECT_LT(std::abs(normalize(dpdu).dot(normalize(at.n))), 1e-5);
            EXPECT_LT(std::abs(normalize(dpdv).dot(normalize(at.n))), 1e-5);
            ++tested;
        }
    }
    EXPECT_GT(tested, 2000u);
}

TEST(Ribbons, OfBadNormalsAreThereAllTheSame) {
    // None, along the curve, not a number: some direction is taken, nothing is lost or infinite
    Random random(5);
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    for (const Vec3& n : {Vec3(0.0f), Vec3(0, 1, 0), Vec3(nan)}) {
        scene::Curves curves =
            bezier({Vec3(0, -1, 0), Vec3(0, 0, 0), Vec3(0, 1, 0), Vec3(0, 2, 0)}, {0.5f});
        curves.normals = {n};
        curves.normal_interpolation = scene::Interpolation::Constant;
        const auto set = Ribbons::make(curves);
        ASSERT_TRUE(set);
        for (uint32_t i = 0; i < set->size(); ++i) EXPECT_FALSE(set->bounds(i).box.isEmpty());
        EXPECT_NEAR(set->bounds(0).box.max.x + set->bounds(0).box.max.z, 0.25, 1e-6);
    }
}

}  // namespace
}  // namespace velatura::geometry::test
