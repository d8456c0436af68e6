// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/subdivision/cage.h"
#include "scene/mesh.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::plugins::subdivision {

/// Which points of edges and vertices the faces of a cage have in common. Faces at an edge share
/// its points unless normals or face-varying numbers jump there: the edge is split then, and each
/// of the two has points of its own. Faces around a vertex fall into *wedges* between split edges.
struct SharedPoints {
    std::vector<uint32_t> first_corner;     ///< [face] and one more
    std::vector<uint8_t> has_face;          ///< [face] there is a limit surface
    std::vector<uint32_t> edge_of_corner;   ///< [corner] from it to the next corner
    std::vector<uint8_t> is_backward;       ///< [corner] its face runs against the edge's direction
    std::vector<uint8_t> is_split;          ///< [edge]
    std::vector<uint32_t> wedge_of_corner;  ///< [corner]; none where the face is not there
    std::vector<uint32_t> wedge_owner;      ///< [wedge] its first corner
    std::vector<uint32_t> wedge_leader;     ///< [wedge] the first wedge of the same vertex

    uint32_t edge_count() const { return uint32_t(is_split.size()); }

    uint32_t wedge_count() const { return uint32_t(wedge_owner.size()); }
};

SharedPoints find_shared_points(const Cage& cage, const scene::Mesh& mesh);

}  // namespace velatura::plugins::subdivision
