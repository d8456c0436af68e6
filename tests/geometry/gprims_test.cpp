// SPDX-License-Identifier: Apache-2.0
#include "geometry/geometry_set.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace velatura::geometry {

namespace {

using Kind = scene::Gprim::Kind;

struct Measure {
    double area = 0, volume = 0;
};

/// Area, and volume by the divergence theorem with windings as stored.
Measure measure(const TriangleMesh& mesh) {
    Measure m;
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
        const Vec3d a(mesh.corner(t, 0)), b(mesh.corner(t, 1)), c(mesh.corner(t, 2));
        m.area += (b - a).cross(c - a).length() / 2;
        m.volume += a.dot(b.cross(c)) / 6;
    }
    return m;
}

scene::Shape gprim_shape(Kind kind) {
    scene::Gprim gprim;
    gprim.kind = kind;
    gprim.radius = 1.5;
    gprim.height = 2.5;
    gprim.size = 1.25;
    gprim.width = 3;
    gprim.length = 2;
    scene::Shape shape;
    shape.geometry = gprim;
    return shape;
}

Measure exact(Kind kind) {
    const double r = 1.5, h = 2.5, s = 1.25;
    switch (kind) {
        case Kind::Sphere:
            return {4 * pi_d * r * r, 4.0 / 3 * pi_d * r * r * r};
        case Kind::Cube:
            return {6 * s * s, s * s * s};
        case Kind::Cylinder:
            return {2 * pi_d * r * (r + h), pi_d * r * r * h};
        case Kind::Cone:
            return {pi_d * r * (r + std::sqrt(h * h + r * r)), pi_d * r * r * h / 3};
        case Kind::Capsule:
            return {2 * pi_d * r * (2 * r + h), pi_d * r * r * (h + 4 * r / 3)};
        case Kind::Plane:
            return {6, 0};
    }
    return {};
}

}  // namespace

TEST(Gprims, AreaAndVolumeConvergeQuadratically) {
    for (const Kind kind : {Kind::Sphere, Kind::Cylinder, Kind::Cone, Kind::Capsule}) {
        const scene::Shape shape = gprim_shape(kind);
        const Measure truth = exact(kind);
        Measure last;
        for (int segments = 32; segments <= 128; segments *= 2) {
            const Measure m = measure(make_triangle_mesh(shape, {segments}));
            const Measure error{truth.area - m.area, truth.volume - m.volume};
            if (segments > 32) {
                EXPECT_NEAR(last.area / error.area, 4.0, 0.05) << int(kind) << " " << segments;
                EXPECT_NEAR(last.volume / error.volume, 4.0, 0.05) << int(kind) << " " << segments;
            }
            last = error;
        }
    }
}

TEST(Gprims, FlatOnesAreExact) {
    for (const Kind kind : {Kind::Cube, Kind::Plane}) {
        const Measure m = measure(make_triangle_mesh(gprim_shape(kind)));
        EXPECT_NEAR(m.area, exact(kind).area, 1e-6);
        EXPECT_NEAR(m.volume, exact(kind).volume, 1e-6);
    }
}

TEST(Gprims, NormalsAgreeWithTheQuadricAndTheWinding) {
    for (const Kind kind :
         {Kind::Sphere, Kind::Cube, Kind::Cylinder, Kind::Cone, Kind::Capsule, Kind::Plane}) {
        const TriangleMesh mesh = make_triangle_mesh(gprim_shape(kind));
        ASSERT_TRUE(mesh.has_normals());
        for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
            const Vec3d a(mesh.corner(t, 0)), b(mesh.corner(t, 1)), c(mesh.corner(t, 2));
            const Vec3d ng = (b - a).cross(c - a).normalized();
            const Vec3d center = (a + b + c) / 3;
            // Every one of these bodies is convex around the origin
            if (kind != Kind::Plane) {
                EXPECT_GT(ng.dot(center), 0.0);
            }
            for (int k = 0; k < 3; ++k) {
                const Vec3d n = mesh.normal(t, k == 1 ? 1.0f : 0.0f, k == 2 ? 1.0f : 0.0f);
                EXPECT_NEAR(n.length(), 1.0, 1e-6);
                EXPECT_GT(n.dot(ng), 0.98);
                if (kind == Kind::Sphere) {
                    EXPECT_NEAR((n - Vec3d(mesh.corner(t, k)) / 1.5).length(), 0.0, 1e-6);
                }
            }
        }
    }
}

