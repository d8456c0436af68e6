// SPDX-License-Identifier: Apache-2.0
// Displacement of refined and of plain meshes: how far, which way, without a crack, with the
// normals of what comes out.
#include "geometry/displacement.h"

#include "cages.h"
#include "geometry/refinement.h"
#include "hard_case.h"
#include "leaks.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <mutex>
#include <string>

namespace velatura::subdivision::test {
namespace {

using geometry::DicedMesh;
using geometry::SurfacePoint;
using geometry::TriangleMeshData;

/// Moves every material by a function of the place.
class TestDisplacer final : public geometry::Displacer {
  public:
    explicit TestDisplacer(std::function<float(const SurfacePoint&)> amount)
        : amount_(std::move(amount)) {}

    bool displaces(scene::MaterialId) const override { return true; }

    float displacement(const SurfacePoint& point, float) const override { return amount_(point); }

  private:
    std::function<float(const SurfacePoint&)> amount_;
};

Vec3 place_of(const SurfacePoint& point) {
    const int k = point.b1 > 0.5f ? 1 : point.b2 > 0.5f ? 2 : 0;
    return point.mesh->corner(point.triangle, k);
}

scene::Shape shape_of(scene::Mesh mesh) {
    scene::Shape shape;
    shape.geometry = std::move(mesh);
    return shape;
}

/// Squares, each with the whole of a texture of its own: seams everywhere.
scene::Primvar seams(const scene::Mesh& mesh) {
    scene::Primvar st;
    st.name = 0;
    st.interpolation = scene::Interpolation::FaceVarying;
    st.width = 2;
    for (size_t f = 0; f < mesh.face_vertex_counts.size(); ++f)
        for (uint32_t i = 0; i < mesh.face_vertex_counts[f]; ++i) {
            const float angle = 2.0f * pi * float(i) / float(mesh.face_vertex_counts[f]);
            st.values.insert(st.values.end(), {std::cos(angle), std::sin(angle) + 3.0f * float(f)});
        }
    return st;
}

/// Differs between the two sides of a seam.
float bumps(const SurfacePoint& point) {
    float st[4] = {};
    point.mesh->primvar(0, point.triangle, point.b1, point.b2, st);
    return 0.05f + 0.04f * std::sin(9.0f * st[0]) * std::cos(7.0f * st[1]);
}

class Displacement : public testing::Test {
  protected:
    void SetUp() override {
        if (open_subdivider() == nullptr) GTEST_SKIP() << "built without the plugin subdivision";
    }

    static TriangleMeshData moved(const scene::Mesh& mesh,
                                  const std::vector<uint32_t>& rates,
                                  const geometry::Displacer& displacer) {
        const auto surface = open_subdivider()->make(mesh, false);
        DicedMesh diced = *(*surface)->dice(rates);
        return geometry::displaced(std::move(diced.data), diced.twins, shape_of(mesh), displacer);
    }

