// SPDX-License-Identifier: Apache-2.0
// What faces share: points of their edges to the bit, whatever their rates; what they do not:
// normals at sharp edges, face-varying numbers at seams.
#include "base/tasks.h"
#include "cages.h"
#include "hard_case.h"
#include "leaks.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <opensubdiv/version.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace velatura::subdivision::test {
namespace {

using geometry::DicedMesh;
using geometry::TriangleMeshData;
using scene::Interpolation;

class Sharing : public testing::Test {
  protected:
    void SetUp() override {
        if (open_subdivider() == nullptr) GTEST_SKIP() << "built without the plugin subdivision";
    }
};

DicedMesh dice_unevenly(const scene::Mesh& mesh, uint32_t max, uint64_t seed) {
    const auto surface = open_subdivider()->make(mesh, true);
    const auto rates = uneven_rates((*surface)->edge_count(), max, seed);
    return *(*surface)->dice(rates);
}

TEST_F(Sharing, ClosedCagesStayClosedWhateverTheRates) {
    for (const Cage& cage : closed_cages())
        for (uint64_t seed = 0; seed < 8; ++seed) {
            const DicedMesh diced = dice_unevenly(cage.mesh, seed < 4 ? 7 : 64, seed);
            EXPECT_EQ(open_edges(diced.data), 0u) << cage.name << " " << seed;
        }
}

using H13Subdivision = Sharing;

TEST_F(H13Subdivision, NoRayLeaksBetweenRatesOfOneAndSixtyFour) {
    const std::vector<Cage> cages = closed_cages();
    const size_t rays = hardcase::sized(200'000, 100'000'000, 1'000'000'000) / cages.size();
    accel::test::LeakCount all;
    for (const Cage& cage : cages) {
        DicedMesh diced = dice_unevenly(cage.mesh, 64, 5);
        accel::test::ClosedMesh mesh;
        mesh.name = cage.name;
        mesh.soup.positions = std::move(diced.data.positions);
        mesh.soup.triangles = std::move(diced.data.triangles);
        mesh.eye = Vec3(0.11f, -0.07f, 0.05f);
        all += accel::test::count_leaks(mesh, rays);
    }
    EXPECT_GT(all.rays, 0u);
    hardcase::expect_within(
        {fmt::format("leaks of {} rays at edges between rates of 1 and 64", all.rays),
         double(all.misses + all.unseen), 0, 0, "a closed surface has no gaps",
         fmt::format("a share of {:.1g}", 3.0 / double(all.rays))});
}

TEST_F(Sharing, TwinsAreOnePointAndLeadersAreNoTwins) {
    for (const Cage& cage : all_cages()) {
        const DicedMesh diced = dice_unevenly(cage.mesh, 9, 3);
        std::vector<bool> is_twin(diced.data.positions.size());
        for (const auto& [twin, leader] : diced.twins) is_twin[twin] = true;
        for (const auto& [twin, leader] : diced.twins) {
            EXPECT_FALSE(is_twin[leader]);
            EXPECT_EQ(diced.data.positions[twin], diced.data.positions[leader]);
        }
    }
}

TEST_F(Sharing, ThreadsChangeNoBit) {
    for (const Cage& cage : all_cages()) {
        DicedMesh one, many;
        {
            const ThreadLimit limit(1);
            one = dice_unevenly(cage.mesh, 40, 1);
        }
        {
            const ThreadLimit limit(4);
            many = dice_unevenly(cage.mesh, 40, 1);
        }
        EXPECT_EQ(one.data.positions, many.data.positions);
        EXPECT_EQ(one.data.normals, many.data.normals);
        EXPECT_EQ(one.data.triangles, many.data.triangles);
        EXPECT_EQ(one.data.faces, many.data.faces);
    }
}

scene::Primvar points_as(const scene::Mesh& mesh, Interpolation interpolation) {
    scene::Primvar primvar;
    primvar.name = 0;
    primvar.interpolation = interpolation;
    primvar.width = 3;
    for (const Vec3& p : mesh.points) primvar.values.insert(primvar.values.end(), {p.x, p.y, p.z});
    if (interpolation == Interpolation::FaceVarying) primvar.indices = mesh.face_vertex_indices;
    return primvar;
}

double largest_difference(const DicedMesh& diced, const scene::Primvar& primvar) {
    double worst = 0;
    for (size_t v = 0; v < diced.data.positions.size(); ++v)
        for (size_t k = 0; k < 3; ++k)
            worst = hardcase::larger(worst, std::abs(double(primvar.values[3 * v + k] -
                                                            diced.data.positions[v][int(k)])));
    return worst;
}

// What has the numbers of the points and their rules follows the surface.
TEST_F(Sharing, PrimvarsFollowTheRulesOfTheSurface) {
    for (const Cage& cage : all_cages()) {
        if (!cage.mesh.rules.creases.empty()) continue;  // sharpness is the vertices' alone
        scene::Mesh mesh = cage.mesh;
        mesh.rules.face_varying = mesh.rules.boundary == scene::BoundaryInterpolation::EdgeOnly
                                      ? scene::FaceVaryingInterpolation::None
                                      : scene::FaceVaryingInterpolation::CornersOnly;
        mesh.primvars = {points_as(mesh, Interpolation::Vertex),
                         points_as(mesh, Interpolation::FaceVarying)};
        const DicedMesh diced = dice(mesh, 5);
        ASSERT_EQ(diced.data.primvars.size(), 2u);
        for (const scene::Primvar& primvar : diced.data.primvars) {
            EXPECT_EQ(primvar.interpolation, Interpolation::Vertex);
            EXPECT_LT(largest_difference(diced, primvar), 1e-6f) << cage.name;
        }
    }
}

TEST_F(Sharing, VaryingPrimvarsAndTheRuleAllAreLinear) {
    scene::Mesh mesh = cube();
    mesh.rules.face_varying = scene::FaceVaryingInterpolation::All;
    mesh.primvars = {points_as(mesh, Interpolation::Varying),
                     points_as(mesh, Interpolation::FaceVarying)};
    const DicedMesh diced = dice(mesh, 4);
    // Linear over the faces of a cube: on the cube itself, unlike the surface
    for (const scene::Primvar& primvar : diced.data.primvars)
        for (size_t v = 0; v < diced.data.positions.size(); ++v) {
            const float* p = &primvar.values[3 * v];
            EXPECT_NEAR(std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])}), 1.0f, 1e-6f);
        }
}

