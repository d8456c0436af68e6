// SPDX-License-Identifier: Apache-2.0
#include "plugins/subdivision/bfr_surface.h"

#include "base/tasks.h"
#include "plugins/subdivision/face_evaluator.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>

namespace velatura::plugins::subdivision {

namespace {

using geometry::DicedMesh;
using geometry::TriangleMeshData;

/// Faces that one evaluator goes through.
constexpr size_t chunk = 64;

/// Twins are their leaders' points to the bit.
void unite_twins(DicedMesh& diced) {
    TriangleMeshData& data = diced.data;
    for (const auto& [twin, leader] : diced.twins) {
        data.positions[twin] = data.positions[leader];
        for (std::vector<Vec3>& key : data.later_positions) key[twin] = key[leader];
    }
}

/// The normals of triangles around, by their angles, for vertices that the surface gave none.
/// Ref: Thürmer, Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets", JGT 3(1).
void fill_normals(const TriangleMeshData& data,
                  const std::vector<Vec3>& positions,
                  std::vector<Vec3>& normals) {
    const Vec3 none(0.0f);
    if (std::find(normals.begin(), normals.end(), none) == normals.end()) return;
    std::unordered_map<uint32_t, Vec3d> sums;
    for (const auto& triangle : data.triangles)
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t vertex = triangle[k];
            if (normals[vertex] != none) continue;
            const Vec3d p(positions[vertex]);
            const Vec3d e = Vec3d(positions[triangle[(k + 1) % 3]]) - p;
            const Vec3d f = Vec3d(positions[triangle[(k + 2) % 3]]) - p;
            const Vec3d n = e.cross(f);
            const double length = n.length();
            if (!(length > 0.0)) continue;
            // A vector of Imath's starts as anything
            const auto sum = sums.try_emplace(vertex, Vec3d(0.0)).first;
            sum->second += n * (std::atan2(length, e.dot(f)) / length);
        }
    for (const auto& [vertex, sum] : sums)
        if (sum.length() > 0.0) normals[vertex] = to_float(normalize(sum));
}

/// Takes out what has no area and no motion that may give it one.
void drop_degenerate(TriangleMeshData& data) {
    if (!data.later_positions.empty()) return;
    size_t kept = 0;
    for (size_t t = 0; t < data.triangles.size(); ++t) {
        const auto& [a, b, c] = data.triangles[t];
        const Vec3 &p = data.positions[a], &q = data.positions[b], &r = data.positions[c];
        if (p == q || q == r || r == p) continue;
        data.triangles[kept] = data.triangles[t];
        data.faces[kept] = data.faces[t];
        ++kept;
    }
    data.triangles.resize(kept);
    data.faces.resize(kept);
}

/// What `work` returns, or why it threw.
template <class Work>
auto guarded(const Work& work) -> decltype(work()) {
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return Error{"subdivision", "no limit surface: out of memory"};
    } catch (const std::exception& e) {
        return Error{"subdivision", std::string("no limit surface: ") + e.what()};
    }
}

}  // namespace

BfrSurface::BfrSurface(const scene::Mesh& mesh, Cage cage, bool stays)
    : mesh_(mesh),
      cage_(std::move(cage)),
      shared_(find_shared_points(cage_, mesh)),
      channels_(make_channels(mesh, cage_, stays)),
      edge_points_(find_edge_points()) {}

/// Calls visit(face, evaluator), the evaluator turned to the face, for those that are there.
template <class Visit>
void BfrSurface::for_each_face(const Visit& visit) const {
    const size_t faces = shared_.has_face.size();
    parallel_for((faces + chunk - 1) / chunk, [&](size_t i) {
        FaceEvaluator evaluator(*cage_.factory, channels_);
        for (size_t f = i * chunk; f < std::min(faces, (i + 1) * chunk); ++f) {
            if (!shared_.has_face[f]) continue;
            if (!evaluator.start(uint32_t(f)))
                throw std::runtime_error("OpenSubdiv cannot evaluate face " + std::to_string(f));
            visit(uint32_t(f), evaluator);
        }
    });
}

std::vector<std::array<Vec3, 3>> BfrSurface::find_edge_points() const {
    const Vec3 nowhere(std::numeric_limits<float>::quiet_NaN());
    std::vector<std::array<Vec3, 3>> points(edge_count(), {nowhere, nowhere, nowhere});
    // The first face at an edge speaks for it
    std::vector<uint32_t> speaker(edge_count(), scene::none);
    for (size_t f = 0; f < shared_.has_face.size(); ++f)
        for (uint32_t c = shared_.first_corner[f]; c < shared_.first_corner[f + 1]; ++c) {
            uint32_t& corner = speaker[shared_.edge_of_corner[c]];
            if (shared_.has_face[f] && corner == scene::none) corner = c;
        }
    for_each_face([&](uint32_t f, FaceEvaluator& evaluator) {
        for (uint32_t c = shared_.first_corner[f]; c < shared_.first_corner[f + 1]; ++c) {
            const uint32_t edge = shared_.edge_of_corner[c];
            if (speaker[edge] != c) continue;
            for (int k = 0; k < 3; ++k) {
                double uv[2];
                evaluator.parameterization().GetEdgeCoord(int(c - shared_.first_corner[f]), 0.5 * k,
                                                          uv);
                points[edge][size_t(shared_.is_backward[c] ? 2 - k : k)] = evaluator.position(uv);
            }
        }
    });
    return points;
}

