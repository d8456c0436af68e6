// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "usd/stage/stage.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::usd::stage {

/// A prim's own transform. Row vectors: p_parent = p_local · matrix.
struct LocalTransform {
    Mat4d matrix;                   ///< identity for prims without xformOpOrder
    bool resets_stack = false;      ///< "!resetXformStack!": the parent's transform does not apply
    bool might_be_varying = false;  ///< some op that counts has more than one sample
};

/// Composes xformOpOrder: the last listed op is applied to points first; "!invert!op" inverts its
/// matrix; ops before
/// "!resetXformStack!" are dropped. A listed op without a value is the identity. Unknown op types,
/// singular inverts and ops of the wrong value type go to the stage's diagnostics and count as
/// identity. Ref: UsdGeomXformable, UsdGeomXformOp.
LocalTransform local_transform(Prim prim, TimeCode time = {});

/// Transform from the prim's local space to the world of the stage: local matrices from the prim up
/// to the root or to the first that resets, multiplied from the root down.
Mat4d world_transform(Prim prim, TimeCode time = {});

/// Times of all samples of the ops that count, ascending, without repeats.
std::vector<double> transform_sample_times(Prim prim);

/// Whether an op of this full name may be, without "!invert!": "xformOp:rotateXYZ:pivot".
bool is_xform_op(std::string_view name);

/// Matrix of one op given its full name ("xformOp:rotateXYZ:pivot", "!invert!xformOp:translate"):
/// nullopt when the op type is unknown. The attribute is looked up on the prim.
std::optional<Mat4d> xform_op_matrix(Prim prim, const std::string& op_name, TimeCode time);

}  // namespace velatura::usd::stage
