// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/build_prim.h"

#include <limits>
#include <span>
#include <vector>

namespace velatura::accel {

/// A plane that divides the space of a node; references across it are divided too.
struct SpatialSplit {
    int axis = -1;  ///< −1: none found
    float position = 0;
    double cost = std::numeric_limits<double>::infinity();  ///< half areas times references
    Bounds4 lower, upper;                                   ///< boxes of both sides
    size_t lower_count = 0, upper_count = 0;
};

/// The best of the planes that divide `box` evenly along each axis, by the surface area heuristic.
SpatialSplit find_spatial_split(std::span<const BuildPrim> references,
                                const Bounds4& box,
                                const PrimClipper& clipper);

/// References of both sides and their bounds.
struct SpatialSides {
    std::vector<BuildPrim> lower, upper;
    RangeBounds lower_bounds, upper_bounds;
};

/// Divides references at a split. At most `budget` of them become two; others stay whole on the
/// side where that costs less.
/// Ref: Stich, Friedrich, Dietrich 2009, section 4.4 (reference unsplitting).
SpatialSides divide(std::span<const BuildPrim> references,
                    const SpatialSplit& split,
                    size_t budget,
                    const PrimClipper& clipper);

}  // namespace velatura::accel
