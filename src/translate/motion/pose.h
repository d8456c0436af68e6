// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"
#include "translate/motion/skinning.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::translate::motion {

/// What blend shapes and joints do to one prim at the time of the image.
struct Pose {
    /// Added to the authored points before the joints move them.
    struct Offset {
        size_t point = 0;
        Vec3d point_offset = Vec3d(0.0), normal_offset = Vec3d(0.0);
    };

    std::vector<Offset> offsets;
    std::optional<Skin> skin;  ///< per point
    /// With `skin`: from the skeleton's space to the space of the walk. With `is_rigid`: the prim's
    /// own matrix, instead of the one of its xformOps. Else unused.
    Mat4d matrix;
    bool is_rigid = false;  ///< the prim moves as a whole
    bool has_normal_offsets = false;

    /// Moves points by the offsets, then by the joints; without joints they stay in the prim's
    /// space. Offsets and joints of points that are not there have been left out.
    void deform_points(std::vector<Vec3d>& points) const;
    /// The same for normals; owners[i] is the point that normal i stands at.
    void deform_normals(std::vector<Vec3d>& normals, const std::vector<uint32_t>& owners) const;
    /// About where a point goes; for choosing origins.
    Vec3d posed_point(const Vec3d& point) const;
};

/// The pose of a prim; nullopt when no skeleton is bound to it or none can be used (a warning says
/// why). `frame`: the prim whose children's space the walk is in; an invalid one for the world.
std::optional<Pose> read_pose(Context& ctx, Prim prim, Prim frame);

/// Matrix of a prim into the space of `frame`'s children, as read_pose means it.
Mat4d matrix_in_frame(Context& ctx, Prim prim, Prim frame);

/// What an instance hands down to the skeletons and skinned prims of its prototype: two instances
/// share geometry only if this is the same.
std::string skel_signature(Context& ctx, Prim instance);

}  // namespace velatura::translate::motion
