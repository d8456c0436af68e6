// SPDX-License-Identifier: Apache-2.0
// Faces that lie in a plane need two triangles, whatever they cover of the image; every other face
// keeps those that its edges ask for.
#include "geometry/flat_faces.h"

#include "cages.h"
#include "geometry/dicing.h"
#include "geometry/displacement.h"
#include "geometry/geometry_set.h"
#include "geometry/refinement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace velatura::subdivision::test {
namespace {

using geometry::DicingView;
using geometry::TriangleMeshData;
using scene::SubdivisionScheme;

class RaisingDisplacer final : public geometry::Displacer {
  public:
    bool displaces(scene::MaterialId) const override { return true; }

    float displacement(const geometry::SurfacePoint&, float) const override { return 0.1f; }
};

class FlatFaces : public testing::Test {
  protected:
    void SetUp() override {
        subdivider_ = open_subdivider();
        if (subdivider_ == nullptr) GTEST_SKIP() << "built without the plugin subdivision";
    }

    /// The mesh as the only one of a scene whose camera stands at the origin and looks along −z,
    /// one unit wide at distance 1, 200 pixels.
    TriangleMeshData refined(scene::Mesh mesh,
                             const geometry::Displacer* displacer = nullptr,
                             scene::MeshLightId light = scene::none) {
        scene::Scene scene;
        scene::Shape& shape = scene.shapes.emplace_back();
        shape.light = light;
        if (light != scene::none) scene.mesh_lights.resize(light + 1);
        shape.geometry = std::move(mesh);
        scene::Camera camera;
        camera.window_left = camera.window_bottom = -0.5;
        camera.window_right = camera.window_top = 0.5;
        geometry::Refinement out = geometry::refine(scene, {subdivider_, displacer}, {},
                                                    DicingView(camera, 200, 200), diagnostics_);
        return **out.find(scene::none, 0);
    }

    /// Triangles that edges ask for by their length in the image alone.
    uint64_t asked_for(const scene::Mesh& mesh) {
        scene::Camera camera;
        camera.window_left = camera.window_bottom = -0.5;
        camera.window_right = camera.window_top = 0.5;
        const auto surface = subdivider_->make(mesh, false);
        return geometry::estimated_triangles(
            mesh, **surface,
            geometry::edge_rates(mesh, **surface, DicingView(camera, 200, 200), Mat4d(), 1.0));
    }

    const geometry::Subdivider* subdivider_ = nullptr;
    Diagnostics diagnostics_;
};

/// A ground of n × n quads below the camera, at the height that `height` adds to −2.
scene::Mesh ground(
    uint32_t n,
    const std::function<float(float, float)>& height = [](float, float) { return 0.0f; }) {
    std::vector<Vec3> points;
    std::vector<std::vector<uint32_t>> faces;
    for (uint32_t j = 0; j <= n; ++j)
        for (uint32_t i = 0; i <= n; ++i) {
            const float x = 20.0f * float(i) / float(n) - 10.0f;
            const float z = 20.0f * float(j) / float(n) - 10.0f;
            points.emplace_back(x, height(x, z) - 2.0f, z);
        }
    for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t a = j * (n + 1) + i;
            faces.push_back({a, a + n + 1, a + n + 2, a + 1});
        }
    return make_cage(SubdivisionScheme::CatmullClark, std::move(points), faces);
}

/// Rows of two numbers by vertex: a function of the place.
void add_vertex_primvar(scene::Mesh& mesh, const std::function<float(const Vec3&)>& value) {
    scene::Primvar& primvar = mesh.primvars.emplace_back();
    primvar.name = 0;
    primvar.interpolation = scene::Interpolation::Vertex;
    primvar.width = 2;
    for (const Vec3& p : mesh.points)
        primvar.values.insert(primvar.values.end(), {value(p), 3.0f * value(p) - p.x});
}

double area(const TriangleMeshData& data) {
    double sum = 0;
    for (const auto& t : data.triangles) {
        const Vec3d p(data.positions[t[0]]);
        sum +=
            0.5 * (Vec3d(data.positions[t[1]]) - p).cross(Vec3d(data.positions[t[2]]) - p).length();
    }
    return sum;
}

