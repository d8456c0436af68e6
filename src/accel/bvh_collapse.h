// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/bvh_builder.h"
#include "accel/bvh_layout.h"

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace velatura::accel {

/// Weights of the surface area heuristic, relative to each other.
struct CollapseCosts {
    double node = 1.0;
    double leaf = 1.0;  ///< a leaf block, however full
};

/// Writes one leaf for the primitives given and returns its index.
using MakeLeaf = std::function<uint32_t(std::span<const BuildPrim>)>;

/// Turns a binary tree into one with up to eight children per node and up to `leaf_size` primitives
/// per leaf, of least expected cost among all that keep its grouping.
/// Ref: Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed
/// Wide BVHs", section 3.1.
WideTree collapse(const std::vector<BinaryNode>& binary,
                  std::span<const BuildPrim> prims,
                  size_t leaf_size,
                  const CollapseCosts& costs,
                  const MakeLeaf& make_leaf);

}  // namespace velatura::accel