// Corners without indices belong to nobody else: both sides of every edge keep their own numbers.
TEST_F(Sharing, SeamsKeepBothSides) {
    scene::Mesh mesh = cube();
    scene::Primvar st;
    st.name = 0;
    st.interpolation = Interpolation::FaceVarying;
    st.width = 2;
    for (int face = 0; face < 6; ++face)
        for (const auto& [s, t] : {std::array{0.f, 0.f}, {1.f, 0.f}, {1.f, 1.f}, {0.f, 1.f}})
            st.values.insert(st.values.end(), {s + 2.0f * float(face), t});
    mesh.primvars = {st};
    const DicedMesh diced = dice(mesh, 3);
    EXPECT_EQ(open_edges(diced.data), 0u);
    for (size_t i = 0; i < diced.data.triangles.size(); ++i)
        for (const uint32_t v : diced.data.triangles[i]) {
            const float s =
                diced.data.primvars[0].values[2 * v] - 2.0f * float(diced.data.faces[i]);
            EXPECT_GE(s, -1e-6f);
            EXPECT_LE(s, 1.0f + 1e-6f);
        }
    // The surface is smooth across: twins have one normal
    for (const auto& [twin, leader] : diced.twins)
        EXPECT_GT(diced.data.normals[twin].dot(diced.data.normals[leader]), 0.99999f);
}

