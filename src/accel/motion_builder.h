// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator.h"
#include "accel/bvh.h"
#include "accel/bvh_layout.h"
#include "accel/triangle_numbers.h"

#include <span>

namespace velatura::accel {

/// Trees over those of the shapes that move, built by where triangles are when the shutter is half
/// through, with boxes for each segment. What is stored is added to `stored`. Parallel; the result
/// does not depend on the number of threads.
MovingTrees build_moving_trees(std::span<const TriangleSoupView> shapes,
                               const TriangleNumbers& numbers,
                               const BvhOptions& options,
                               AcceleratorStats& stored);

/// Holds them at all times: corners that geometry::moved rounds may leave the box of their keys by
/// a little.
Box3 box_of_motion(const MovingTrees& trees);

}  // namespace velatura::accel
