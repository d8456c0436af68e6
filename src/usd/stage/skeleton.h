// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "usd/stage/stage.h"

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace velatura::usd::stage {

/// How a prim is bound to a skeleton, with what it inherits. Only prims with SkelBindingAPI take
/// part. Ref: UsdSkelBindingAPI.
struct SkelBinding {
    Prim skeleton;               ///< always valid
    Attribute joint_indices;     ///< int[]; invalid when no joints move the prim
    Attribute joint_weights;     ///< float[]; as joint_indices
    int influences = 1;          ///< joints per point: elementSize of both
    bool is_rigid = true;        ///< interpolation constant: one set of joints for everything
    Attribute joints;            ///< token[]: the order that joint_indices count in, if authored
    Attribute geom_bind;         ///< matrix4d; invalid = identity
    Attribute skinning_method;   ///< token; invalid = classicLinear
    Attribute blend_shapes;      ///< token[]; not inherited
    Relationship blend_targets;  ///< not inherited

    bool has_joints() const { return joint_indices.is_authored(); }

    bool has_blend_shapes() const { return blend_shapes.is_authored(); }
};

/// The binding of a boundable prim below a SkelRoot; nullopt when nothing binds it to a skeleton.
/// Contradictions between indices and weights are warned about and leave the joints out.
std::optional<SkelBinding> skel_binding(Prim prim);

/// True when the prim or an ancestor is a SkelRoot.
bool is_below_skel_root(Prim prim);

/// The nearest skel:animationSource at or above the prim; an invalid Prim when there is none.
Prim animation_source(Prim prim);

/// A skeleton at one time.
struct SkeletonPose {
    std::vector<layer::Token> joints;  ///< order of the Skeleton
    /// [joint], in the space of the Skeleton prim: from where a point was at bind time to where the
    /// joint takes it; exactly the identity for a joint in its bind pose. Empty when the skeleton
    /// has no joints or cannot be posed (a warning says why).
    std::vector<Mat4d> skinning;
    std::vector<std::pair<layer::Token, double>> blend_weights;
};

/// Poses a Skeleton by its animation source; joints without animation are at rest.
SkeletonPose skeleton_pose(Prim skeleton, TimeCode time = {});

/// A blend shape, with its in-between shapes.
struct BlendShape {
    struct Target {
        double weight = 1.0;
        std::vector<Vec3d> offsets;         ///< [offset]
        std::vector<Vec3d> normal_offsets;  ///< [offset]; empty = none authored
    };

    std::vector<int64_t> point_indices;  ///< [offset] → point; empty = one offset per point
    /// Ascending by weight; the primary shape has weight 1, the base (weight 0, no offsets) is left
    /// out.
    std::vector<Target> targets;
};

/// Reads a BlendShape prim; in-betweens without a weight, or at 0 or 1, are warned about.
BlendShape read_blend_shape(Prim prim);

}  // namespace velatura::usd::stage
