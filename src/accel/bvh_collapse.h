// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/bvh_builder.h"
#include "accel/bvh_layout.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace velatura::accel {

/// Weights of the surface area heuristic, relative to each other.
struct CollapseCosts {
    double node = 1.0;
    double leaf = 1.0;  ///< a leaf block, however full
};

/// Turns a binary tree into one with up to eight children per node and up to `leaf_size` references
/// per leaf (at most 8), of least expected cost among all that keep its grouping. The layout
/// depends on the tree's shape alone. Ref: Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray
/// Traversal on GPUs Through Compressed Wide BVHs", section 3.1.
///
/// `begin_leaves(count)` is told how many leaves there will be; then `make_leaf(index, ids)` is
/// called once for each, from several threads.
WideTree collapse(
    const BinaryTree& binary,
    size_t leaf_size,
    const CollapseCosts& costs,
    const std::function<void(size_t count)>& begin_leaves,
    const std::function<void(uint32_t index, std::span<const uint32_t> ids)>& make_leaf);

/// The same for leaves that hold one reference and are named by its id.
WideTree collapse_to_ids(const BinaryTree& binary);

}  // namespace velatura::accel
