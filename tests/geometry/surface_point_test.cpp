// SPDX-License-Identifier: Apache-2.0
#include "geometry/surface_point.h"

#include "geometry/geometry_set.h"
#include "hard_case.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

namespace velatura::geometry {

namespace {

scene::Shape triangle_shape(const Vec3& a, const Vec3& b, const Vec3& c) {
    scene::Mesh mesh;
    mesh.points = {a, b, c};
    mesh.face_vertex_counts = {3};
    mesh.face_vertex_indices = {0, 1, 2};
    scene::Shape shape;
    shape.geometry = mesh;
    return shape;
}

/// Whether o + t·d, t > 0, meets the plane of the triangle. The side of the origin and the heading
/// decide, both from float data in long double: exact enough, since 2×24 + 24 bits of products fit
/// but for the spread of exponents.
template <class T>
bool meets_plane(const Vec3 p[3], const Imath::Vec3<T>& o, const Imath::Vec3<T>& d) {
    long double q[3][3];
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i)
            q[k][i] = static_cast<long double>(p[k][i]) - static_cast<long double>(o[i]);
    const auto edge = [&](int k, int i) {
        return static_cast<long double>(p[k][i]) - static_cast<long double>(p[0][i]);
    };
    const long double n[3] = {edge(1, 1) * edge(2, 2) - edge(1, 2) * edge(2, 1),
                              edge(1, 2) * edge(2, 0) - edge(1, 0) * edge(2, 2),
                              edge(1, 0) * edge(2, 1) - edge(1, 1) * edge(2, 0)};
    long double height = 0, heading = 0;
    for (int i = 0; i < 3; ++i) {
        height += n[i] * q[0][i];
        heading += n[i] * static_cast<long double>(d[i]);
    }
    return height * heading > 0;
}

Vec3 random_unit(std::mt19937& random) {
    std::normal_distribution<float> normal;
    return normalize(Vec3(normal(random), normal(random), normal(random)));
}

Vec3 random_point(std::mt19937& random, int exponent) {
    std::uniform_real_distribution<float> uniform(-1, 1);
    return Vec3(uniform(random), uniform(random), uniform(random)) * std::ldexp(1.0f, exponent);
}

}  // namespace

TEST(H03SelfHits, SpawnedRaysNeverMeetThePlaneOfTheirTriangle) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> uniform(0, 1);
    size_t rays = 0, again = 0;
    for (int trial = 0; trial < 4000; ++trial) {
        scene::Scene scene;
        // Sizes 2^-20 … 2^20, as far as 2^12 sizes from the origin, needles included
        const int size = int(random() % 41) - 20, away = size + int(random() % 13);
        const Vec3 center = random_point(random, away);
        const Vec3 a = center + random_point(random, size);
        const Vec3 b = center + random_point(random, size);
        const Vec3 c = trial % 4 == 0
                           ? a + (b - a) * uniform(random) + random_point(random, size - 12)
                           : center + random_point(random, size);
        if (a == b || b == c || c == a) continue;
        scene.shapes.push_back(triangle_shape(a, b, c));
        const GeometrySet geometry(scene);
        const Vec3 corners[3] = {a, b, c};
        for (int k = 0; k < 64; ++k) {
            Hit hit;
            hit.b1 = k == 0 ? 0.0f : uniform(random);
            hit.b2 = k == 1 ? 1.0f - hit.b1 : uniform(random) * (1.0f - hit.b1);
            hit.shape = hit.triangle = 0;
            const SurfacePoint point = make_surface_point(scene, geometry, Ray(), hit);
            const Vec3 d = random_unit(random);
            // Headings within rounding of the plane have no side
            if (std::abs(d.dot(point.ng)) < 1e-5f) continue;
            const Ray ray = spawn_ray(point, d);
            ++rays;
            again += meets_plane(corners, ray.o, ray.d);
        }
    }
    EXPECT_GT(rays, 200000u);
    hardcase::expect_within(
        {fmt::format("planes of triangles met again by {} rays, sizes 2^-20 to 2^20", rays),
         double(again), 0, 0, "side and heading in long double",
         fmt::format("a share of {:.1g}", 3.0 / double(rays))});
}

