// SPDX-License-Identifier: Apache-2.0
#include "translate/geometry/mesh_faces.h"

#include <algorithm>
#include <utility>

namespace velatura::translate::geometry {

namespace {

/// Keeps the listed elements: of the indices where there are some, else of the rows.
template <class Row>
void keep(const std::vector<size_t>& elements,
          size_t width,
          std::vector<Row>& rows,
          std::vector<uint32_t>& indices) {
    if (!indices.empty()) {
        std::vector<uint32_t> kept;
        kept.reserve(elements.size());
        for (const size_t e : elements) kept.push_back(indices[e]);
        indices = std::move(kept);
        return;
    }
    std::vector<Row> kept;
    kept.reserve(elements.size() * width);
    for (const size_t e : elements)
        for (size_t i = 0; i < width; ++i) kept.push_back(rows[e * width + i]);
    rows = std::move(kept);
}

/// Of all keys, which share their indices.
void keep_normals(const std::vector<size_t>& elements, scene::Mesh& mesh) {
    std::vector<uint32_t> no_indices;
    if (mesh.normal_indices.empty())
        for (std::vector<Vec3>& key : mesh.later_normals) keep(elements, 1, key, no_indices);
    keep(elements, 1, mesh.normals, mesh.normal_indices);
}

}  // namespace

size_t FaceTable::kept_count() const {
    return size_t(
        std::count_if(faces.begin(), faces.end(), [](const Face& f) { return f.is_kept; }));
}

void compact_faces(const FaceTable& table, scene::Mesh& mesh) {
    std::vector<size_t> kept_faces, kept_corners;
    for (size_t f = 0; f < table.faces.size(); ++f) {
        const FaceTable::Face& face = table.faces[f];
        if (!face.is_kept) continue;
        kept_faces.push_back(f);
        mesh.face_vertex_counts.push_back(uint32_t(face.count));
        for (size_t i = face.first; i < face.first + face.count; ++i) {
            kept_corners.push_back(i);
            mesh.face_vertex_indices.push_back(table.indices[i]);
        }
    }
    const bool is_complete =
        kept_faces.size() == table.faces.size() && kept_corners.size() == table.indices.size();
    if (is_complete) return;
    std::vector<uint32_t> no_indices;
    if (!mesh.face_materials.empty()) keep(kept_faces, 1, mesh.face_materials, no_indices);
    if (!mesh.normals.empty()) {
        if (mesh.normal_interpolation == scene::Interpolation::Uniform)
            keep_normals(kept_faces, mesh);
        if (mesh.normal_interpolation == scene::Interpolation::FaceVarying)
            keep_normals(kept_corners, mesh);
    }
    for (scene::Primvar& primvar : mesh.primvars) {
        if (primvar.interpolation == scene::Interpolation::Uniform)
            keep(kept_faces, primvar.width, primvar.values, primvar.indices);
        if (primvar.interpolation == scene::Interpolation::FaceVarying)
            keep(kept_corners, primvar.width, primvar.values, primvar.indices);
    }
}

scene::Mesh with_faces(const scene::Mesh& mesh, const std::vector<uint32_t>& faces) {
    FaceTable table;
    size_t first = 0;
    for (const uint32_t count : mesh.face_vertex_counts) {
        table.add(first, count, false);
        first += count;
    }
    for (const uint32_t face : faces) table.faces[face].is_kept = true;
    scene::Mesh out = mesh;
    table.indices = std::move(out.face_vertex_indices);
    out.face_vertex_counts.clear();
    out.face_vertex_indices.clear();
    compact_faces(table, out);
    return out;
}

}  // namespace velatura::translate::geometry
