// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/instance_source.h"

namespace velatura::translate::instancing {

/// Puts Points whose places or widths change while the shutter is open into what holds them: each
/// ball is an instance of one of width 1. matrix: as for place_moving_shape. still: their shape in
/// the holder at the frame's instant. False where none does; or where they have more of their own
/// than displayColor, give light, or come and go.
bool place_moving_spheres(Context& ctx,
                          Prim prim,
                          const Mat4d& matrix,
                          const scene::Shape& still,
                          InstanceSource& parent);

}  // namespace velatura::translate::instancing