TEST(SurfacePoint, SpawnedRaysNeverMeetTheirInstancedTriangle) {
    std::mt19937 random(12);
    std::uniform_real_distribution<float> uniform(0, 1);
    size_t rays = 0, again = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        scene::Scene scene;
        const Vec3 a = random_point(random, 3), b = random_point(random, 3),
                   c = random_point(random, 3);
        scene::Prototype prototype;
        prototype.shapes.push_back(triangle_shape(a, b, c));
        scene.prototypes.push_back(prototype);
        scene::Instance instance;
        for (int i = 0; i < 3; ++i) {
            // Rows of lengths between 1 and 10^-4
            const Vec3 row = random_unit(random) * std::pow(10.0f, -4.0f * uniform(random));
            for (int j = 0; j < 3; ++j) instance.render_from_prototype[i][j] = row[j];
            instance.render_from_prototype[3][i] = 100.0f * uniform(random);
        }
        scene.instances.push_back(instance);
        const GeometrySet geometry(scene);
        const InstanceTransform& transform = geometry.instances()[0];
        ASSERT_TRUE(transform.is_invertible);
        const Vec3 corners[3] = {a, b, c};
        for (int k = 0; k < 64; ++k) {
            Hit hit{1.0f, uniform(random), 0, 0, 0, 0};
            hit.b2 = uniform(random) * (1.0f - hit.b1);
            const SurfacePoint point = make_surface_point(scene, geometry, Ray(), hit);
            const Vec3 d = random_unit(random);
            const Ray ray = spawn_ray(point, d);
            // As traversal carries the ray into prototype space
            const Vec3d o = transform_point(Vec3d(ray.o), transform.prototype_from_render);
            const Vec3d e = transform_direction(Vec3d(d), transform.prototype_from_render);
            const Vec3 n = (b - a).cross(c - a).normalized();
            if (std::abs(e.normalized().dot(Vec3d(n))) < 1e-4) continue;
            ++rays;
            again += meets_plane(corners, o, e);
        }
    }
    EXPECT_GT(rays, 50000u);
    EXPECT_EQ(again, 0u) << "of " << rays;
}

TEST(H04ThinGaps, OffsetStaysWithinAFewUlps) {
    // A wall at x = 2^20 + 3: the step must not cross a gap of 8 ulp
    const float x = 1048579.0f, ulp = 0.125f;
    scene::Scene scene;
    scene.shapes.push_back(triangle_shape({x, -1000, -1000}, {x, 1000, -1000}, {x, 0, 1000}));
    const GeometrySet geometry(scene);
    const Hit hit{1.0f, 0.3f, 0.3f, scene::none, 0, 0};
    const SurfacePoint point = make_surface_point(scene, geometry, Ray(), hit);
    const Vec3 o = offset_ray_origin(point, Vec3(1, 0, 0));
    EXPECT_GT(o.x, x);
    hardcase::expect_within(
        {"offset off a wall at 2^20 + 3, in ulp", double((o.x - x) / ulp), 4, 0, "gap of 8 ulp"});
}

TEST(SurfacePoint, ErrorBoundHoldsAgainstLongDouble) {
    std::mt19937 random(13);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (int trial = 0; trial < 20000; ++trial) {
        scene::Scene scene;
        const Vec3 p[3] = {random_point(random, 8), random_point(random, 8),
                           random_point(random, 8)};
        scene.shapes.push_back(triangle_shape(p[0], p[1], p[2]));
        const GeometrySet geometry(scene);
        Hit hit{1.0f, uniform(random), 0, scene::none, 0, 0};
        hit.b2 = uniform(random) * (1.0f - hit.b1);
        const SurfacePoint point = make_surface_point(scene, geometry, Ray(), hit);
        for (int i = 0; i < 3; ++i) {
            const long double b1 = hit.b1, b2 = hit.b2;
            const long double truth = (1 - b1 - b2) * static_cast<long double>(p[0][i]) +
                                      b1 * static_cast<long double>(p[1][i]) +
                                      b2 * static_cast<long double>(p[2][i]);
            ASSERT_LE(std::abs(truth - static_cast<long double>(point.p[i])),
                      static_cast<long double>(point.p_error[i]));
        }
    }
}

