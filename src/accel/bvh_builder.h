// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/build_prim.h"
#include "accel/bvh_layout.h"

#include <cstdint>
#include <functional>
#include <span>

namespace velatura::accel {

/// Node of a binary tree. Children lie side by side.
struct alignas(32) BinaryNode {
    float lower[3];
    uint32_t link;  ///< the first of two children; for a leaf (leaf_bit set) its first reference
    float upper[3];
    uint32_t count;  ///< references below before any was divided or dropped; exact up to 8

    bool is_leaf() const { return link & leaf_bit; }

    uint32_t child() const { return link; }

    uint32_t first() const { return link & ~leaf_bit; }

    double half_area() const { return accel::half_area(lower, upper); }
};

struct BinaryTree {
    Buffer<BinaryNode> nodes;  ///< node 0 is the root; numbers have gaps
    /// Ids of references. Those of a node with at most 8 lie side by side; there are gaps
    /// elsewhere.
    Buffer<uint32_t> order;
    size_t node_count = 0;  ///< bound of their numbers; 0: empty

    bool is_empty() const { return node_count == 0; }

    /// Where the references of a node begin that has at most 8.
    uint32_t first_reference(uint32_t node) const {
        while (!nodes[node].is_leaf()) node = nodes[node].child();
        return nodes[node].first();
    }
};

struct BvhOptions;

/// How to split.
struct BinaryBuildOptions {
    int bins = 16;
    int max_depth = 48;
    size_t leaf_size = 1;  ///< references at which splitting ends, 1 … 8
    uint32_t block = 1;  ///< references that a ray tests for the price of one where there are more
                         ///< than 8
    /// Called for ranges of more than 8 references with the same centroid, which no plane can
    /// divide; may move duplicates to the end and return how many are left.
    std::function<size_t(std::span<BuildPrim>)> merge_duplicates;

    /// Nullptr: no spatial splits. They add as many references as there is room for behind the
    /// primitives (BuildPrims).
    const TriangleSource* source = nullptr;
    int backoff = 1;                 ///< see BvhOptions
    double smallest_overlap = 1e-4;  ///< of the children of an object split that makes a spatial
                                     ///< split worth trying, in surface areas of the root
};

/// What these say of bins and depth; nothing of leaves and spatial splits.
BinaryBuildOptions binary_options_of(const BvhOptions& options);

/// Builds a binary tree by the binned surface area heuristic, with spatial splits where the
/// children of object splits overlap. Ranges that planes cannot divide, and everything below
/// max_depth, are halved. Parallel; the tree depends on the primitives and options alone, the
/// numbers of its nodes do not mean anything. Ref: Wald 2007, "On fast Construction of SAH-based
/// Bounding Volume Hierarchies"; Stich, Friedrich, Dietrich 2009, "Spatial Splits in Bounding
/// Volume Hierarchies".
BinaryTree build_binary_tree(BuildPrims prims, const BinaryBuildOptions& options);

}  // namespace velatura::accel
