// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/subdivider.h"
#include "scene/mesh.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::subdivision::test {

/// The plugin's subdivider; nullptr where it was not built.
const geometry::Subdivider* open_subdivider();

/// A mesh to be subdivided, with a name for messages.
struct Cage {
    std::string name;
    scene::Mesh mesh;
    bool is_smooth = true;  ///< but for boundaries and, of bilinear ones, edges
};

scene::Mesh make_cage(scene::SubdivisionScheme scheme,
                      std::vector<Vec3> points,
                      const std::vector<std::vector<uint32_t>>& faces);

/// Edge 2 around the origin.
scene::Mesh cube();

/// Quads of edge 1 in the xy plane from the origin on, their heights bent.
scene::Mesh grid(uint32_t columns, uint32_t rows);

/// Closed, with vertices of valence 3 to 6, faces of 3 to 5 corners, creases of several
/// sharpnesses, a corner.
std::vector<Cage> closed_cages();

/// Those, and some with boundaries.
std::vector<Cage> all_cages();

/// Cuts every edge into `rate` pieces.
geometry::DicedMesh dice(const scene::Mesh& mesh, uint32_t rate, bool stays = false);

/// Edges into 1 to `max` pieces at random, many into one of these two.
std::vector<uint32_t> uneven_rates(uint32_t edges, uint32_t max, uint64_t seed);

/// How many edges of triangles, by the bits of their ends, have no partner that runs the other way.
size_t open_edges(const geometry::TriangleMeshData& data);

}  // namespace velatura::subdivision::test
