// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"

#include <optional>
#include <vector>

namespace velatura::translate::motion {

/// When the prim is seen, in times of the stage: the camera's shutter about the frame's instant,
/// times the motion:blurScale of the prim or of the nearest one above that has it. Nothing: at the
/// frame's instant alone. Ref: UsdGeom, "Effectively Applying motion:blurScale".
std::optional<Shutter> shutter_of(Context& ctx, Prim prim);

/// The prim and what is above it, up to the children of `frame`.
std::vector<Prim> chain_of(Prim prim, Prim frame);

/// Whether transforms or joints may move the prim as a whole.
bool can_be_carried(Context& ctx, Prim prim, Prim frame);

/// Matrix of a prim into the space of `frame`'s children at a time, joints that carry it as a whole
/// included.
Mat4d carried_by(Context& ctx, Prim prim, Prim frame, TimeCode time);

}  // namespace velatura::translate::motion
