// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/instance_source.h"
#include "translate/instancing/instancer_places.h"

#include <cstddef>
#include <span>

namespace velatura::translate::instancing {

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
                           const InstanceSource& parent,
                           const PlacedInstances& placed);

/// The same for what stands at `rows` in the space of a prim, whatever carries the prim itself.
void read_keys(Context& ctx,
               Prim prim,
               const MovingRows& rows,
               const InstanceSource& parent,
               const PlacedInstances& placed,
               const Shutter& shutter);

}  // namespace velatura::translate::instancing
