// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/mesh.h"
#include "translate/context/instance_source.h"
#include "translate/geometry/mesh_faces.h"
#include "translate/motion/pose.h"

namespace velatura::translate::geometry {

/// Gives a mesh the keys of its motion while the shutter is open, by its points, the transforms
/// that carry it, skeletons and blend shapes: at equal steps, as many as there must be for all
/// authored samples to be keys and for points to stray less than 2^-11 of the mesh's size from
/// straight lines, at most 16. A mesh that does not move, or cannot (a warning says why), is left
/// as it is. `mesh`: before faces are left out; `matrix`, `pose`: as for read_mesh, at the frame's
/// instant.
void read_motion(Context& ctx,
                 Prim prim,
                 const InstanceSource& parent,
                 const Mat4d& matrix,
                 const motion::Pose* pose,
                 const FaceTable& table,
                 scene::Mesh& mesh);

}  // namespace velatura::translate::geometry
