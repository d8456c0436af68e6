// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/mesh.h"
#include "translate/context.h"
#include "translate/mesh_faces.h"
#include "translate/pose.h"

#include <vector>

namespace velatura::translate {

/// Points of a PointBased prim at the context's time, deformed by `pose`: by velocities from the
/// sample at or before the frame's instant where it has such, else from sample to sample.
/// Ref: UsdGeomPointBased::ComputePointsAtTimes.
std::vector<Vec3d> read_points(Context& ctx, Prim prim, const Pose* pose);

/// Whether velocities move its points. They do not mind what the next sample holds.
bool has_velocities(Context& ctx, Prim prim);

/// Sets points and normals of a mesh at the context's time, in the space of the holder. `points`:
/// as read_points leaves them; `matrix`, `pose`: as for read_mesh. Normals are the authored ones,
/// else those of a smooth surface where mesh.subdivision asks for one. False, with a warning, when
/// points do not fit a float.
bool set_surface(Context& ctx,
                 Prim prim,
                 const FaceTable& table,
                 const std::vector<Vec3d>& points,
                 const Mat4d& matrix,
                 const Pose* pose,
                 scene::Mesh& mesh);

/// Covectors under `matrix`, unit, outside kept outside.
std::vector<Vec3> transformed_normals(const std::vector<Vec3d>& normals, const Mat4d& matrix);

}  // namespace velatura::translate
