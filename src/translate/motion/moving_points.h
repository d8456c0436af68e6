// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"
#include "translate/motion/pose.h"

#include <vector>

namespace velatura::translate::motion {

/// Points of a PointBased prim at the context's time, deformed by `pose`: by velocities from the
/// sample at or before the frame's instant where it has such, else from sample to sample.
/// Ref: UsdGeomPointBased::ComputePointsAtTimes.
std::vector<Vec3d> read_points(Context& ctx, Prim prim, const Pose* pose);

/// Whether velocities move its points. They do not mind what the next sample holds.
bool has_velocities(Context& ctx, Prim prim);

}  // namespace velatura::translate::motion
