// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/build_prim.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

namespace velatura::accel {

/// Most candidate planes per axis.
inline constexpr int max_bins = 32;

/// Divides references by their centroids: those with (c − origin)·scale < bin on the axis go left.
struct ObjectSplit {
    int axis = -1;  ///< −1: none found
    float origin = 0, scale = 0;
    float bin = 0;
    size_t left_count = 0, right_count = 0;
    Bounds4 left, right;  ///< boxes of both sides

    bool is_left(const BuildPrim& p) const { return (centroid(p, axis) - origin) * scale < bin; }
};

/// The best of `bins` − 1 planes per axis by the surface area heuristic. `block`: how many
/// references cost as much as one where leaves hold that many, a power of two. Ref: Wald 2007, "On
/// fast Construction of SAH-based Bounding Volume Hierarchies".
ObjectSplit find_object_split(std::span<const BuildPrim> references,
                              const RangeBounds& bounds,
                              int bins,
                              uint32_t block);

/// Boxes of centroids.
struct CentroidBounds {
    Bounds4 left, right;
};

/// Moves the left ones of a split to the front.
CentroidBounds partition(std::span<BuildPrim> references, const ObjectSplit& split);

}  // namespace velatura::accel
