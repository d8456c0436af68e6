// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/bvh.h"
#include "accel/traverse.h"

#include <span>
#include <vector>

namespace velatura::accel {

/// What is to be placed of a prototype.
struct Outline {
    std::vector<Box3> boxes;  ///< around its parts, together; empty: nothing
    double condition = 1;     ///< how far its primitives make rays stray
};

/// Trees over the instances of a scene that move, one for each number of segments. `bounds` grows
/// by the boxes of all of them at all keys.
std::vector<MovingInstances> place_moving_instances(std::span<const SoupInstance> instances,
                                                    std::span<const Outline> outlines,
                                                    const BvhOptions& options,
                                                    Box3& bounds);

}  // namespace velatura::accel
