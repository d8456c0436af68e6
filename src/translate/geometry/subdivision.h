// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/subdivision.h"
#include "translate/context/context.h"
#include "translate/geometry/mesh_faces.h"

#include <vector>

namespace velatura::translate::geometry {

/// The subdivisionScheme of a mesh; an unknown one is catmullClark, with a warning.
scene::SubdivisionScheme read_scheme(Context& ctx, Prim prim);

/// How a subdivided mesh's surface follows from its kept faces, by their numbers once the others
/// are gone. What names no vertex, edge or face of the mesh is left out with a warning.
scene::SubdivisionRules read_subdivision_rules(Context& ctx,
                                               Prim prim,
                                               const FaceTable& table,
                                               size_t point_count);

/// The faces that holeIndices names, ascending; what names none is warned about.
std::vector<size_t> read_holes(Context& ctx, Prim prim, size_t face_count);

}  // namespace velatura::translate::geometry
