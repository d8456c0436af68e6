// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/mesh.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::translate::geometry {

/// Authored polygons and which of them are rendered.
struct FaceTable {
    struct Face {
        size_t first = 0;  ///< its first corner in `indices`
        size_t count = 0;
        bool is_kept = true;
    };

    std::vector<Face> faces;        ///< [authored face]
    std::vector<uint32_t> indices;  ///< [authored corner]

    void add(size_t first, size_t count, bool is_kept) { faces.push_back({first, count, is_kept}); }

    size_t kept_count() const;
};

/// Writes the kept faces into the mesh and drops what belonged to the others from its materials,
/// normals and primvars, which come with the authored element counts.
void compact_faces(const FaceTable& table, scene::Mesh& mesh);

/// The mesh with some of its faces only, listed in rising order.
scene::Mesh with_faces(const scene::Mesh& mesh, const std::vector<uint32_t>& faces);

}  // namespace velatura::translate::geometry
