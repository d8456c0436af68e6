// SPDX-License-Identifier: Apache-2.0
#include "geometry/tessellate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace velatura::geometry {

namespace {

using Triangles = std::vector<std::array<uint32_t, 3>>;

/// Signed shoelace area of a polygon in the xy plane.
double shoelace(const std::vector<Vec3>& p) {
    double twice = 0;
    for (size_t i = 0; i < p.size(); ++i) {
        const Vec3 &a = p[i], &b = p[(i + 1) % p.size()];
        twice += double(a.x) * double(b.y) - double(b.x) * double(a.y);
    }
    return twice / 2;
}

/// Sum of triangle areas and sum of their absolute values: equal iff no triangle is turned over.
std::pair<double, double> areas(const std::vector<Vec3>& p, const Triangles& triangles) {
    double sum = 0, absolute = 0;
    for (const auto& t : triangles) {
        const double a = shoelace({p[t[0]], p[t[1]], p[t[2]]});
        sum += a;
        absolute += std::abs(a);
    }
    return {sum, absolute};
}

/// Plane coordinates with an exact rotation of axes, so that each dominant axis is met.
Vec3 turned(const Vec3& p, int axis) {
    return {p[(3 - axis) % 3], p[(4 - axis) % 3], p[(5 - axis) % 3]};
}

}  // namespace

TEST(Triangulate, ConcavePolygonsKeepTheirArea) {
    const std::vector<std::vector<Vec3>> polygons = {
        {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {2, 1, 0}, {0, 4, 0}},             // arrow notch
        {{0, 0, 0}, {2, 1, 0}, {4, 0, 0}, {2, 4, 0}},                        // dart
        {{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}},  // L
        {{0, 0, 0},
         {6, 0, 0},
         {6, 6, 0},
         {0, 6, 0},
         {0, 0, 0},
         {2, 2, 0},
         {2, 4, 0},
         {4, 4, 0},
         {4, 2, 0},
         {2, 2, 0}},                                                         // keyhole
        {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 2, 0}, {0, 2, 0}},  // straight corners
    };
    for (const auto& polygon : polygons) {
        for (int axis = 0; axis < 3; ++axis) {
            for (const bool reversed : {false, true}) {
                std::vector<Vec3> flat = polygon;
                if (reversed) std::reverse(flat.begin(), flat.end());
                std::vector<Vec3> placed;
                for (const Vec3& p : flat) placed.push_back(turned(p, axis));
                Triangles triangles;
                triangulate_polygon(placed, triangles);
                EXPECT_EQ(triangles.size(), polygon.size() - 2);
                const auto [sum, absolute] = areas(flat, triangles);
                EXPECT_EQ(sum, shoelace(flat));
                EXPECT_EQ(absolute, std::abs(shoelace(flat)));
            }
        }
    }
}

TEST(Triangulate, RandomStarPolygonsKeepTheirArea) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> radius(0.1f, 1.0f);
    for (int trial = 0; trial < 300; ++trial) {
        const int n = 4 + trial % 60;
        std::vector<Vec3> polygon;
        for (int i = 0; i < n; ++i) {
            const float a = 2 * pi * float(i) / float(n), r = radius(random);
            polygon.emplace_back(r * std::cos(a) + 100, r * std::sin(a) - 50, 0.0f);
        }
        Triangles triangles;
        triangulate_polygon(polygon, triangles);
        ASSERT_EQ(triangles.size(), size_t(n - 2));
        const auto [sum, absolute] = areas(polygon, triangles);
        EXPECT_NEAR(sum, shoelace(polygon), 1e-9);
        EXPECT_NEAR(absolute, sum, 1e-9) << trial;
    }
}

TEST(Triangulate, ConvexQuadsTakeTheShorterDiagonal) {
    Triangles triangles;
    triangulate_polygon(std::vector<Vec3>{{0, 0, 0}, {5, 0, 0}, {6, 1, 0}, {1, 1, 0}}, triangles);
    ASSERT_EQ(triangles.size(), 2u);
    EXPECT_EQ(triangles[0], (std::array<uint32_t, 3>{1, 2, 3}));
    triangles.clear();
    triangulate_polygon(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, triangles);
    EXPECT_EQ(triangles[0], (std::array<uint32_t, 3>{0, 1, 2}));
}

TEST(Triangulate, DegenerateFacesVanishAndOthersKeepTheirNumber) {
    scene::Mesh mesh;
    mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.face_vertex_counts = {3, 3, 4};
    mesh.face_vertex_indices = {0, 1, 1, 0, 1, 2, 0, 1, 2, 3};
    scene::Shape shape;
    shape.geometry = mesh;
    const TriangleMesh triangles = make_triangle_mesh(shape);
    ASSERT_EQ(triangles.triangle_count(), 3u);
    EXPECT_EQ(triangles.face(0), 1u);
    EXPECT_EQ(triangles.face(1), 2u);
    EXPECT_EQ(triangles.face(2), 2u);
}

}  // namespace velatura::geometry
