// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/mesh.h"
#include "translate/context/context.h"
#include "translate/geometry/mesh_faces.h"
#include "translate/motion/pose.h"

#include <vector>

namespace velatura::translate::geometry {

/// Sets points and normals of a mesh at the context's time, in the space of the holder. `points`:
/// as read_points leaves them; `matrix`, `pose`: as for read_mesh. Normals are the authored ones,
/// else those of a smooth surface where mesh.subdivision asks for one. False, with a warning, when
/// points do not fit a float.
bool set_surface(Context& ctx,
                 Prim prim,
                 const FaceTable& table,
                 const std::vector<Vec3d>& points,
                 const Mat4d& matrix,
                 const motion::Pose* pose,
                 scene::Mesh& mesh);

/// Covectors under `matrix`, unit, outside kept outside.
std::vector<Vec3> transformed_normals(const std::vector<Vec3d>& normals, const Mat4d& matrix);

}  // namespace velatura::translate::geometry