Result<DicedMesh> BfrSurface::dice(std::span<const uint32_t> rates) const {
    return guarded([&]() -> Result<DicedMesh> {
        std::optional<PointLayout> layout = lay_out(cage_, shared_, rates);
        if (!layout)
            return Error{"subdivision", "the limit surface would have more than 2^31 points"};
        DicedMesh diced;
        allocate(*layout, diced.data);
        write_points(*layout, rates, diced.data);
        diced.twins = std::move(layout->twins);
        unite_twins(diced);
        write_triangles(*layout, rates, diced.data);
        drop_degenerate(diced.data);
        fill_normals(diced.data, diced.data.positions, diced.data.normals);
        for (size_t k = 0; k < diced.data.later_normals.size(); ++k)
            fill_normals(diced.data, diced.data.later_positions[k], diced.data.later_normals[k]);
        return diced;
    });
}

void BfrSurface::allocate(const PointLayout& layout, TriangleMeshData& data) const {
    const size_t points = size_t(layout.point_count());
    const auto triangles = size_t(layout.triangle_count());
    data.positions.resize(points);
    data.normals.resize(points);
    data.later_positions.resize(channels_.keys - 1, std::vector<Vec3>(points));
    data.later_normals.resize(channels_.keys - 1, std::vector<Vec3>(points));
    data.primvars = channels_.primvars(mesh_, points);
    data.triangles.resize(triangles);
    data.faces.resize(triangles);
}

/// Evaluates every point once, by the face that owns it.
void BfrSurface::write_points(const PointLayout& layout,
                              std::span<const uint32_t> rates,
                              TriangleMeshData& data) const {
    for_each_face([&](uint32_t f, FaceEvaluator& evaluator) {
        const Bfr::Parameterization place = evaluator.parameterization();
        const uint32_t first = shared_.first_corner[f];
        double uv[2];
        for (uint32_t c = first; c < shared_.first_corner[f + 1]; ++c) {
            const int side = int(c - first);
            const uint32_t wedge = shared_.wedge_of_corner[c];
            if (shared_.wedge_owner[wedge] == c) {
                place.GetVertexCoord(side, uv);
                evaluator.write(uv, wedge, data);
            }
            if (!layout.owns_run[c]) continue;
            const uint32_t rate = rates[shared_.edge_of_corner[c]];
            for (uint32_t i = 1; i < rate; ++i) {
                // Runs go along the direction of the edge
                const uint32_t step = shared_.is_backward[c] ? rate - i : i;
                place.GetEdgeCoord(side, double(step) / double(rate), uv);
                evaluator.write(uv, layout.run_of_corner[c] + i - 1, data);
            }
        }
        const Bfr::Tessellation pattern = pattern_of(shared_, place, f, rates);
        std::vector<double> coords(2 * size_t(pattern.GetNumInteriorCoords()));
        pattern.GetInteriorCoords(coords.data());
        for (size_t i = 0; 2 * i < coords.size(); ++i)
            evaluator.write(&coords[2 * i], uint32_t(layout.first_interior[f] + i), data);
    });
}

void BfrSurface::write_triangles(const PointLayout& layout,
                                 std::span<const uint32_t> rates,
                                 TriangleMeshData& data) const {
    parallel_for(
        shared_.has_face.size(),
        [&](size_t f) {
            if (!shared_.has_face[f]) return;
            const Bfr::Parameterization place = cage_.factory->GetFaceParameterization(int(f));
            Bfr::Tessellation pattern = pattern_of(shared_, place, uint32_t(f), rates);
            // The border of the pattern goes around from corner 0
            std::vector<int> border;
            const uint32_t first = shared_.first_corner[f];
            for (uint32_t c = first; c < shared_.first_corner[f + 1]; ++c) {
                border.push_back(int(shared_.wedge_of_corner[c]));
                const uint32_t inner = rates[shared_.edge_of_corner[c]] - 1;
                for (uint32_t i = 0; i < inner; ++i) {
                    const uint32_t step = shared_.is_backward[c] ? inner - 1 - i : i;
                    border.push_back(int(layout.run_of_corner[c] + step));
                }
            }
            std::vector<int> facets(3 * size_t(pattern.GetNumFacets()));
            pattern.GetFacets(facets.data());
            const int inside = int(layout.first_interior[f]) - int(border.size());
            pattern.TransformFacetCoordIndices(facets.data(), border.data(), inside);
            for (size_t i = 0; 3 * i < facets.size(); ++i) {
                const size_t t = size_t(layout.first_triangle[f]) + i;
                for (size_t k = 0; k < 3; ++k) data.triangles[t][k] = uint32_t(facets[3 * i + k]);
                data.faces[t] = uint32_t(f);
            }
        },
        chunk);
}

Result<std::unique_ptr<geometry::LimitSurface>> OpenSubdivSubdivider::make(const scene::Mesh& mesh,
                                                                           bool stays) const {
    return guarded([&]() -> Result<std::unique_ptr<geometry::LimitSurface>> {
        Result<Cage> cage = make_cage(mesh);
        if (!cage) return cage.error();
        return std::unique_ptr<geometry::LimitSurface>(
            std::make_unique<BfrSurface>(mesh, *std::move(cage), stays));
    });
}

}  // namespace velatura::plugins::subdivision
