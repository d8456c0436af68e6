// SPDX-License-Identifier: Apache-2.0
#include "geometry/quadric.h"

#include "geometry/geometry_set.h"
#include "geometry/surface_point.h"
#include "geometry/tessellate.h"
#include "hard_case.h"
#include "oracle_numbers.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

namespace velatura::geometry {

namespace {

using test::far_away, test::Random, test::Real, test::VecL;

using Kind = scene::Gprim::Kind;
constexpr Kind kinds[] = {Kind::Sphere, Kind::Cylinder, Kind::Cone, Kind::Capsule};

Mat4d affine(const Vec3d& scale, const Vec3d& axis, double turn, const Vec3d& where) {
    Mat4d s, r, t;
    s.setScale(scale);
    r.setAxisAngle(axis, turn);
    t.setTranslation(where);
    return s * r * t;
}

scene::Gprim gprim_of(Kind kind, double radius, double height, const Mat4d& matrix = Mat4d()) {
    scene::Gprim gprim;
    gprim.kind = kind;
    gprim.radius = radius;
    gprim.height = height;
    gprim.shape_from_gprim = matrix;
    return gprim;
}

scene::Scene scene_of(const scene::Gprim& gprim, bool flip = false) {
    scene::Scene scene;
    scene::Shape shape;
    shape.geometry = gprim;
    shape.flip_normals = flip;
    scene.shapes.push_back(shape);
    return scene;
}

// Some placement: even, uneven, mirrored.
Mat4d some_matrix(Random& random, int i, double reach) {
    const Vec3d scale = i % 3 == 0   ? Vec3d(1.0)
                        : i % 3 == 1 ? Vec3d(0.3, 1.5, 0.8)
                                     : Vec3d(-0.5, 0.7, 1.2);
    return affine(scale, random.direction(), random.between(0, 6), random.in_cube(reach));
}

// How far outside of the body a point of its own space is, by closed forms; negative inside.
Real outside(const scene::Gprim& g, const VecL& p) {
    const Real r = std::hypot(p.x, p.y), radius = Real(g.radius), half = Real(g.height) / 2;
    switch (g.kind) {
        case Kind::Sphere:
            return p.length() - radius;
        case Kind::Cylinder:
            return std::max(r - radius, std::abs(p.z) - half);
        case Kind::Capsule:
            return std::hypot(r, std::max(std::abs(p.z) - half, Real(0))) - radius;
        default: {
            const Real slope = std::hypot(radius, Real(g.height));
            return std::max((r * Real(g.height) - radius * (half - p.z)) / slope, -half - p.z);
        }
    }
}

VecL to_gprim(const scene::Gprim& g, const VecL& p) {
    const Imath::Matrix44<Real> m(g.shape_from_gprim);
    return transform_point(p, m.inverse());
}

// The first t > 0 where the ray passes the surface: by bisection between samples of outside().
std::optional<Real> first_crossing(const scene::Gprim& g,
                                   const Vec3d& o,
                                   const Vec3d& d,
                                   Real end) {
    const auto at = [&](Real t) { return outside(g, to_gprim(g, VecL(o) + VecL(d) * t)); };
    constexpr int steps = 2000;
    const bool starts_outside = at(0) > 0;
    for (int i = 1; i <= steps; ++i) {
        Real a = end * (i - 1) / steps, b = end * i / steps;
        if ((at(b) > 0) == starts_outside) continue;
        for (int k = 0; k < 70; ++k) {
            const Real middle = (a + b) / 2;
            ((at(middle) > 0) == starts_outside ? a : b) = middle;
        }
        return b;
    }
    return std::nullopt;
}

struct Sample {
    scene::Gprim gprim;
    std::shared_ptr<const Quadric> quadric;
};

std::vector<Sample> samples(uint32_t seed, double reach) {
    Random random(seed);
    std::vector<Sample> all;
    for (const Kind kind : kinds) {
        for (int i = 0; i < 6; ++i) {
            Sample s{gprim_of(kind, random.between(0.2, 2.0), random.between(0.2, 4.0),
                              some_matrix(random, i, reach)),
                     nullptr};
            s.quadric = Quadric::make(s.gprim);
            all.push_back(s);
        }
    }
    return all;
}

Vec3d center_of(const Sample& s) {
    const Mat4d& m = s.gprim.shape_from_gprim;
    return {m[3][0], m[3][1], m[3][2]};
}

}  // namespace

TEST(Quadrics, SpheresAreMetWhereLongDoubleSays) {
    Random random(1);
    constexpr double u = 0x1p-53;
    double worst = 0;
    size_t hits = 0, undecided = 0;
    // Radius over distance of the center, from outside and inside
    for (const double ratio : {1e-7, 1e-5, 1e-3, 0.1, 0.5, 0.9, 0.999, 1.001, 1.5, 10.0, 1e3}) {
        for (int i = 0; i < 4000; ++i) {
            const double radius = std::ldexp(random.between(1, 2), int(random.between(-20, 20)));
            const double distance = radius / ratio;
            const Vec3d o = random.in_cube(radius);
            const Vec3d center = o + random.direction() * distance;
            // Across the outline and through the middle alike
            const Vec3d aim = center + random.direction() * (radius * random.between(0.0, 1.1));
            const Vec3d d = (aim - o) * std::ldexp(1.0, int(random.between(-10, 10)));
            const auto quadric = Quadric::make(
                gprim_of(Kind::Sphere, radius, 1, affine(Vec3d(1), {0, 0, 1}, 0, center)));
            const auto hit = quadric->intersect(0, o, d, far_away);

            const VecL q = VecL(o) - VecL(center), e = VecL(d);
            const Real a = e.dot(e), middle = -q.dot(e) / a;
            const VecL nearest = q + e * middle;
            const Real f2 = nearest.dot(nearest) / (Real(radius) * Real(radius));
            // What one rounding of the ray's place moves the outline by
            const Real fuzz = 32 * Real(u) * Real(1 + 1 / ratio);
            if (std::abs(f2 - 1) < fuzz) {
                ++undecided;
                continue;
            }
            const Real root = f2 < 1 ? std::sqrt(1 - f2) * Real(radius) / std::sqrt(a) : 0;
            const bool is_inside = distance < radius;
            const Real t = is_inside ? middle + root : middle - root;
            ASSERT_EQ(hit.has_value(), f2 < 1 && t > 0) << ratio << ' ' << double(f2);
            if (!hit) continue;
            ++hits;
            const Real cosine = std::sqrt(1 - f2);
            const Real unit = Real(u) * Real(distance + radius) / (cosine * std::sqrt(a));
            worst = hardcase::larger(worst, double(std::abs(Real(hit->t) - t) / unit));
        }
    }
    RecordProperty("worst_in_roundings_of_the_distance", std::to_string(worst));
    EXPECT_LT(worst, 16);
    EXPECT_GT(hits, 15000u);
    EXPECT_LT(undecided, 50u);
}

TEST(Quadrics, EveryKindIsMetWhereItsClosedFormChangesSign) {
    Random random(2);
    size_t hits = 0;
    for (const Sample& s : samples(3, 5)) {
        ASSERT_TRUE(s.quadric);
        for (int i = 0; i < 60; ++i) {
            const Vec3d o = center_of(s) + random.in_cube(i % 2 ? 6.0 : 0.5);
            const Vec3d d = center_of(s) + random.in_cube(1.5) - o;
            const Real end = Real(20.0 / d.length());
            const auto expected = first_crossing(s.gprim, o, d, end);
            const auto hit = s.quadric->intersect(0, o, d, float(end));
            if (!expected) {
                // Bisection sees no chord shorter than its steps
                if (!hit) continue;
                const auto second =
                    s.quadric->intersect(0, o + d * (hit->t * (1 + 1e-9)), d, float(end));
                ASSERT_TRUE(second);
                EXPECT_LT(second->t, double(end) / 1000);
                continue;
            }
            ASSERT_TRUE(hit) << s.quadric->kind();
            if (double(*expected) - hit->t > double(end) / 2000) continue;  // such a chord before
            EXPECT_NEAR(hit->t * d.length(), double(*expected) * d.length(), 1e-10)
                << s.quadric->kind();
            ++hits;
        }
    }
    EXPECT_GT(hits, 900u);
}

TEST(Quadrics, SurfacesLieOnTheBodyWithItsNormal) {
    Random random(4);
    for (const Sample& s : samples(5, 5)) {
        const Box3d box = s.quadric->bounds(0).box;
        for (int i = 0; i < 200; ++i) {
            const Vec3d o = center_of(s) + random.in_cube(6.0);
            const Vec3d d = center_of(s) + random.in_cube(1.0) - o;
            const auto hit = s.quadric->intersect(0, o, d, far_away);
            if (!hit) continue;
            const PrimitiveSurface at = s.quadric->surface(0, o, d, *hit);
            EXPECT_LT((at.p - (o + d * hit->t)).length(), 1e-9);
            EXPECT_TRUE(box.intersects(at.p) && box.intersects(o + d * hit->t));
            const Real off = outside(s.gprim, to_gprim(s.gprim, VecL(at.p)));
            EXPECT_LT(double(std::abs(off)), 1e-14 * (1 + center_of(s).length()));
            // A step along the normal leaves, one against it enters, and no direction leaves sooner
            const Vec3d n = normalize(at.n);
            const double step = 1e-5;
            const auto beyond = [&](const Vec3d& w) {
                return double(outside(s.gprim, to_gprim(s.gprim, VecL(at.p + w * step))));
            };
            EXPECT_GT(beyond(n), 0);
            EXPECT_LT(beyond(-n), 0);
            Vec3d across = n.cross(random.direction());
            if (i % 2) across = -across;
            EXPECT_LT(std::abs(beyond(across)), 1e-3 * step) << s.quadric->kind();
            // It turns along the surface as it says
            const Vec3d other_o = o + across * 1e-6;
            const auto other = s.quadric->intersect(0, other_o, d, far_away);
            if (!other) continue;
            const PrimitiveSurface there = s.quadric->surface(0, other_o, d, *other);
            const bool is_steep = std::abs(normalize(d).dot(n)) < 0.1;
            if (there.face != at.face || is_steep) continue;
            const Vec3d turned = (there.n - at.n), said = (there.p - at.p) * at.normal_by_p;
            EXPECT_LT((turned - said).length(), 1e-4 * 1e-6 * at.n.length() + 1e-3 * said.length())
                << s.quadric->kind() << ' ' << at.face;
        }
    }
}

TEST(Quadrics, BoxesAreTight) {
    Random random(6);
    for (const Sample& s : samples(7, 5)) {
        const Box3d box = s.quadric->bounds(0).box;
        Box3d seen;
        for (int i = 0; i < 20000; ++i)
            seen.extendBy(s.quadric->point(0, {random.between(0, 1), random.between(0, 1)}));
        for (int k = 0; k < 3; ++k) {
            EXPECT_LE(box.min[k], seen.min[k]);
            EXPECT_GE(box.max[k], seen.max[k]);
            EXPECT_LT(box.size()[k] - seen.size()[k], 0.02 * box.size()[k]) << s.quadric->kind();
        }
    }
}

TEST(Quadrics, PointsAreEvenAndAreasThoseOfAFineTessellation) {
    Random random(8);
    for (const Kind kind : kinds) {
        scene::Shape shape;
        shape.geometry = gprim_of(kind, 0.7, 1.9);
        const auto& gprim = std::get<scene::Gprim>(shape.geometry);
        const auto quadric = Quadric::make(gprim);
        const TriangleMesh mesh = make_triangle_mesh(shape, {.segments = 512});
        double area = 0, moment = 0;
        for (uint32_t i = 0; i < mesh.triangle_count(); ++i) {
            const Vec3d a(mesh.corner(i, 0)), b(mesh.corner(i, 1)), c(mesh.corner(i, 2));
            const double part = 0.5 * (b - a).cross(c - a).length();
            area += part;
            moment += part * (a.z + b.z + c.z) / 3;
        }
        EXPECT_NEAR(quadric->area(0) / area, 1.0, 1e-4);
        double mean = 0;
        constexpr int count = 100000;
        for (int i = 0; i < count; ++i) {
            const Vec3d p = quadric->point(0, {(i + 0.5) / count, random.between(0, 1)});
            EXPECT_LT(double(std::abs(outside(gprim, VecL(p)))), 1e-14);
            mean += p.z / count;
        }
        EXPECT_NEAR(mean, moment / area, 1e-4);
    }
}

TEST(H03SelfHits, RaysThatLeaveQuadricsDoNotComeBack) {
    // Whatever the scale, the distance from the origin and the placement
    Random random(9);
    size_t left = 0, crossed = 0, far_sides = 0, again = 0;
    for (int i = 0; i < 600; ++i) {
        const Kind kind = kinds[i % 4];
        const double size = std::ldexp(1.0, int(random.between(-20, 20)));
        const double away = i % 5 == 0 ? 1000 * size : 3 * size;
        Mat4d matrix = some_matrix(random, i / 4, 1.0);
        for (int r = 0; r < 3; ++r)
            for (int k = 0; k < 3; ++k) matrix[r][k] *= size;
        for (int k = 0; k < 3; ++k) matrix[3][k] *= away;
        scene::Scene scene = scene_of(gprim_of(kind, 0.8, 1.7, matrix), i % 2 == 1);
        if (i % 3 == 2) {
            scene.prototypes.push_back({"p", {scene.shapes[0]}});
            scene.shapes.clear();
            scene::Instance instance;
            const Mat4d placed = affine(Vec3d(0.7, -1.3, 0.4), random.direction(),
                                        random.between(0, 6), random.in_cube(away));
            instance.render_from_prototype = Mat4(placed);
            scene.instances.push_back(instance);
        }
        const GeometrySet set(scene);
        const bool is_instanced = !scene.instances.empty();
        const TriangleMesh& mesh = is_instanced ? set.prototypes()[0][0] : set.shapes()[0];
        ASSERT_TRUE(mesh.primitives());
        const Mat4d backward = is_instanced ? set.instances()[0].prototype_from_render : Mat4d();
        const Mat4d forward = backward.inverse();
        const Vec3d center = transform_point(Vec3d(mesh.bounds().center()), forward);
        const auto trace = [&](const Ray& ray) {
            Hit hit;
            const auto found = mesh.primitives()->intersect(
                0, transform_point(Vec3d(ray.o), backward),
                transform_direction(Vec3d(ray.d), backward), ray.t_max);
            if (found) hit = {float(found->t), 0, 0, is_instanced ? 0 : scene::none, 0, 0};
            return hit;
        };
        for (int k = 0; k < 50; ++k) {
            const Ray first{to_float(center + random.direction() * (5 * size)), Vec3(0)};
            Ray ray = first;
            ray.d = to_float(center + random.in_cube(0.5 * size)) - first.o;
            const Hit hit = trace(ray);
            if (!hit.is_valid()) continue;
            const SurfacePoint point = make_surface_point(scene, set, ray, hit);
            // Outside is where the ray came from, by orientation
            const bool is_mirrored = determinant3(matrix) < 0;
            EXPECT_EQ(point.ng.dot(ray.d) < 0, (i % 2 == 1) == is_mirrored);
            const Vec3 out = point.ng.dot(ray.d) < 0 ? point.ng : -point.ng;
            for (int j = 0; j < 20; ++j) {
                Vec3 w = to_float(random.direction());
                // Many along the surface
                if (j % 2) w = w - out * (out.dot(w) * (1 - 1e-6f));
                const bool goes_in = w.dot(out) < 0;
                // Below what the normal itself is rounded by nobody knows which side it is
                if (std::abs(w.dot(out)) < 0x1p-22f) continue;
                const Hit next = trace(spawn_ray(point, w));
                if (!goes_in) {
                    again += next.is_valid();
                    ++left;
                } else {
                    // From a place at a rim the offset may lie beyond the other face
                    ++crossed;
                    far_sides += next.is_valid();
                }
            }
        }
    }
    EXPECT_GT(left, 100000u);
    hardcase::expect_within({"quadrics met again by rays that leave them, sizes 2^-20 to 2^20",
                             double(again), 0, 0, "a convex body is left for good",
                             fmt::format("a share of {:.1g}", 3.0 / double(left))});
    EXPECT_GT(double(far_sides), 0.999 * double(crossed));
}

TEST(Quadrics, NothingPassesWhereFacesMeet) {
    // Rays from inside to a rim, an apex or a seam, and beyond
    Random random(10);
    for (const Kind kind : {Kind::Cylinder, Kind::Cone, Kind::Capsule}) {
        const scene::Gprim gprim = gprim_of(kind, 0.7, 1.9);
        const auto quadric = Quadric::make(gprim);
        for (int i = 0; i < 200000; ++i) {
            const double turn = random.between(0, 2 * pi_d);
            const double end = i % 2 || kind == Kind::Cone ? -0.95 : 0.95;
            Vec3d aim(0.7 * std::cos(turn), 0.7 * std::sin(turn), end);
            if (kind == Kind::Cone && i % 4 == 0) aim = Vec3d(0, 0, 0.95);
            const Vec3d o(random.between(-0.1, 0.1), random.between(-0.1, 0.1),
                          random.between(-0.5, 0.0));
            const auto hit = quadric->intersect(0, o, aim - o, far_away);
            ASSERT_TRUE(hit);
            ASSERT_NEAR(hit->t, 1.0, 1e-12);
            // And from outside to a point inside
            ASSERT_TRUE(quadric->is_occluded(0, aim + (aim - o) * 3.0, o - aim, far_away));
        }
    }
}

TEST(Quadrics, AgreeWithAFineTessellation) {
    Random random(11);
    for (int i = 0; i < 24; ++i) {
        const scene::Gprim gprim =
            gprim_of(kinds[i % 4], 0.8, 1.7, some_matrix(random, i / 4, 2.0));
        const bool flip = i % 2 == 1;
        const scene::Scene scene = scene_of(gprim, flip);
        const GeometrySet exact(scene);
        const GeometrySet fine(scene, {.segments = 512, .all_quadrics = true});
        EXPECT_EQ(exact.tessellated_quadrics(), 0u);
        EXPECT_EQ(fine.tessellated_quadrics(), 1u);
        EXPECT_EQ(exact.triangle_count(), 0u);
        const TriangleMesh& mesh = fine.shapes()[0];
        for (int k = 0; k < 300; ++k) {
            const auto triangle = uint32_t(random.between(0, double(mesh.triangle_count()) - 0.5));
            const Hit known{1, 0.3f, 0.3f, scene::none, 0, triangle};
            const SurfacePoint flat = make_surface_point(scene, fine, {}, known);
            // A ray onto the facet from outside
            const bool is_out = flip == (determinant3(gprim.shape_from_gprim) < 0);
            const Vec3 out = is_out ? flat.ng : -flat.ng;
            const Ray ray{flat.p + out * 0.1f, -out};
            const auto found =
                exact.shapes()[0].primitives()->intersect(0, Vec3d(ray.o), Vec3d(ray.d), far_away);
            ASSERT_TRUE(found);
            const Hit hit{float(found->t), 0, 0, scene::none, 0, 0};
            const SurfacePoint point = make_surface_point(scene, exact, ray, hit);
            EXPECT_LT((point.p - flat.p).length(), 3e-4f);
            EXPECT_GT(point.ng.dot(flat.ng), 0.999f) << i;
            EXPECT_GT(point.ns.dot(flat.ns), 0.999f) << i;
            EXPECT_EQ(point.ng, point.ns);
        }
    }
}

TEST(Quadrics, TangentsRunAroundTheAxisAndUp) {
    Random random(12);
    for (const Sample& s : samples(13, 3)) {
        const scene::Scene scene = scene_of(s.gprim);
        const GeometrySet set(scene);
        const Mat3d upright = Mat3d(s.gprim.shape_from_gprim[0][0], s.gprim.shape_from_gprim[0][1],
                                    s.gprim.shape_from_gprim[0][2], s.gprim.shape_from_gprim[1][0],
                                    s.gprim.shape_from_gprim[1][1], s.gprim.shape_from_gprim[1][2],
                                    s.gprim.shape_from_gprim[2][0], s.gprim.shape_from_gprim[2][1],
                                    s.gprim.shape_from_gprim[2][2]);
        for (int i = 0; i < 100; ++i) {
            const Vec3d o = center_of(s) + random.in_cube(6.0);
            const Ray ray{to_float(o), to_float(center_of(s) + random.in_cube(0.6) - o)};
            const auto found = s.quadric->intersect(0, Vec3d(ray.o), Vec3d(ray.d), far_away);
            if (!found) continue;
            const Hit hit{float(found->t), 0, 0, scene::none, 0, 0};
            const SurfacePoint point = make_surface_point(scene, set, ray, hit);
            const Tangents t = tangents(scene, point);
            EXPECT_NEAR(t.dpds.dot(point.ng), 0, 1e-5);
            EXPECT_NEAR(t.dpdt.dot(point.ng), 0, 1e-5);
            EXPECT_GT(t.dpds.cross(t.dpdt).dot(point.ng), 0);
            // Around: nothing of the axis in the body's own space
            const Vec3d around = Vec3d(t.dpds) * upright.inverse();
            EXPECT_NEAR(around.z, 0, 1e-5 * around.length());
        }
    }
}

TEST(Quadrics, ScalingByPowersOfTwoScalesEveryBit) {
    Random random(14);
    for (const Sample& s : samples(15, 2)) {
        scene::Gprim scaled = s.gprim;
        for (int r = 0; r < 4; ++r)
            for (int k = 0; k < 3; ++k) scaled.shape_from_gprim[r][k] *= 0x1p20;
        const auto big = Quadric::make(scaled);
        for (int i = 0; i < 100; ++i) {
            const Vec3d o = random.in_cube(6), d = center_of(s) + random.in_cube(1) - o;
            const auto a = s.quadric->intersect(0, o, d, far_away);
            const auto b = big->intersect(0, o * 0x1p20, d * 0x1p20, far_away);
            ASSERT_EQ(a.has_value(), b.has_value());
            if (!a) continue;
            EXPECT_EQ(a->t, b->t);
            EXPECT_EQ(s.quadric->surface(0, o, d, *a).p * 0x1p20,
                      big->surface(0, o * 0x1p20, d * 0x1p20, *b).p);
        }
    }
}

TEST(Quadrics, AreTrianglesWhereTheyHaveNoInverseAndWhereTheyGlow) {
    const Mat4d flat = affine(Vec3d(1, 1, 0), {0, 0, 1}, 0, Vec3d(0));
    EXPECT_FALSE(Quadric::make(gprim_of(Kind::Sphere, 1, 1, flat)));
    EXPECT_FALSE(Quadric::make(
        gprim_of(Kind::Sphere, 1, 1, affine(Vec3d(1, 1, 1e-7), {0, 0, 1}, 0, Vec3d(0)))));
    EXPECT_FALSE(Quadric::make(gprim_of(Kind::Cylinder, 1, 1e-7)));
    EXPECT_FALSE(Quadric::make(gprim_of(Kind::Sphere, 0, 1)));
    EXPECT_FALSE(Quadric::make(gprim_of(Kind::Sphere, -1, 1)));
    EXPECT_FALSE(Quadric::make(gprim_of(Kind::Sphere, std::nan(""), 1)));
    EXPECT_FALSE(Quadric::make(gprim_of(Kind::Cube, 1, 1)));
    EXPECT_TRUE(Quadric::make(gprim_of(Kind::Capsule, 1, 0)));

    const scene::Scene pressed = scene_of(gprim_of(Kind::Sphere, 1, 1, flat));
    EXPECT_EQ(GeometrySet(pressed).tessellated_quadrics(), 1u);
    EXPECT_GT(GeometrySet(pressed).triangle_count(), 0u);

    scene::Scene scene = scene_of(gprim_of(Kind::Sphere, 1, 1));
    EXPECT_EQ(GeometrySet(scene).tessellated_quadrics(), 0u);
    EXPECT_EQ(GeometrySet(scene).primitive_counts().at("sphere"), 1u);
    scene.materials.resize(2);
    scene.materials[1].emissive_color = scene::Input(Rgb(1.0f));
    scene.shapes[0].material = 0;
    EXPECT_EQ(GeometrySet(scene).tessellated_quadrics(), 0u);
    scene.shapes[0].material = 1;
    EXPECT_EQ(GeometrySet(scene).tessellated_quadrics(), 1u);
    scene.shapes[0].material = 0;
    scene.shapes[0].light = 0;
    EXPECT_EQ(GeometrySet(scene).tessellated_quadrics(), 1u);
    scene.shapes[0].light = scene::none;
    // By what an instance makes of it
    scene.prototypes.push_back({"p", scene.shapes});
    scene.shapes.clear();
    scene.instances.resize(2);
    EXPECT_EQ(GeometrySet(scene).tessellated_quadrics(), 0u);
    scene.instances[1].material_override = 1;
    EXPECT_EQ(GeometrySet(scene).tessellated_quadrics(), 1u);
}

}  // namespace velatura::geometry