TEST_F(FlatFaces, OneQuadIsTwoTriangles) {
    // 20 units, seen from 2 above: 33.5 million triangles by the length of its edges at 1280 pixels
    EXPECT_GT(asked_for(ground(1)), 100'000u);
    scene::Mesh mesh = ground(1);
    add_vertex_primvar(mesh, [](const Vec3& p) { return 0.05f * p.x + 0.1f * p.z; });
    const TriangleMeshData data = refined(mesh);
    ASSERT_EQ(data.triangles.size(), 2u);
    EXPECT_DOUBLE_EQ(area(data), 400.0);
    ASSERT_EQ(data.primvars.size(), 1u);
    for (size_t v = 0; v < data.positions.size(); ++v) {
        const Vec3& p = data.positions[v];
        EXPECT_FLOAT_EQ(data.primvars[0].values[2 * v], 0.05f * p.x + 0.1f * p.z);
        EXPECT_NEAR(std::abs(data.normals[v].y), 1.0f, 1e-6f);
    }
}

TEST_F(FlatFaces, OfAGridAreTheSamePlane) {
    // Faces below the limit of a trial stay as they are: far from all triangles, and no hole
    for (const uint32_t n : {2u, 5u}) {
        scene::Mesh mesh = ground(n);
        add_vertex_primvar(mesh, [](const Vec3& p) { return 0.05f * p.x + 0.1f * p.z; });
        const TriangleMeshData data = refined(mesh);
        EXPECT_LT(data.triangles.size() * 20, asked_for(mesh)) << n;
        EXPECT_NEAR(area(data), 400.0, 400.0 * 1e-6) << n;
    }
}

TEST_F(FlatFaces, BentOnesKeepTheirTriangles) {
    const auto bent = [](float x, float z) { return 1e-3f * x * z; };
    for (const uint32_t n : {1u, 4u}) {
        const scene::Mesh mesh = ground(n, bent);
        EXPECT_GT(refined(mesh).triangles.size() * 10, asked_for(mesh) * 9) << n;
    }
}

TEST_F(FlatFaces, NumbersThatBendKeepTheirTriangles) {
    scene::Mesh mesh = ground(1);
    add_vertex_primvar(mesh, [](const Vec3& p) { return p.x * p.z; });
    EXPECT_GT(refined(mesh).triangles.size() * 10, asked_for(mesh) * 9);
}

TEST_F(FlatFaces, RoundOutlinesKeepTheirTriangles) {
    // Without sharp corners the border of a quad is a closed B-spline in its plane
    scene::Mesh mesh = ground(1);
    mesh.rules.boundary = scene::BoundaryInterpolation::EdgeOnly;
    const TriangleMeshData data = refined(mesh);
    EXPECT_GT(data.triangles.size() * 10, asked_for(mesh) * 9);
    EXPECT_LT(area(data), 300.0);
}

TEST_F(FlatFaces, WhatMovesOrIsDisplacedKeepsItsTriangles) {
    const RaisingDisplacer displacer;
    const scene::Mesh still = ground(1);
    EXPECT_GT(refined(still, &displacer).triangles.size() * 10, asked_for(still) * 9);
    scene::Mesh moves = still;
    moves.later_points = {moves.points};
    EXPECT_GT(refined(moves).triangles.size() * 10, asked_for(still) * 9);
}

// Light is sampled triangle by triangle, by the mean of each: a bright spot of an emission texture
// on one quad wants small ones
TEST_F(FlatFaces, LightsKeepTheirTriangles) {
    EXPECT_GT(refined(ground(1), nullptr, 0).triangles.size(),
              100 * refined(ground(1)).triangles.size());
}

TEST_F(FlatFaces, BesideBentOnesLeaveNoCrack) {
    // A box with sharp edges, 4 quads to a side; one side is pulled out
    const auto cage_of = [](float bulge) {
        std::vector<Vec3> points;
        std::vector<std::vector<uint32_t>> faces;
        const auto point = [&](const Vec3& p) {
            const auto at = std::find(points.begin(), points.end(), p);
            if (at != points.end()) return uint32_t(at - points.begin());
            points.push_back(p);
            return uint32_t(points.size() - 1);
        };
        for (int axis = 0; axis < 3; ++axis)
            for (const float sign : {-1.0f, 1.0f})
                for (int j = 0; j < 2; ++j)
                    for (int i = 0; i < 2; ++i) {
                        std::vector<uint32_t> face;
                        for (const auto& [du, dv] :
                             {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)}) {
                            Vec3 p;
                            p[axis] = sign;
                            p[(axis + 1) % 3] = float(i + du) - 1.0f;
                            p[(axis + 2) % 3] = float(j + dv) - 1.0f;
                            face.push_back(point(p));
                        }
                        if (sign < 0) std::reverse(face.begin(), face.end());
                        faces.push_back(face);
                    }
        scene::Mesh box = make_cage(SubdivisionScheme::CatmullClark, points, faces);
        const auto is_on_edge = [&](uint32_t v) {
            const Vec3 p = points[v];
            return int(std::abs(p.x) == 1.0f) + int(std::abs(p.y) == 1.0f) +
                       int(std::abs(p.z) == 1.0f) >=
                   2;
        };
        for (const auto& face : faces)
            for (size_t k = 0; k < 4; ++k) {
                const uint32_t a = face[k], b = face[(k + 1) % 4];
                const Vec3 middle = (points[a] + points[b]) * 0.5f;
                const int outer = int(std::abs(middle.x) == 1.0f) +
                                  int(std::abs(middle.y) == 1.0f) + int(std::abs(middle.z) == 1.0f);
                if (a < b && outer == 2 && is_on_edge(a) && is_on_edge(b))
                    box.rules.creases.push_back({a, b});
            }
        box.rules.crease_sharpnesses.assign(box.rules.creases.size(), 10.0f);
        for (Vec3& p : box.points) {
            if (p == Vec3(0, 1, 0)) p.y += bulge;
            p += Vec3(0, -1.5f, -3.0f);
        }
        return box;
    };
    const scene::Mesh flat = cage_of(0.0f), pulled = cage_of(0.5f);
    const size_t of_flat = refined(flat).triangles.size();
    const TriangleMeshData data = refined(pulled);
    EXPECT_LT(of_flat * 20, asked_for(flat));
    EXPECT_GT(data.triangles.size(), 20 * of_flat);
    EXPECT_LT(data.triangles.size() * 2, asked_for(pulled));
    EXPECT_EQ(open_edges(data), 0u);
}

}  // namespace
}  // namespace velatura::subdivision::test
