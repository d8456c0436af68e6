// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/mesh.h"
#include "translate/context/context.h"

#include <vector>

namespace velatura::translate::geometry {

/// [face] whether the piece of the mesh that the face belongs to has boundary edges: edges of one
/// face only. Pieces are faces that share edges. Points nearer than a millionth of the mesh's
/// diagonal are one, as seams duplicate them, and so are faces on the same points.
std::vector<bool> open_faces(const scene::Mesh& mesh);

/// Makes thin walls of the geometry that transmits and bounds nothing: pieces of meshes with
/// boundary edges, Planes and ribbons, where the material says nothing of an inside. Closed pieces
/// of the same material stay solids. One note for each material.
void find_thin_walls(Context& ctx);

}  // namespace velatura::translate::geometry
