// SPDX-License-Identifier: Apache-2.0
#include "geometry/tessellate.h"

#include "geometry/gprims.h"
#include "geometry/level_set.h"
#include "geometry/mapped_set.h"
#include "geometry/quadric.h"
#include "geometry/ribbons.h"
#include "geometry/round_curves.h"
#include "geometry/sphere_set.h"

#include <algorithm>
#include <utility>

namespace velatura::geometry {

namespace {

bool needs_corners(const scene::Mesh& mesh) {
    if (!mesh.normals.empty() && mesh.normal_interpolation == scene::Interpolation::FaceVarying)
        return true;
    return std::any_of(mesh.primvars.begin(), mesh.primvars.end(), [](const scene::Primvar& p) {
        return p.interpolation == scene::Interpolation::FaceVarying;
    });
}

/// Cuts the polygons of the mesh into triangles.
void triangulate(const scene::Mesh& mesh, TriangleMeshData& data) {
    const bool wants_corners = needs_corners(mesh);
    const bool all_triangles =
        std::all_of(mesh.face_vertex_counts.begin(), mesh.face_vertex_counts.end(),
                    [](uint32_t count) { return count == 3; });
    std::vector<Vec3> polygon;
    std::vector<std::array<uint32_t, 3>> pieces;
    bool is_identity = all_triangles;
    size_t first = 0, next_hole = 0;
    for (size_t face = 0; face < mesh.face_vertex_counts.size(); ++face) {
        const size_t count = mesh.face_vertex_counts[face];
        const auto& holes = mesh.rules.holes;
        if (next_hole < holes.size() && holes[next_hole] == face) {
            ++next_hole;
            first += count;
            is_identity = false;
            continue;
        }
        polygon.clear();
        for (size_t i = 0; i < count; ++i)
            polygon.push_back(mesh.points[mesh.face_vertex_indices[first + i]]);
        pieces.clear();
        triangulate_polygon(polygon, pieces);
        for (const auto& piece : pieces) {
            // Without an area there is nothing to hit, unless motion gives it one
            const Vec3 &a = polygon[piece[0]], &b = polygon[piece[1]], &c = polygon[piece[2]];
            if (data.later_positions.empty() && (a == b || b == c || c == a)) {
                is_identity = false;
                continue;
            }
            std::array<uint32_t, 3> vertices{}, corners{};
            for (size_t k = 0; k < 3; ++k) {
                corners[k] = uint32_t(first + piece[k]);
                vertices[k] = mesh.face_vertex_indices[corners[k]];
            }
            data.triangles.push_back(vertices);
            data.faces.push_back(uint32_t(face));
            if (wants_corners) data.corners.push_back(corners);
        }
        first += count;
    }
    if (is_identity) {
        data.faces.clear();
        data.corners.clear();
    }
    data.triangles.shrink_to_fit();
    data.faces.shrink_to_fit();
    data.corners.shrink_to_fit();
}

}  // namespace

TriangleMesh make_triangle_mesh(const scene::Shape& shape, TriangleMeshData data) {
    if (const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry))
        data.face_materials = mesh->face_materials;
    data.material = shape.material;
    data.flip_normals = shape.flip_normals;
    return TriangleMesh(std::move(data));
}

TriangleMeshData make_triangles(const scene::Shape& shape, const TessellationOptions& options) {
    TriangleMeshData data;
    if (const auto* gprim = std::get_if<scene::Gprim>(&shape.geometry)) {
        data = tessellate_gprim(*gprim, std::max(options.segments, 4));
        data.primvars = gprim->primvars;
    } else {
        const auto& mesh = std::get<scene::Mesh>(shape.geometry);
        data.positions = mesh.points;
        data.later_positions = mesh.later_points;
        data.later_normals = mesh.later_normals;
        data.normals = mesh.normals;
        data.normal_indices = mesh.normal_indices;
        data.normal_interpolation = mesh.normal_interpolation;
        data.primvars = mesh.primvars;
        triangulate(mesh, data);
    }
    return data;
}

TriangleMesh make_triangle_mesh(const scene::Shape& shape, const TessellationOptions& options) {
    return make_triangle_mesh(shape, make_triangles(shape, options));
}

std::optional<TriangleMesh> make_primitive_mesh(const scene::Shape& shape) {
    TriangleMeshData data;
    data.material = shape.material;
    data.flip_normals = shape.flip_normals;
    if (const auto* gprim = std::get_if<scene::Gprim>(&shape.geometry)) {
        data.primitives = Quadric::make(*gprim);
        if (!data.primitives) return std::nullopt;
        data.primvars = gprim->primvars;
        // Normals of a quadric are outside whatever its matrix, those of windings are not
        if (determinant3(gprim->shape_from_gprim) < 0.0) data.flip_normals = !data.flip_normals;
    } else if (const auto* curves = std::get_if<scene::Curves>(&shape.geometry)) {
        std::shared_ptr<const PrimitiveSet> set;
        if (curves->normals.empty())
            set = RoundCurves::make(*curves);
        else
            set = Ribbons::make(*curves);
        data.primitives = MappedSet::make(set, curves->shape_from_curves);
        data.primvars = curves->primvars;
    } else if (const auto* points = std::get_if<scene::Points>(&shape.geometry)) {
        data.primitives = MappedSet::make(SphereSet::make(*points), points->shape_from_points);
        data.primvars = points->primvars;
    } else if (const auto* level_set = std::get_if<scene::LevelSet>(&shape.geometry)) {
        data.primitives =
            MappedSet::make(LevelSet::make(level_set->grid), level_set->shape_from_lattice);
        data.primvars = level_set->primvars;
    } else {
        return std::nullopt;
    }
    return TriangleMesh(std::move(data));
}

}  // namespace velatura::geometry