namespace {

/// o + t·d on the plane of three points, and the weights of the second and third one, in long
/// double.
struct ExactHit {
    long double t, b1, b2;
};

ExactHit exact_hit(const Vec3 p[3], const Vec3& o, const Vec3& d) {
    using Real = long double;
    Real e1[3], e2[3], s[3];
    for (int i = 0; i < 3; ++i) {
        e1[i] = Real(p[1][i]) - Real(p[0][i]);
        e2[i] = Real(p[2][i]) - Real(p[0][i]);
        s[i] = Real(o[i]) - Real(p[0][i]);
    }
    const auto cross = [](const Real a[3], const Real b[3], int i) {
        return a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    };
    const Real direction[3] = {Real(d.x), Real(d.y), Real(d.z)};
    Real det = 0, b1 = 0, b2 = 0, t = 0;
    for (int i = 0; i < 3; ++i) {
        det += e1[i] * cross(direction, e2, i);
        b1 += s[i] * cross(direction, e2, i);
        b2 += direction[i] * cross(s, e1, i);
        t += e2[i] * cross(s, e1, i);
    }
    return {t / det, b1 / det, b2 / det};
}

/// How far from where a ray of a few units meets it the points of huge triangles lie, in parts of
/// its length; in instances of twice the size, if asked for.
double farthest_slip(bool is_instanced) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> uniform(-1, 1);
    double worst = 0;
    for (int trial = 0; trial < 4000; ++trial) {
        // A triangle about the origin of 2^2 to 2^28 units, tilted a little, a unit below
        const float size = std::ldexp(1.0f, 2 + trial % 27);
        Vec3 p[3];
        for (int k = 0; k < 3; ++k) {
            const float angle = 2.0943951f * float(k) + uniform(random);
            p[k] = Vec3(std::cos(angle), 0.25f * uniform(random), std::sin(angle)) * size;
        }
        const float height = float(exact_hit(p, Vec3(0.0f), Vec3(0, -1, 0)).t);
        for (Vec3& corner : p) corner.y += height - 1.0f;
        scene::Scene scene;
        Vec3 corners[3] = {p[0], p[1], p[2]};
        if (is_instanced) {
            for (Vec3& corner : corners) corner *= 0.5f;
            scene::Prototype prototype;
            prototype.shapes.push_back(triangle_shape(corners[0], corners[1], corners[2]));
            scene.prototypes.push_back(prototype);
            scene::Instance instance;
            for (size_t i = 0; i < 3; ++i) instance.render_from_prototype[int(i)][int(i)] = 2.0f;
            scene.instances.push_back(instance);
        } else {
            scene.shapes.push_back(triangle_shape(p[0], p[1], p[2]));
        }
        const GeometrySet geometry(scene);
        Ray ray;
        ray.o = Vec3(uniform(random), 1.0f, uniform(random)) * 2.0f;
        ray.d = normalize(Vec3(uniform(random), -1.0f, uniform(random)));
        const ExactHit exact = exact_hit(p, ray.o, ray.d);
        if (!(exact.t > 0 && exact.b1 > 0 && exact.b2 > 0 && exact.b1 + exact.b2 < 1)) continue;
        const Hit hit{float(exact.t),
                      float(exact.b1),
                      float(exact.b2),
                      is_instanced ? 0u : scene::none,
                      0,
                      0};
        const SurfacePoint point = make_surface_point(scene, geometry, ray, hit);
        for (int i = 0; i < 3; ++i) {
            const long double there =
                static_cast<long double>(ray.o[i]) + exact.t * static_cast<long double>(ray.d[i]);
            worst = hardcase::larger(
                worst, double(std::abs(there - static_cast<long double>(point.p[i])) / exact.t));
        }
    }
    return worst;
}

}  // namespace

TEST(H07HugeTriangles, PointsAreWhereTheRayMeetsThem) {
    for (const bool is_instanced : {false, true}) {
        hardcase::expect_within({fmt::format("points of triangles of up to 2^28 units{}, off their "
                                             "place, in parts of the way to them",
                                             is_instanced ? " in instances" : ""),
                                 farthest_slip(is_instanced), 0x1p-20, 0,
                                 "ray and plane in long double"});
    }
}