    static uint32_t edge_count(const scene::Mesh& mesh) {
        return (*open_subdivider()->make(mesh, true))->edge_count();
    }
};

TEST_F(Displacement, MovesAlongTheLimitNormal) {
    const TestDisplacer constant([](const SurfacePoint&) { return 0.25f; });
    for (const Cage& cage : all_cages()) {
        if (!cage.is_smooth || cage.mesh.subdivision == scene::SubdivisionScheme::Bilinear)
            continue;
        const DicedMesh before = dice(cage.mesh, 6);
        const TriangleMeshData after =
            moved(cage.mesh, std::vector<uint32_t>(edge_count(cage.mesh), 6), constant);
        for (size_t v = 0; v < after.positions.size(); ++v) {
            const Vec3 step = after.positions[v] - before.data.positions[v];
            EXPECT_LT((step - before.data.normals[v] * 0.25f).length(), 1e-6f) << cage.name;
        }
    }
}

// Materials may ask where they are (a node graph that reads positions)
TEST_F(Displacement, SaysWhereItAsks) {
    const Cage cage = all_cages().front();
    size_t wrong_places = 0, wrong_normals = 0;
    std::mutex mutex;
    const TestDisplacer asks([&](const SurfacePoint& point) {
        const std::lock_guard lock(mutex);
        const Vec3d n = point.mesh->normal(point.triangle, point.b1, point.b2);
        wrong_places += point.p == place_of(point) ? 0 : 1;
        wrong_normals += (Vec3d(point.ns) - n / n.length()).length() < 1e-6 ? 0 : 1;
        return 0.1f;
    });
    moved(cage.mesh, std::vector<uint32_t>(edge_count(cage.mesh), 3), asks);
    EXPECT_EQ(wrong_places, 0u);
    EXPECT_EQ(wrong_normals, 0u);
}

using H13Displacement = Displacement;

TEST_F(H13Displacement, LeavesNoCrackAtSeamsCreasesAndUnevenRates) {
    const std::vector<Cage> cages = closed_cages();
    const size_t rays = hardcase::sized(200'000, 100'000'000, 1'000'000'000) / cages.size();
    const TestDisplacer displacer(bumps);
    accel::test::LeakCount all;
    for (const Cage& cage : cages) {
        scene::Mesh mesh = cage.mesh;
        mesh.primvars = {seams(mesh)};
        TriangleMeshData data = moved(mesh, uneven_rates(edge_count(mesh), 64, 11), displacer);
        EXPECT_EQ(open_edges(data), 0u) << cage.name;
        accel::test::ClosedMesh closed;
        closed.name = cage.name;
        closed.soup.positions = std::move(data.positions);
        closed.soup.triangles = std::move(data.triangles);
        closed.eye = Vec3(0.11f, -0.07f, 0.05f);
        all += accel::test::count_leaks(closed, rays);
    }
    EXPECT_GT(all.rays, 0u);
    hardcase::expect_within(
        {fmt::format("leaks of {} rays at displaced seams and creases", all.rays),
         double(all.misses + all.unseen), 0, 0, "a closed surface has no gaps",
         fmt::format("a share of {:.1g}", 3.0 / double(all.rays))});
}

TEST_F(Displacement, MakesNormalsOfWhatComesOut) {
    // A wave over a flat sheet, whose seams must not show
    scene::Mesh sheet = grid(3, 3);
    for (Vec3& p : sheet.points) p.z = 0;
    sheet.primvars = {seams(sheet)};
    const TestDisplacer wave(
        [](const SurfacePoint& p) { return 0.2f * std::sin(3.0f * place_of(p).x); });
    const TriangleMeshData data = moved(sheet, std::vector<uint32_t>(edge_count(sheet), 64), wave);
    double worst = 1;
    for (size_t v = 0; v < data.positions.size(); ++v) {
        const double slope = 0.6 * std::cos(3.0 * double(data.positions[v].x));
        const Vec3d n = Vec3d(-slope, 0, 1).normalized();
        worst = std::min(worst, n.dot(Vec3d(data.normals[v])));
        EXPECT_NEAR(double(data.positions[v].z), 0.2 * std::sin(3.0 * double(data.positions[v].x)),
                    1e-6);
    }
    EXPECT_GT(worst, std::cos(0.02));
}

TEST_F(Displacement, IsMeasuredWhereTheImageIs) {
    scene::Mesh sheet = grid(2, 2);
    for (Vec3& p : sheet.points) p.z = 0;
    const TestDisplacer constant([](const SurfacePoint&) { return 0.3f; });
    Mat4d placed;
    placed.setScale(Vec3d(2, 0.5, 3));
    for (const double mirror : {1.0, -1.0})
        for (const bool is_flipped : {false, true}) {
            scene::Shape shape = shape_of(sheet);
            shape.flip_normals = is_flipped;
            placed[0][0] = 2.0 * mirror;
            DicedMesh diced = dice(sheet, 2);
            const TriangleMeshData data =
                geometry::displaced(std::move(diced.data), diced.twins, shape, constant, placed);
            for (const Vec3& p : data.positions) EXPECT_NEAR(p.z, is_flipped ? -0.1f : 0.1f, 1e-6f);
        }
}

TEST_F(Displacement, FollowsEveryKeyOfMotion) {
    scene::Mesh moving = cube(), later = moving;
    for (Vec3& p : later.points) p = Vec3(p.y, p.z * 2.0f, -p.x) + Vec3(0.5f);
    moving.later_points = {later.points};
    const TestDisplacer constant([](const SurfacePoint&) { return -0.1f; });
    const auto rates = std::vector<uint32_t>(edge_count(moving), 5);
    // The winding turns with the points
    const TriangleMeshData both = moved(moving, rates, constant);
    const TriangleMeshData second = moved(later, rates, constant);
    ASSERT_EQ(both.later_positions.size(), 1u);
    EXPECT_EQ(both.later_positions[0], second.positions);
    EXPECT_EQ(both.later_normals[0], second.normals);
}

TEST_F(Displacement, OfPolygonsMovesTheirPointsWithAWarning) {
    scene::Scene scene;
    scene::Mesh box = cube();
    box.subdivision = scene::SubdivisionScheme::None;
    box.primvars = {seams(box)};
    scene.shapes.push_back(shape_of(box));
    const TestDisplacer constant([](const SurfacePoint&) { return 0.3f; });
    scene::Camera camera;
    Diagnostics diagnostics;
    geometry::Refinement refined = geometry::refine(
        scene, {nullptr, &constant}, {}, geometry::DicingView(camera, 9, 9), diagnostics);
    EXPECT_EQ(diagnostics.warning_count(), 1u);
    EXPECT_EQ(refined.stats.displaced, 1u);
    const TriangleMeshData& data = **refined.find(scene::none, 0);
    EXPECT_EQ(data.triangles.size(), 12u);
    EXPECT_TRUE(data.normals.empty());
    EXPECT_EQ(open_edges(data), 0u);
    for (size_t v = 0; v < 8; ++v) {
        const Vec3 away = normalize(box.points[v]);
        EXPECT_LT((data.positions[v] - box.points[v] - away * 0.3f).length(), 1e-6f);
    }
}

}  // namespace
}  // namespace velatura::subdivision::test