TEST_F(Sharing, KeysOfMotionAreSurfacesOfTheirOwn) {
    scene::Mesh moving = closed_cages()[5].mesh, later = moving;
    for (Vec3& p : later.points) p = Vec3(p.y, p.z * 2.0f, -p.x) + Vec3(0.5f);
    moving.later_points = {later.points};
    const DicedMesh both = dice(moving, 6), second = dice(later, 6);
    ASSERT_EQ(both.data.later_positions.size(), 1u);
    EXPECT_EQ(both.data.later_positions[0], second.data.positions);
    EXPECT_EQ(both.data.later_normals[0], second.data.normals);
    EXPECT_TRUE(dice(moving, 6, true).data.later_positions.empty());
}

TEST_F(Sharing, HolesAreNotThere) {
    const scene::Mesh whole = grid(3, 3);
    scene::Mesh pierced = whole;
    pierced.rules.holes = {4};
    const DicedMesh a = dice(whole, 2), b = dice(pierced, 2);
    EXPECT_EQ(b.data.triangles.size(), a.data.triangles.size() * 8 / 9);
    EXPECT_EQ(std::count(b.data.faces.begin(), b.data.faces.end(), 4u), 0);
    // Without interpolateBoundary only the face in the middle has all that it needs
    scene::Mesh inner = whole;
    inner.rules.boundary = scene::BoundaryInterpolation::None;
    const DicedMesh c = dice(inner, 2);
    EXPECT_EQ(c.data.triangles.size() * 9, a.data.triangles.size());
}

std::string complaint_about(const scene::Mesh& mesh) {
    const auto surface = open_subdivider()->make(mesh, true);
    return surface ? "" : surface.error().message;
}

TEST_F(Sharing, WhatIsNoSurfaceIsRefused) {
    using enum scene::SubdivisionScheme;
    scene::Mesh quads = cube();
    quads.subdivision = Loop;
    EXPECT_NE(complaint_about(quads).find("loop needs triangles"), std::string::npos);
    // A corner twice in a face
    const scene::Mesh folded =
        make_cage(CatmullClark, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, {{0, 1, 2, 1}});
    EXPECT_NE(complaint_about(folded).find("a vertex twice"), std::string::npos);
    // Points that no face uses may be anything
    scene::Mesh loose = cube();
    loose.points.emplace_back(std::nanf(""));
    EXPECT_EQ(complaint_about(loose), "");
    for (const Vec3& p : dice(loose, 3).data.positions) EXPECT_TRUE(is_finite(p));
}

TEST_F(Sharing, CreasesWhereFacesMeetAlongTwoEdgesAreLeftToALaterOpenSubdiv) {
    // Vertex 3 is inside and has two faces only
    scene::Mesh pocket = make_cage(scene::SubdivisionScheme::CatmullClark,
                                   {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0.5f, 0.5f, 1}, {0, 1, 0}},
                                   {{0, 1, 2, 3}, {4, 0, 3, 2}});
    EXPECT_EQ(complaint_about(pocket), "");
    // At the boundary a crease changes nothing, and a weight of 0 makes none
    pocket.rules.creases = {{0, 1}, {3, 0}};
    pocket.rules.crease_sharpnesses = {2.0f, 0.0f};
    EXPECT_EQ(complaint_about(pocket), "");
    pocket.rules.crease_sharpnesses = {2.0f, 2.0f};
    if (OPENSUBDIV_VERSION_NUMBER >= 30501)
        EXPECT_EQ(complaint_about(pocket), "");
    else
        EXPECT_NE(complaint_about(pocket).find("needs OpenSubdiv 3.5.1"), std::string::npos);
    // Elsewhere it does no harm
    scene::Mesh beside = cube();
    beside.rules.creases = {{0, 1}};
    beside.rules.crease_sharpnesses = {2.0f};
    EXPECT_EQ(complaint_about(beside), "");
}

}  // namespace
}  // namespace velatura::subdivision::test
