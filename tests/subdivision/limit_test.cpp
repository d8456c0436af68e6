// SPDX-License-Identifier: Apache-2.0
// Limit points against closed forms and against another way through OpenSubdiv: uniform refinement
// of the whole mesh, then limit masks at its vertices; no patch is involved there.
#include "cages.h"
#include "hard_case.h"

#include <gtest/gtest.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace velatura::subdivision::test {
namespace {

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

class SubdivisionTest : public testing::Test {
  protected:
    void SetUp() override {
        if (open_subdivider() == nullptr) GTEST_SKIP() << "built without the plugin subdivision";
    }
};

using Limit = SubdivisionTest;

struct Point {
    Vec3d p = Vec3d(0);

    void Clear(void* = nullptr) { p = Vec3d(0); }

    void AddWithWeight(const Point& other, double weight) { p += other.p * weight; }
};

Sdc::Options::VtxBoundaryInterpolation boundary_of(const scene::SubdivisionRules& rules) {
    return rules.boundary == scene::BoundaryInterpolation::EdgeOnly
               ? Sdc::Options::VTX_BOUNDARY_EDGE_ONLY
               : Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER;
}

/// Limit points of the vertices after `level` uniform refinements.
std::vector<Vec3d> uniform_limit(const scene::Mesh& mesh, int level) {
    const std::vector<int> counts(mesh.face_vertex_counts.begin(), mesh.face_vertex_counts.end());
    const std::vector<int> indices(mesh.face_vertex_indices.begin(),
                                   mesh.face_vertex_indices.end());
    const std::vector<int> corners(mesh.rules.corners.begin(), mesh.rules.corners.end());
    const std::vector<int> holes(mesh.rules.holes.begin(), mesh.rules.holes.end());
    std::vector<int> creases;
    for (const auto& [a, b] : mesh.rules.creases) creases.insert(creases.end(), {int(a), int(b)});
    Far::TopologyDescriptor d;
    d.numVertices = int(mesh.points.size());
    d.numFaces = int(counts.size());
    d.numVertsPerFace = counts.data();
    d.vertIndicesPerFace = indices.data();
    d.numCreases = int(mesh.rules.creases.size());
    d.creaseVertexIndexPairs = creases.data();
    d.creaseWeights = mesh.rules.crease_sharpnesses.data();
    d.numCorners = int(corners.size());
    d.cornerVertexIndices = corners.data();
    d.cornerWeights = mesh.rules.corner_sharpnesses.data();
    d.numHoles = int(holes.size());
    d.holeIndices = holes.data();
    using Scheme = scene::SubdivisionScheme;
    const Sdc::SchemeType type = mesh.subdivision == Scheme::Loop       ? Sdc::SCHEME_LOOP
                                 : mesh.subdivision == Scheme::Bilinear ? Sdc::SCHEME_BILINEAR
                                                                        : Sdc::SCHEME_CATMARK;
    Sdc::Options options;
    options.SetVtxBoundaryInterpolation(boundary_of(mesh.rules));
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    const std::unique_ptr<Far::TopologyRefiner> refiner(
        Factory::Create(d, Factory::Options(type, options)));
    Far::TopologyRefiner::UniformOptions uniform(level);
    uniform.fullTopologyInLastLevel = true;
    refiner->RefineUniform(uniform);
    const Far::PrimvarRefinerReal<double> primvars(*refiner);
    std::vector<Point> points(mesh.points.size());
    for (size_t i = 0; i < points.size(); ++i) points[i].p = Vec3d(mesh.points[i]);
    for (int l = 1; l <= level; ++l) {
        std::vector<Point> finer(size_t(refiner->GetLevel(l).GetNumVertices()));
        Point* to = finer.data();
        primvars.Interpolate(l, points.data(), to);
        points = std::move(finer);
    }
    std::vector<Point> limit(points.size());
    Point* to = limit.data();
    primvars.Limit(points.data(), to);
    std::vector<Vec3d> out;
    for (const Point& point : limit) out.push_back(point.p);
    return out;
}

/// The largest distance of a point of `a` from the nearest one of `b`.
double farthest(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
    double worst = 0;
    for (const Vec3d& p : a) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const Vec3d& q : b) nearest = std::min(nearest, (p - q).length2());
        worst = hardcase::larger(worst, nearest);
    }
    return std::sqrt(worst);
}

/// The nearest of all vertices.
double distance_to_vertex(const geometry::DicedMesh& diced, const Vec3d& p) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& q : diced.data.positions) nearest = std::min(nearest, (Vec3d(q) - p).length());
    return nearest;
}

// Ref: Halstead, Kass, DeRose 1993, "Efficient, Fair Interpolation using Catmull-Clark Surfaces".
TEST_F(Limit, CatmullClarkVerticesHaveTheirClosedForm) {
    // Valence 3: (n² v + 4 Σ edges + Σ faces) / (n (n + 5)) of a cube's corner
    const Vec3d v(1, 1, 1), edges = Vec3d(-1, 1, 1) + Vec3d(1, -1, 1) + Vec3d(1, 1, -1);
    const Vec3d faces = Vec3d(-1, -1, 1) + Vec3d(-1, 1, -1) + Vec3d(1, -1, -1);
    const Vec3d corner = (v * 9.0 + edges * 4.0 + faces) / 24.0;
    for (const uint32_t rate : {1u, 2u, 5u})
        EXPECT_LT(distance_to_vertex(dice(cube(), rate), corner), 2e-7);
    // Regular, and on a smooth boundary
    const scene::Mesh bent = grid(4, 4);
    const auto p = [&](int x, int y) { return Vec3d(bent.points[size_t(y * 5 + x)]); };
    const Vec3d inner = (p(2, 2) * 16.0 + (p(1, 2) + p(3, 2) + p(2, 1) + p(2, 3)) * 4.0 + p(1, 1) +
                         p(3, 1) + p(1, 3) + p(3, 3)) /
                        36.0;
    const Vec3d rim = (p(1, 0) + p(2, 0) * 4.0 + p(3, 0)) / 6.0;
    const geometry::DicedMesh diced = dice(bent, 4);
    EXPECT_LT(distance_to_vertex(diced, inner), 5e-7);
    EXPECT_LT(distance_to_vertex(diced, rim), 5e-7);
    EXPECT_EQ(distance_to_vertex(diced, p(0, 0)), 0.0);
}

