// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/mesh.h"
#include "translate/context.h"
#include "translate/instancer_places.h"
#include "translate/mesh_faces.h"
#include "translate/pose.h"

#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace velatura::translate {

/// When the prim is seen, in times of the stage: the camera's shutter about the frame's instant,
/// times the motion:blurScale of the prim or of the nearest one above that has it. Nothing: at the
/// frame's instant alone. Ref: UsdGeom, "Effectively Applying motion:blurScale".
std::optional<Shutter> shutter_of(Context& ctx, Prim prim);

/// Gives a mesh the keys of its motion while the shutter is open, by its points, the transforms
/// that carry it, skeletons and blend shapes: at equal steps, as many as there must be for all
/// authored samples to be keys and for points to stray less than 2^-11 of the mesh's size from
/// straight lines, at most 16. A mesh that does not move, or cannot (a warning says why), is left
/// as it is. `mesh`: before faces are left out; `matrix`, `pose`: as for read_mesh, at the frame's
/// instant.
void read_motion(Context& ctx,
                 Prim prim,
                 const Placeable& holder,
                 const Mat4d& matrix,
                 const Pose* pose,
                 const FaceTable& table,
                 scene::Mesh& mesh);

/// Gives the placement of a native instance the keys of its motion while the shutter is open: so
/// many that matrices between stray from straight lines by less than 2^-11 of what is placed. What
/// holds lights stays, and is named.
void read_placement_motion(Context& ctx,
                           Prim instance,
                           const Placeable& holder,
                           Placement& placement);

/// Instances of a PointInstancer that were placed where they are at the frame's instant.
struct PlacedInstances {
    std::span<Placement> placements;
    std::span<const size_t> numbers;  ///< [placement] which instance it is
};

/// Gives them the keys of their motion, as read_placement_motion does: each so many as it needs.
/// matrix: of the instancer, before the holder's origin is subtracted.
void read_instancer_motion(Context& ctx,
                           Prim instancer,
                           const Mat4d& matrix,
                           const InstancerPlaces& places,
                           const Placeable& holder,
                           const PlacedInstances& placed);

/// The same for what stands at `rows` in the space of a prim, whatever carries the prim itself.
void read_keys(Context& ctx,
               Prim prim,
               const MovingRows& rows,
               const Placeable& holder,
               const PlacedInstances& placed,
               const Shutter& shutter);

/// Keys of something that stands in something else; both may move.
std::vector<Mat4d> composed_motion(const Placement& inner,
                                   const Mat4d& outer,
                                   const std::vector<Mat4d>& outer_later);

/// Matrix of a prim into the space of `frame`'s children at a time, joints that carry it as a whole
/// included.
Mat4d carried_by(Context& ctx, Prim prim, Prim frame, TimeCode time);

/// The shape of a prim under a matrix into the space of what holds it.
using ShapeReader = std::function<std::optional<scene::Shape>(const Mat4d& matrix)>;

/// Puts a prim that is no mesh, and is carried while the shutter is open, into what holds it, as an
/// instance of itself; its shape stays as it is at the frame's instant, which is named where it
/// would not. False: it stays, or must. Args: matrix of the prim, before the holder's origin is
/// subtracted; a point near its geometry, in
///       its own space.
bool place_moving_shape(Context& ctx,
                        Prim prim,
                        const Mat4d& matrix,
                        const Vec3d& near,
                        const ShapeReader& read,
                        Placeable& holder);

/// The same for Points whose places or widths change: each ball is an instance of one of width 1.
/// still: its shape in the holder at the frame's instant. False where none does; or where they have
/// more of their own than displayColor, give light, or come and go.
bool place_moving_balls(
    Context& ctx, Prim prim, const Mat4d& matrix, const scene::Shape& still, Placeable& holder);

/// Whether a prim that is no mesh changes its shape while the shutter is open.
bool changes_shape(Context& ctx, Prim prim, Prim frame);

/// Names a prim whose motion is not rendered, be it carried or deformed: a light, or a volume.
void warn_if_it_moves(Context& ctx, Prim prim, Prim frame);

/// Names a prim that is no mesh and changes its shape.
void warn_if_it_deforms(Context& ctx, Prim prim, Prim frame);

}  // namespace velatura::translate
