// SPDX-License-Identifier: Apache-2.0
#include "built_plugin.h"
#include "fuzz_targets.h"
#include "geometry/subdivider.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>

namespace velatura::fuzz {

namespace {

/// Draws numbers from bytes; zeros after their end.
class Bytes {
  public:
    explicit Bytes(std::string_view bytes) : bytes_(bytes) {}

    bool is_at_end() const { return bytes_.empty(); }

    uint32_t below(uint32_t count) {
        if (is_at_end()) return 0;
        const auto byte = static_cast<unsigned char>(bytes_[0]);
        bytes_.remove_prefix(1);
        return byte % count;
    }

  private:
    std::string_view bytes_;
};

constexpr uint32_t max_points = 24, max_faces = 40;

/// Sharpnesses at the ends of what OpenSubdiv tells apart, and between.
float sharpness(Bytes& bytes) {
    return float(bytes.below(12)) * 1.1f;
}

/// Polygons over the same few points, which may fold, touch and overlap; of 3 to 6 corners.
void add_faces(Bytes& bytes, scene::Mesh& mesh) {
    const uint32_t points = 3 + bytes.below(max_points - 2);
    for (uint32_t i = 0; i < points; ++i)
        mesh.points.emplace_back(float(i % 5), float(i / 5), float(i * 7 % 4) * 0.25f);
    const uint32_t faces = 1 + bytes.below(max_faces);
    const bool is_grid = bytes.below(2) == 0;
    for (uint32_t f = 0; f < faces; ++f) {
        const uint32_t count = 3 + bytes.below(4);
        const uint32_t first = bytes.below(points);
        mesh.face_vertex_counts.push_back(count);
        for (uint32_t c = 0; c < count; ++c) {
            constexpr uint32_t steps[] = {0, 1, 6, 5, 10, 11};
            mesh.face_vertex_indices.push_back(is_grid ? (first + steps[c]) % points
                                                       : bytes.below(points));
        }
    }
}

/// Creases along edges, corners, holes: what `translate` lets through.
void add_rules(Bytes& bytes, scene::Mesh& mesh) {
    mesh.subdivision = scene::SubdivisionScheme(1 + bytes.below(3));
    scene::SubdivisionRules& rules = mesh.rules;
    rules.boundary = scene::BoundaryInterpolation(bytes.below(3));
    rules.face_varying = scene::FaceVaryingInterpolation(bytes.below(6));
    rules.triangles = scene::TriangleRule(bytes.below(2));
    const auto faces = uint32_t(mesh.face_vertex_counts.size());
    std::vector<uint32_t> first(faces, 0);
    for (uint32_t f = 1; f < faces; ++f) first[f] = first[f - 1] + mesh.face_vertex_counts[f - 1];
    for (uint32_t i = bytes.below(12); i > 0; --i) {
        const uint32_t face = bytes.below(faces), count = mesh.face_vertex_counts[face],
                       corner = bytes.below(count);
        const uint32_t a = mesh.face_vertex_indices[first[face] + corner],
                       b = mesh.face_vertex_indices[first[face] + (corner + 1) % count];
        if (a == b) continue;
        rules.creases.push_back({a, b});
        rules.crease_sharpnesses.push_back(sharpness(bytes));
    }
    for (uint32_t i = bytes.below(6); i > 0; --i) {
        rules.corners.push_back(bytes.below(uint32_t(mesh.points.size())));
        rules.corner_sharpnesses.push_back(sharpness(bytes));
    }
    std::set<uint32_t> holes;
    for (uint32_t i = bytes.below(5); i > 0; --i) holes.insert(bytes.below(faces));
    rules.holes.assign(holes.begin(), holes.end());
}

/// Numbers of every interpolation, face-varying ones by indices of their own.
void add_primvars(Bytes& bytes, scene::Mesh& mesh) {
    const uint32_t count = bytes.below(3);
    for (uint32_t p = 0; p < count; ++p) {
        scene::Primvar& primvar = mesh.primvars.emplace_back();
        primvar.name = p;
        primvar.width = uint8_t(1 + bytes.below(3));
        primvar.interpolation = scene::Interpolation(bytes.below(5));
        size_t rows = 1;
        if (primvar.interpolation == scene::Interpolation::Uniform)
            rows = mesh.face_vertex_counts.size();
        if (primvar.interpolation == scene::Interpolation::Varying ||
            primvar.interpolation == scene::Interpolation::Vertex)
            rows = mesh.points.size();
        if (primvar.interpolation == scene::Interpolation::FaceVarying) {
            rows = 1 + bytes.below(16);
            for (size_t c = 0; c < mesh.face_vertex_indices.size(); ++c)
                primvar.indices.push_back(bytes.below(uint32_t(rows)));
        }
        for (size_t i = 0; i < rows * primvar.width; ++i)
            primvar.values.push_back(float(i % 9) * 0.5f);
    }
}

void check(const geometry::DicedMesh& diced) {
    const geometry::TriangleMeshData& data = diced.data;
    for (const Vec3& p : data.positions)
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) std::abort();
    for (const auto& triangle : data.triangles)
        for (const uint32_t vertex : triangle)
            if (vertex >= data.positions.size()) std::abort();
    for (const auto& [twin, leader] : diced.twins)
        if (twin >= data.positions.size() || leader >= data.positions.size()) std::abort();
}

}  // namespace

/// Any bytes are a mesh that `translate` could have made, with a limit surface that is cut into
/// triangles of finite points, or refused.
void subdivision(std::string_view text) {
    static const auto* subdivider = static_cast<const geometry::Subdivider*>(
        built_interface(geometry::subdivider_interface, geometry::subdivider_interface_version,
                        "effect", "subdivision"));
    if (subdivider == nullptr) return;
    Bytes bytes(text);
    scene::Mesh mesh;
    add_faces(bytes, mesh);
    add_rules(bytes, mesh);
    add_primvars(bytes, mesh);
    const auto surface = subdivider->make(mesh, true);
    if (!surface) return;
    std::vector<uint32_t> rates((*surface)->edge_count());
    for (uint32_t& rate : rates) rate = 1 + bytes.below(4);
    if (const auto diced = (*surface)->dice(rates)) check(*diced);
}

}  // namespace velatura::fuzz