// Ref: Loop 1987, "Smooth Subdivision Surfaces Based on Triangles".
TEST_F(Limit, LoopVerticesHaveTheirClosedForm) {
    const scene::Mesh mesh = closed_cages()[2].mesh;
    const double n = 4, c = 3.0 / 8.0 + std::cos(2.0 * pi_d / n) / 4.0;
    const double beta = (5.0 / 8.0 - c * c) / n, weight = 1.0 / (n + 3.0 / (8.0 * beta));
    // The neighbors of (1, 0, 0) cancel each other
    const Vec3d limit = Vec3d(1, 0, 0) * (1.0 - n * weight);
    EXPECT_LT(distance_to_vertex(dice(mesh, 3), limit), 2e-7);
}

TEST_F(Limit, PointsAreThoseOfUniformRefinement) {
    for (const Cage& cage : all_cages()) {
        constexpr int level = 5;
        std::vector<Vec3d> diced;
        for (const Vec3& p : dice(cage.mesh, 1u << level).data.positions) diced.emplace_back(p);
        const double distance = farthest(diced, uniform_limit(cage.mesh, level));
        EXPECT_LT(distance, 1e-6) << cage.name;
    }
}

/// Ref: Ericson 2004, "Real-Time Collision Detection", 5.1.5.
double distance_to_triangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const Vec3d ab = b - a, ac = c - a, ap = p - a;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0 && d2 <= 0) return ap.length();
    const Vec3d bp = p - b;
    const double d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0 && d4 <= d3) return bp.length();
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return (p - (a + ab * (d1 / (d1 - d3)))).length();
    const Vec3d cp = p - c;
    const double d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0 && d5 <= d6) return cp.length();
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return (p - (a + ac * (d2 / (d2 - d6)))).length();
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6)
        return (p - (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))))).length();
    const double sum = 1.0 / (va + vb + vc);
    return (p - (a + ab * (vb * sum) + ac * (vc * sum))).length();
}

/// The farthest that points of the fine mesh are off the coarse one.
double chordal_error(const geometry::DicedMesh& coarse, const geometry::DicedMesh& fine) {
    double worst = 0;
    for (const Vec3& p : fine.data.positions) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const auto& [a, b, c] : coarse.data.triangles)
            nearest =
                std::min(nearest, distance_to_triangle(Vec3d(p), Vec3d(coarse.data.positions[a]),
                                                       Vec3d(coarse.data.positions[b]),
                                                       Vec3d(coarse.data.positions[c])));
        worst = hardcase::larger(worst, nearest);
    }
    return worst;
}

using H13Limit = Limit;

TEST_F(H13Limit, ChordalErrorFallsFourfoldWithEachLevel) {
    double before = 0, worst = 0;
    for (int level = 1; level <= 4; ++level) {
        const double error = chordal_error(dice(cube(), 1u << level), dice(cube(), 2u << level));
        if (level > 2) {
            worst = hardcase::larger(worst, std::abs(before / error - 4.0));
        }
        before = error;
    }
    hardcase::expect_within({"factor of the chordal error between levels, less 4", worst, 0.4, 0,
                             "order of the approximation"});
}

TEST_F(Limit, NormalsStandOnTheSurface) {
    for (const Cage& cage : all_cages()) {
        const geometry::DicedMesh diced = dice(cage.mesh, 16);
        const auto& data = diced.data;
        double worst = 1;
        for (const auto& [a, b, c] : data.triangles) {
            const Vec3d pa(data.positions[a]), pb(data.positions[b]), pc(data.positions[c]);
            const Vec3d n = (pb - pa).cross(pc - pa).normalized();
            for (const uint32_t v : {a, b, c}) {
                EXPECT_NEAR(double(data.normals[v].length()), 1.0, 1e-6) << cage.name;
                worst = std::min(worst, n.dot(Vec3d(data.normals[v])));
            }
        }
        // The tip of a cone and soft creases bend a lot within a triangle
        EXPECT_GT(worst, cage.is_smooth ? 0.99 : 0.6) << cage.name;
    }
}

TEST_F(Limit, InfinitelySharpEdgesKeepTheCube) {
    scene::Mesh mesh = cube();
    for (uint32_t a = 0; a < 8; ++a)
        for (const uint32_t bit : {1u, 2u, 4u})
            if (!(a & bit)) mesh.rules.creases.push_back({a, a | bit});
    mesh.rules.crease_sharpnesses.assign(mesh.rules.creases.size(), 10.0f);
    const geometry::DicedMesh diced = dice(mesh, 6);
    EXPECT_EQ(diced.data.triangles.size(), 6u * 36u * 2u);
    for (const auto& triangle : diced.data.triangles) {
        const Vec3& n = diced.data.normals[triangle[0]];
        for (const uint32_t v : triangle) {
            EXPECT_LT((diced.data.normals[v] - n).length(), 1e-6f);
            EXPECT_NEAR(diced.data.positions[v].dot(n), 1.0f, 1e-6f);
        }
    }
}

}  // namespace
}  // namespace velatura::subdivision::test
