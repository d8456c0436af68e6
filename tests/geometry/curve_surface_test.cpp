// SPDX-License-Identifier: Apache-2.0
// What shading sees of curves and points, and how they are placed.
#include "curve_fixtures.h"
#include "geometry/geometry_set.h"
#include "geometry/mapped_set.h"
#include "geometry/quadric.h"
#include "geometry/ribbons.h"
#include "geometry/round_curves.h"
#include "geometry/sphere_set.h"
#include "geometry/surface_point.h"
#include "hard_case.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace velatura::geometry::test {
namespace {

Mat4d affine(Random& random, const Vec3d& scale, double reach) {
    Mat4d s, r, t;
    s.setScale(scale);
    r.setAxisAngle(random.direction(), random.between(0, 6));
    t.setTranslation(random.in_cube(reach));
    return s * r * t;
}

scene::Scene scene_of(const scene::Curves& curves) {
    scene::Scene scene;
    scene.shapes.emplace_back();
    scene.shapes[0].geometry = curves;
    return scene;
}

TEST(CurveSurfaces, LieOnTheCurveAndTurnAsTheirNormalsSay) {
    Random random(1);
    size_t tested = 0, rough = 0;
    for (int kind = 0; kind < 60; ++kind) {
        const double thickness = random.between(0.01, 0.2);
        const scene::Curves curves = some_curve(random, kind, thickness);
        const auto set = RoundCurves::make(curves);
        const Balls balls(curves, 300);
        for (int i = 0; i < 30; ++i) {
            const Vec3d o = random.direction() * 4.0;
            const auto& ball = balls.balls[size_t(random.between(0, double(balls.balls.size())))];
            const Vec3d d =
                normalize(Vec3d(ball.c) + random.direction() * (0.8 * double(ball.r)) - o);
            const auto hit = first_hit(*set, o, d);
            if (!hit) continue;
            const PrimitiveSurface at = set->surface(hit->index, o, d, hit->hit);
            EXPECT_LT((at.p - (o + d * hit->hit.t)).length(), 1e-11);
            // Bends that are tighter than the curve is thick are made of cones
            const double off = std::abs(double(balls.outside(VecL(at.p))));
            EXPECT_LT(off, 0x1p-10 * thickness);
            rough += off > 1e-10;
            EXPECT_NEAR(at.n.length(), 1, 1e-14);
            EXPECT_LT(at.n.dot(d), 1e-6);
            const Box3d box = set->bounds(hit->index).box;
            EXPECT_TRUE(box.intersects(at.p) && box.intersects(o + d * hit->hit.t));
            if (at.n.dot(d) > -0.2) continue;
            const Vec3d step = at.n.cross(random.direction()) * 1e-7;
            const auto other = set->intersect(hit->index, o + step, d, far_away);
            if (!other || std::abs(other->t - hit->hit.t) > 1e-5) continue;
            const PrimitiveSurface there = set->surface(hit->index, o + step, d, *other);
            const Vec3d moved = there.p - at.p, turned = there.n - at.n;
            const Vec3d said = moved * at.normal_by_p;
            // Where a tube ends and its ball begins there are two answers
            if (std::min(hit->hit.u, 1 - hit->hit.u) < 1e-5f) continue;
            EXPECT_LT((turned - said).length(), 2e-3 * said.length() + 1e-9 / thickness) << kind;
            ++tested;
        }
    }
    EXPECT_GT(tested, 900u);
    EXPECT_LT(rough, 10u);
}

TEST(H03SelfHits, RaysThatLeaveCurvesDoNotComeBack) {
    Random random(2);
    size_t left = 0, straight = 0, again = 0;
    for (int kind = 0; kind < 60; ++kind) {
        const double size = std::ldexp(1.0, int(random.between(-12, 12)));
        const double thickness = std::pow(10.0, -random.between(0.5, 3.0));
        scene::Curves curves = some_curve(random, kind, thickness);
        const bool is_straight = kind % 3 == 0;
        if (is_straight)
            for (size_t i = 0; i < 7; ++i) {
                curves.points[i] = curves.points[0] + Vec3(0.3f, 0.2f, -0.1f) * float(i);
                curves.widths[i] = float(thickness);
            }
        for (Vec3& p : curves.points) p *= float(size);
        for (float& w : curves.widths) w *= float(size);
        scene::Scene scene = scene_of(curves);
        if (kind % 2) {
            scene.prototypes.push_back({"p", {scene.shapes[0]}});
            scene.shapes.clear();
            scene::Instance instance;
            instance.render_from_prototype =
                Mat4(affine(random, kind % 4 == 1 ? Vec3d(1.0) : Vec3d(0.7, -1.3, 0.4), 3 * size));
            scene.instances.push_back(instance);
        }
        const GeometrySet geometry(scene);
        const TriangleMesh& mesh = kind % 2 ? geometry.prototypes()[0][0] : geometry.shapes()[0];
        const Mat4d backward = kind % 2 ? geometry.instances()[0].prototype_from_render : Mat4d();
        const Mat4d forward = backward.inverse();
        const PrimitiveSet& set = *mesh.primitives();
        const auto trace = [&](const Ray& ray) {
            Hit hit;
            const auto found = first_hit(set, transform_point(Vec3d(ray.o), backward),
                                         transform_direction(Vec3d(ray.d), backward), ray.t_max);
            if (found)
                hit = {
                    float(found->hit.t), found->hit.u, found->hit.v, kind % 2 ? 0 : scene::none, 0,
                    found->index};
            return hit;
        };
        const Balls balls(curves, 300);
        for (int i = 0; i < 30; ++i) {
            const auto& ball = balls.balls[size_t(random.between(0, double(balls.balls.size())))];
            const Vec3d aim = transform_point(Vec3d(ball.c), forward);
            Ray ray{to_float(aim + random.direction() * (5 * size)), Vec3(0)};
            ray.d = to_float(aim) - ray.o;
            const Hit hit = trace(ray);
            if (!hit.is_valid()) continue;
            const SurfacePoint point = make_surface_point(scene, geometry, ray, hit);
            EXPECT_LT(point.ng.dot(ray.d), 1e-4f * ray.d.length());
            for (int k = 0; k < 20; ++k) {
                Vec3 w = to_float(random.direction());
                if (k % 2) w = w - point.ng * (point.ng.dot(w) * (1 - 1e-6f));
                if (w.dot(point.ng) < 0x1p-22f) continue;
                const Ray away = spawn_ray(point, w);
                const Hit next = trace(away);
                ++left;
                straight += is_straight;
                if (!next.is_valid()) continue;
                again += is_straight;
                // On the inside of a bend: through the open, not through itself, but for the cones
                // of the tightest ones
                const Vec3d middle = transform_point(
                    Vec3d(away.o) + Vec3d(away.d) * (0.5 * double(next.t)), backward);
                EXPECT_GT(double(balls.outside(VecL(middle))), -0x1p-11 * thickness * size) << kind;
            }
        }
    }
    EXPECT_GT(left, 15000u);
    EXPECT_GT(straight, 5000u);
    hardcase::expect_within({"straight strands met again by rays that leave them", double(again), 0,
                             0, "a convex body is left for good",
                             fmt::format("a share of {:.1g}", 3.0 / double(straight))});
}

TEST(CurveSurfaces, BoxesAreTight) {
    Random random(3);
    for (int kind = 0; kind < 40; ++kind) {
        const scene::Curves curves = some_curve(random, kind, random.between(0.01, 0.3));
        const auto set = RoundCurves::make(curves);
        Box3d all, seen;
        for (uint32_t i = 0; i < set->size(); ++i) all.extendBy(set->bounds(i).box);
        for (const Balls::Ball& ball : Balls(curves, 500).balls) {
            const Vec3d c(ball.c), r = Vec3d(double(ball.r));
            seen.extendBy(Box3d(c - r, c + r));
        }
        for (int k = 0; k < 3; ++k) {
            EXPECT_LE(all.min[k], seen.min[k] + 1e-7);
            EXPECT_GE(all.max[k], seen.max[k] - 1e-7);
            EXPECT_LT(all.size()[k] - seen.size()[k], 1e-4 * all.size()[k]) << kind;
        }
    }
}

TEST(CurveSurfaces, CarryPrimvarsOfEveryInterpolation) {
    scene::Curves curves =
        bezier({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(2, 0, 0), Vec3(3, 0, 0)}, {0.2f});
    curves.points.insert(curves.points.end(),
                         {Vec3(0, 1, 0), Vec3(1, 1, 0), Vec3(2, 1, 0), Vec3(3, 1, 0)});
    curves.vertex_counts = {4, 4};
    const auto add = [&](uint32_t name, scene::Interpolation interpolation, std::vector<float> v) {
        scene::Primvar primvar;
        primvar.name = name;
        primvar.interpolation = interpolation;
        primvar.values = std::move(v);
        curves.primvars.push_back(primvar);
    };
    add(0, scene::Interpolation::Constant, {7});
    add(1, scene::Interpolation::Uniform, {1, 2});
    add(2, scene::Interpolation::Varying, {1, 2, 10, 30});
    add(3, scene::Interpolation::Vertex, {0, 0, 0, 8, 0, 9, 0, 0});
    add(4, scene::Interpolation::Vertex, {1, 2});  // too few
    scene::Scene scene = scene_of(curves);
    const GeometrySet geometry(scene);
    const TriangleMesh& mesh = geometry.shapes()[0];
    for (const double x : {0.3, 1.5, 2.9}) {
        const Ray ray{Vec3(float(x), 1, 5), Vec3(0, 0, -1)};
        const auto found = first_hit(*mesh.primitives(), Vec3d(ray.o), Vec3d(ray.d));
        ASSERT_TRUE(found);
        const Hit hit{float(found->hit.t), found->hit.u, found->hit.v, scene::none, 0,
                      found->index};
        const SurfacePoint point = make_surface_point(scene, geometry, ray, hit);
        EXPECT_NEAR(point.p.z, 0.1, 1e-6);
        const auto value = [&](uint32_t id) {
            float out[4] = {-1, 0, 0, 0};
            EXPECT_EQ(primvar(scene, point, id, out), id != 4);
            return out[0];
        };
        const double u = x / 3;
        EXPECT_EQ(value(0), 7);
        EXPECT_EQ(value(1), 2);
        EXPECT_NEAR(value(2), 10 + 20 * u, 1e-4);
        EXPECT_NEAR(value(3), 27 * u * (1 - u) * (1 - u), 1e-4);
        value(4);
        // Along the curve, and around it
        const Tangents t = tangents(scene, point);
        EXPECT_NEAR(t.dpds.x, 1, 1e-6);
        EXPECT_NEAR(std::abs(t.dpdt.y), 1, 1e-6);
    }
}

TEST(MappedSets, OfBallsAreTheQuadricsThatTheyAre) {
    Random random(4);
    size_t hits = 0;
    for (int i = 0; i < 100; ++i) {
        scene::Points points;
        points.points = {to_float(random.in_cube(1))};
        points.widths = {float(random.between(0.2, 2.0))};
        const Mat4d matrix = affine(random, i % 2 ? Vec3d(0.3, -1.5, 1) : Vec3d(2, 1, 1), 3);
        const auto set = MappedSet::make(SphereSet::make(points), matrix);
        scene::Gprim ball;
        ball.kind = scene::Gprim::Kind::Sphere;
        ball.radius = 0.5 * double(points.widths[0]);
        Mat4d where;
        where.setTranslation(Vec3d(points.points[0]));
        ball.shape_from_gprim = where * matrix;
        const auto exact = Quadric::make(ball);
        ASSERT_TRUE(set && exact);
        const Box3d a = set->bounds(0).box, b = exact->bounds(0).box;
        for (int k = 0; k < 3; ++k)
            EXPECT_TRUE(a.min[k] <= b.min[k] + 1e-12 && a.max[k] >= b.max[k] - 1e-12);
        for (int k = 0; k < 100; ++k) {
            const Vec3d o = random.in_cube(8), d = a.center() + random.in_cube(0.8) - o;
            const auto one = set->intersect(0, o, d, far_away),
                       two = exact->intersect(0, o, d, far_away);
            if (one.has_value() != two.has_value() || !one) continue;
            const PrimitiveSurface s = set->surface(0, o, d, *one),
                                   t = exact->surface(0, o, d, *two);
            const double cosine = std::abs(normalize(t.n).dot(normalize(d)));
            if (cosine < 0.01) continue;
            EXPECT_NEAR(one->t, two->t, 1e-12);
            EXPECT_LT((s.p - t.p).length(), 1e-10);
            EXPECT_LT((normalize(s.n) - normalize(t.n)).length(), 1e-10);
            const Vec3d dp = normalize(s.n).cross(random.direction());
            // Up to the length of the covector
            const double scale = s.n.length() / t.n.length();
            EXPECT_LT((dp * s.normal_by_p - dp * t.normal_by_p * scale).length(),
                      1e-9 * s.n.length());
            ++hits;
        }
    }
    EXPECT_GT(hits, 4000u);
    Mat4d flat;
    flat[1][1] = 0;
    scene::Points one;
    one.points = {Vec3(0)};
    one.widths = {1};
    EXPECT_FALSE(MappedSet::make(SphereSet::make(one), flat));
    one.widths = {0};
    EXPECT_FALSE(SphereSet::make(one));
}

TEST(CurveSurfaces, ScaleByPowersOfTwoToTheBit) {
    Random random(5);
    for (int kind = 0; kind < 20; ++kind) {
        const scene::Curves curves = some_curve(random, kind, 0.05);
        scene::Curves scaled = curves;
        for (Vec3& p : scaled.points) p *= 1024.0f;
        for (float& w : scaled.widths) w *= 1024.0f;
        const auto set = RoundCurves::make(curves), big = RoundCurves::make(scaled);
        ASSERT_EQ(set->size(), big->size());
        for (int i = 0; i < 200; ++i) {
            const Vec3d o = random.direction() * 3.0;
            const Vec3d d = Vec3d(curves.points[size_t(i) % 7]) + random.in_cube(0.05) - o;
            const auto a = first_hit(*set, o, d), b = first_hit(*big, o * 1024.0, d * 1024.0);
            ASSERT_EQ(a.has_value(), b.has_value());
            if (!a) continue;
            EXPECT_EQ(a->hit.t, b->hit.t);
        }
    }
}

TEST(H14DegenerateCurves, HaveFiniteSurfaces) {
    // Cusps, loops, points that coincide, tips, what is thicker than long
    const Vec3 a(0), b(1, 0, 0), c(0, 1, 0), e(1, 1, 0);
    const std::vector<std::vector<Vec3>> shapes = {{a, b, a, b}, {a, e, b, c}, {a, a, a, b},
                                                   {a, b, b, b}, {a, a, b, b}, {a, b, c, a},
                                                   {a, c, a, a}, {a, a, a, a}};
    Random random(6);
    size_t hits = 0, bad = 0;
    for (const std::vector<Vec3>& points : shapes) {
        for (const std::vector<float>& widths : {std::vector<float>{0.02f},
                                                 {3.0f},
                                                 {0, 0, 0, 0.4f},
                                                 {0.4f, 0, 0, 0},
                                                 {0, 5, 0, 0},
                                                 {0.0f}}) {
            const scene::Curves curves = bezier(points, widths);
            const auto set = RoundCurves::make(curves);
            const bool is_nothing = widths == std::vector<float>{0.0f} || points[1] == points[3];
            if (!set) {
                EXPECT_TRUE(is_nothing || points == shapes.back());
                continue;
            }
            EXPECT_LT(set->size(), 2000u);
            const Balls balls(curves, 500);
            for (int i = 0; i < 200; ++i) {
                const auto& ball =
                    balls.balls[size_t(random.between(0, double(balls.balls.size())))];
                if (ball.r < 1e-3L) continue;
                const Vec3d aim(ball.c), o = aim + random.direction() * 10.0;
                const auto hit = first_hit(*set, o, aim - o);
                ASSERT_TRUE(hit);
                ++hits;
                const PrimitiveSurface at = set->surface(hit->index, o, aim - o, hit->hit);
                bad += !std::isfinite(at.p.length()) || !std::isfinite(at.n.length()) ||
                       at.n == Vec3d(0.0) || !(at.error.length() < 1e-10);
                // Bends that are tighter than the curve is thick are made of cones
                EXPECT_LT(std::abs(double(balls.outside(VecL(at.p)))), 0x1p-10 * 2.5);
            }
        }
    }
    EXPECT_GT(hits, 5000u);
    hardcase::expect_within(
        {fmt::format("points of {} on cusps, loops and tips that are not finite", hits),
         double(bad), 0, 0, "the balls that the curve is made of"});
}

}  // namespace
}  // namespace velatura::geometry::test
