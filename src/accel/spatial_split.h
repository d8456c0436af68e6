// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/build_prim.h"

#include <limits>
#include <span>

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
                                const TriangleSource& source);

/// What became of divided references: those below the plane come first.
struct SpatialSides {
    size_t lower_count = 0, upper_count = 0;
    RangeBounds lower, upper;
};

/// Divides the first `count` of some references at a split. As many become two as there is room for
/// behind them; others stay whole on the side where that costs less.
/// Parts are grown by a margin that covers all rounding (ray_query.h) and cut to the reference's
/// own box.
/// Ref: Stich, Friedrich, Dietrich 2009, section 4.4 (reference unsplitting).
SpatialSides divide(std::span<BuildPrim> references_and_room,
                    size_t count,
                    const SpatialSplit& split,
                    const TriangleSource& source);

}  // namespace velatura::accel
