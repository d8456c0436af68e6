// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/build_prim.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace velatura::accel {

/// Node of a binary tree. Children lie side by side. `first` is only known where count <= 8: there
/// the references below are BinaryTree::order[first … first + count − 1].
struct BinaryNode {
    float lower[3];
    uint32_t child;  ///< the first of two; 0 for a leaf
    float upper[3];
    uint32_t first;
    uint32_t count;

    bool is_leaf() const { return child == 0; }

    double half_area() const { return accel::half_area(lower, upper); }
};

struct BinaryTree {
    std::unique_ptr<BinaryNode[]> nodes;  ///< node 0 is the root
    std::unique_ptr<uint32_t[]> order;    ///< ids of references
    size_t node_count = 0;
    size_t references = 0;  ///< 0: no nodes

    bool is_empty() const { return references == 0; }
};

/// How to split.
struct BinaryBuildOptions {
    int bins = 16;
    int max_depth = 48;
    size_t leaf_size = 1;  ///< references at which splitting ends, 1 … 8
    /// Called for ranges of more than 8 references with the same centroid, which no plane can
    /// divide; may move duplicates to the end and return how many are left.
    std::function<size_t(std::span<BuildPrim>)> merge_duplicates;

    const PrimClipper* clipper = nullptr;  ///< nullptr: no spatial splits
    double spare_references = 0;     ///< how many spatial splits may add, relative to the primitives
    double smallest_overlap = 1e-4;  ///< of the children of an object split that makes a spatial
                                     ///< split worth trying, in surface areas of the root
    double thinnest_overlap = 0.2;   ///< the same, in edges of the node along the split axis
};

/// Builds a binary tree by the binned surface area heuristic, with spatial splits where the children
/// of object splits overlap. Ranges that planes cannot divide, and everything below max_depth, are
/// halved. Parallel; the tree depends on the primitives and options alone, the numbers of its nodes
/// do not mean anything.
/// Ref: Wald 2007, "On fast Construction of SAH-based Bounding Volume Hierarchies"; Stich,
/// Friedrich, Dietrich 2009, "Spatial Splits in Bounding Volume Hierarchies".
BinaryTree build_binary_tree(std::vector<BuildPrim> prims, const BinaryBuildOptions& options);

}  // namespace velatura::accel