TEST(Gprims, AreClosed) {
    for (const Kind kind : {Kind::Sphere, Kind::Cube, Kind::Cylinder, Kind::Cone, Kind::Capsule}) {
        scene::Shape shape = gprim_shape(kind);
        auto& gprim = std::get<scene::Gprim>(shape.geometry);
        gprim.shape_from_gprim =
            Mat4d(0.3, 1.1, 0.2, 0, -1.7, 0.4, 0.1, 0, 0.2, 0.3, 0.9, 0, 5.3, -7.7, 123.4, 1);
        const TriangleMesh mesh = make_triangle_mesh(shape);
        // Sum over directed edges of a key and its reverse vanishes when each edge meets its twin
        Vec3d area(0.0);
        std::vector<std::array<float, 6>> edges;
        for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
            const Vec3d a(mesh.corner(t, 0)), b(mesh.corner(t, 1)), c(mesh.corner(t, 2));
            area += (b - a).cross(c - a);
            for (int k = 0; k < 3; ++k) {
                const Vec3 p = mesh.corner(t, k), q = mesh.corner(t, (k + 1) % 3);
                edges.push_back({p.x, p.y, p.z, q.x, q.y, q.z});
            }
        }
        EXPECT_NEAR(area.length(), 0.0, 1e-9);
        std::vector<std::array<float, 6>> twins;
        for (const auto& e : edges) twins.push_back({e[3], e[4], e[5], e[0], e[1], e[2]});
        std::sort(edges.begin(), edges.end());
        std::sort(twins.begin(), twins.end());
        EXPECT_TRUE(edges == twins) << int(kind);
    }
}

TEST(Gprims, ScalingByPowersOfTwoScalesEveryBit) {
    for (const Kind kind : {Kind::Sphere, Kind::Cone, Kind::Capsule, Kind::Cylinder}) {
        scene::Shape shape = gprim_shape(kind);
        auto& gprim = std::get<scene::Gprim>(shape.geometry);
        gprim.shape_from_gprim =
            Mat4d(0.3, 1.1, 0.2, 0, 0.7, 0.4, 0.1, 0, 0.2, 0.3, 0.9, 0, 5.3, -7.7, 3.4, 1);
        const TriangleMesh one = make_triangle_mesh(shape);
        for (const int k : {-20, 20}) {
            scene::Shape scaled = shape;
            auto& m = std::get<scene::Gprim>(scaled.geometry).shape_from_gprim;
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 3; ++j) m[i][j] = std::ldexp(m[i][j], k);
            const TriangleMesh two = make_triangle_mesh(scaled);
            ASSERT_EQ(one.triangle_count(), two.triangle_count());
            for (uint32_t t = 0; t < one.triangle_count(); ++t) {
                for (int c = 0; c < 3; ++c)
                    for (int i = 0; i < 3; ++i)
                        ASSERT_EQ(std::ldexp(one.corner(t, c)[i], k), two.corner(t, c)[i]);
                ASSERT_EQ(one.normal(t, 0.25f, 0.5f), two.normal(t, 0.25f, 0.5f));
            }
        }
    }
}

TEST(Gprims, MirroredMatrixKeepsNormalsOutside) {
    scene::Shape shape = gprim_shape(Kind::Sphere);
    auto& gprim = std::get<scene::Gprim>(shape.geometry);
    gprim.shape_from_gprim[0][0] = -2.0;
    const TriangleMesh mesh = make_triangle_mesh(shape);
    EXPECT_LT(measure(mesh).volume, 0.0);  // the winding turns; Shape::flip_normals makes up for it
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t)
        EXPECT_GT(mesh.normal(t, 0.3f, 0.3f).dot(Vec3d(mesh.corner(t, 0))), 0.0);
}

}  // namespace velatura::geometry