TEST(SurfacePoint, OrientationFollowsWindingFlagAndMirror) {
    for (const bool flipped : {false, true}) {
        for (const bool mirrored : {false, true}) {
            scene::Scene scene;
            scene::Shape shape = triangle_shape({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
            auto& mesh = std::get<scene::Mesh>(shape.geometry);
            mesh.normals = {{0, 0.6f, 0.8f}};
            mesh.normal_interpolation = scene::Interpolation::Constant;
            shape.flip_normals = flipped;
            scene::Prototype prototype;
            prototype.shapes.push_back(shape);
            scene.prototypes.push_back(prototype);
            scene::Instance instance;
            // The mirror keeps z, hence the outside stays where it was
            if (mirrored) instance.render_from_prototype[0][0] = -1.0f;
            scene.instances.push_back(instance);
            const GeometrySet geometry(scene);
            const Hit hit{1.0f, 0.25f, 0.25f, 0, 0, 0};
            const SurfacePoint point = make_surface_point(scene, geometry, Ray(), hit);
            const float side = flipped ? -1.0f : 1.0f;
            EXPECT_EQ(point.ng, Vec3(0, 0, side));
            EXPECT_NEAR((point.ns - Vec3(0, 0.6f, 0.8f) * side).length(), 0.0f, 1e-6f);
        }
    }
}

TEST(SurfacePoint, NormalsUnderNonUniformScaleAreCovectors) {
    scene::Scene scene;
    scene::Prototype prototype;
    // Plane x + z = 1; scaled by 4 in x it becomes x/4 + z = 1
    prototype.shapes.push_back(triangle_shape({1, 0, 0}, {1, 1, 0}, {0, 0, 1}));
    scene.prototypes.push_back(prototype);
    scene::Instance instance;
    instance.render_from_prototype[0][0] = 4.0f;
    scene.instances.push_back(instance);
    const GeometrySet geometry(scene);
    const SurfacePoint point =
        make_surface_point(scene, geometry, Ray(), {1.0f, 0.25f, 0.25f, 0, 0, 0});
    EXPECT_NEAR((point.ng - Vec3(1, 0, 4).normalized()).length(), 0.0f, 1e-6f);
}

TEST(SurfacePoint, TangentsFollowTextureCoordinates) {
    scene::Scene scene;
    scene::Shape shape = triangle_shape({0, 0, 0}, {2, 0, 0}, {0, 3, 0});
    auto& mesh = std::get<scene::Mesh>(shape.geometry);
    scene::Primvar st;
    st.name = scene::intern_primvar(scene, "st");
    st.interpolation = scene::Interpolation::FaceVarying;
    st.width = 2;
    st.values = {0, 0, 0, 1, -1, 0};  // s runs along −y, t along +x
    mesh.primvars = {st};
    scene.shapes.push_back(shape);
    const GeometrySet geometry(scene);
    const SurfacePoint point =
        make_surface_point(scene, geometry, Ray(), {1.0f, 0.2f, 0.2f, scene::none, 0, 0});
    const Tangents along = tangents(scene, point);
    EXPECT_NEAR((along.dpds - Vec3(0, -1, 0)).length(), 0.0f, 1e-6f);
    EXPECT_NEAR((along.dpdt - Vec3(1, 0, 0)).length(), 0.0f, 1e-6f);
}

TEST(SurfacePoint, ScalingByPowersOfTwoScalesEveryBit) {
    std::mt19937 random(14);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (int trial = 0; trial < 500; ++trial) {
        const Vec3 p[3] = {random_point(random, 2), random_point(random, 2),
                           random_point(random, 2)};
        scene::Instance instance;
        for (int i = 0; i < 4; ++i) {
            const Vec3 row = random_unit(random);
            for (int j = 0; j < 3; ++j) instance.render_from_prototype[i][j] = row[j];
        }
        const float b1 = uniform(random), b2 = uniform(random) * (1 - b1);
        const bool is_instanced = trial % 2 == 0;
        const Vec3 d = random_unit(random);
        SurfacePoint reference;
        Tangents reference_tangents;
        Vec3 reference_origin(0.0f);
        for (const int k : {0, -20, 20}) {
            const float s = std::ldexp(1.0f, k);
            scene::Scene scene;
            scene::Shape shape = triangle_shape(p[0] * s, p[1] * s, p[2] * s);
            scene::Prototype prototype;
            prototype.shapes.push_back(shape);
            scene.prototypes.push_back(prototype);
            scene.shapes.push_back(shape);
            scene::Instance scaled = instance;
            for (int j = 0; j < 3; ++j) scaled.render_from_prototype[3][j] *= s;
            scene.instances.push_back(scaled);
            const GeometrySet geometry(scene);
            const Hit hit{1.0f, b1, b2, is_instanced ? 0 : scene::none, 0, 0};
            const SurfacePoint point = make_surface_point(scene, geometry, Ray(), hit);
            const Vec3 origin = offset_ray_origin(point, d);
            if (k == 0) {
                reference = point;
                reference_tangents = tangents(scene, point);
                reference_origin = origin;
            }
            ASSERT_EQ(point.p, reference.p * s);
            ASSERT_EQ(point.p_error, reference.p_error * s);
            ASSERT_EQ(point.ng, reference.ng);
            ASSERT_EQ(point.ns, reference.ns);
            ASSERT_EQ(tangents(scene, point).dpds, reference_tangents.dpds);
            ASSERT_EQ(origin, reference_origin * s);
        }
    }
}

namespace {

/// A triangle of the unit sphere around the origin, with the sphere's normals at its corners.
scene::Shape sphere_triangle(const Vec3& a, const Vec3& b, const Vec3& c, float scale = 1) {
    scene::Shape shape = triangle_shape(a * scale, b * scale, c * scale);
    auto& mesh = std::get<scene::Mesh>(shape.geometry);
    mesh.normals = {a, b, c};
    mesh.normal_interpolation = scene::Interpolation::Vertex;
    return shape;
}

/// Corners `turn` radians around a random direction of the sphere.
void random_cap(std::mt19937& random, float turn, Vec3 corners[3]) {
    const Frame frame = Frame::from_z(random_unit(random));
    for (int k = 0; k < 3; ++k) {
        const float phi = 2 * pi * float(k) / 3;
        corners[k] = frame.from_local(
            Vec3(std::sin(turn) * std::cos(phi), std::sin(turn) * std::sin(phi), std::cos(turn)));
    }
}

}  // namespace

TEST(H15Terminator, LiftedPointsLieJustAboveTheCurvedSurface) {
    std::mt19937 random(15);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (int trial = 0; trial < 3000; ++trial) {
        const float turn = 0.02f + 0.7f * uniform(random);
        Vec3 c[3];
        random_cap(random, turn, c);
        const float b1 = uniform(random), b2 = uniform(random) * (1 - b1);
        Vec3 reference_p(0.0f), reference_error(0.0f);
        for (const int k : {0, -20, 20}) {
            const float s = std::ldexp(1.0f, k);
            scene::Scene scene;
            scene.shapes.push_back(sphere_triangle(c[0], c[1], c[2], s));
            const GeometrySet geometry(scene);
            const SurfacePoint point =
                make_surface_point(scene, geometry, Ray(), {1.0f, b1, b2, scene::none, 0, 0});
            const SurfacePoint start = lifted(geometry, point, point.ng).value_or(point);
            if (k == 0) {
                reference_p = start.p;
                reference_error = start.p_error;
                // Outside the sphere, by no more than the height of the arc
                ASSERT_EQ(start.side, 1);
                ASSERT_GE(start.p.length(), 1 - 1e-6f);
                ASSERT_LE(start.p.length(), 2 - std::cos(turn) + 1e-6f);
            }
            ASSERT_EQ(start.p, reference_p * s);
            ASSERT_EQ(start.p_error, reference_error * s);
            // A ray that leaves below the facet's horizon starts above the facet all the same
            const Vec3 grazing = normalize(cross(point.ns, random_unit(random))) - point.ng * 0.01f;
            ASSERT_GT((spawn_ray(start, grazing).o - point.p).dot(point.ng), 0.0f);
            // Seen from inside, the sphere is hollow
            ASSERT_FALSE(lifted(geometry, point, -point.ng));
        }
    }
}

TEST(H15Terminator, OnlyCoarseCurvedFacetsAreLifted) {
    const auto lifts = [](const scene::Shape& shape) {
        scene::Scene scene;
        scene.shapes.push_back(shape);
        const GeometrySet geometry(scene);
        const SurfacePoint point =
            make_surface_point(scene, geometry, Ray(), {1.0f, 0.25f, 0.25f, scene::none, 0, 0});
        const SurfacePoint start = lifted(geometry, point, point.ng).value_or(point);
        EXPECT_EQ(start.side == 0, start.p == point.p);
        return start.side != 0;
    };
    std::mt19937 random(16);
    const float degree = pi / 180;
    Vec3 c[3];
    const auto cap = [&](float turn) {
        random_cap(random, turn * degree, c);
        return sphere_triangle(c[0], c[1], c[2]);
    };
    EXPECT_FALSE(lifts(cap(0.6f)));
    EXPECT_TRUE(lifts(cap(1)));
    EXPECT_TRUE(lifts(cap(44)));
    EXPECT_FALSE(lifts(cap(46)));
    // Faceted, and flat with normals
    scene::Shape flat = triangle_shape(c[0], c[1], c[2]);
    EXPECT_FALSE(lifts(flat));
    auto& mesh = std::get<scene::Mesh>(flat.geometry);
    const Vec3 n = (c[1] - c[0]).cross(c[2] - c[0]).normalized();
    mesh.normals = {n, n, n};
    mesh.normal_interpolation = scene::Interpolation::Vertex;
    EXPECT_FALSE(lifts(flat));
}

TEST(SurfacePoint, LiftingFollowsInstances) {
    std::mt19937 random(17);
    Vec3 c[3];
    random_cap(random, 0.4f, c);
    for (const bool is_mirrored : {false, true}) {
        for (const bool is_flipped : {false, true}) {
            scene::Scene scene;
            scene::Shape shape = sphere_triangle(c[0], c[1], c[2]);
            shape.flip_normals = is_flipped;
            scene::Prototype prototype;
            prototype.shapes.push_back(shape);
            scene.prototypes.push_back(prototype);
            scene::Instance instance;
            instance.render_from_prototype[0][0] = is_mirrored ? -3.0f : 3.0f;
            instance.render_from_prototype[1][1] = 3.0f;
            instance.render_from_prototype[2][2] = 3.0f;
            instance.render_from_prototype[3][1] = 100.0f;
            scene.instances.push_back(instance);
            const GeometrySet geometry(scene);
            const SurfacePoint point =
                make_surface_point(scene, geometry, Ray(), {1.0f, 0.3f, 0.3f, 0, 0, 0});
            // The viewer outside the sphere, whatever is called the outside of the mesh
            const Vec3 wo = (point.p - Vec3(0, 100, 0)).normalized();
            const SurfacePoint start = lifted(geometry, point, wo).value_or(point);
            EXPECT_NE(start.side, 0);
            EXPECT_GT((start.p - point.p).dot(wo), 0.1f);
            EXPECT_GE((start.p - Vec3(0, 100, 0)).length(), 3 - 1e-4f);
            EXPECT_FALSE(lifted(geometry, point, -wo));
        }
    }
}

TEST(SurfacePoint, RayTowardsAPointEndsThere) {
    scene::Scene scene;
    scene.shapes.push_back(triangle_shape({0, 0, 1}, {1, 0, 1}, {0, 1, 1}));
    const GeometrySet geometry(scene);
    const SurfacePoint point =
        make_surface_point(scene, geometry, Ray(), {1.0f, 0.25f, 0.25f, scene::none, 0, 0});
    const Ray ray = spawn_ray_to(point, Vec3(3, 4, 5));
    EXPECT_EQ(ray.t_max, 1.0f);
    EXPECT_GT(ray.o.z, 1.0f);
    EXPECT_NEAR((ray.o + ray.d - Vec3(3, 4, 5)).length(), 0.0f, 1e-6f);
    EXPECT_LT(spawn_ray_to(point, Vec3(3, 4, -5)).o.z, 1.0f);
}

}  // namespace velatura::geometry
