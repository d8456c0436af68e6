// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace velatura::accel {

/// Box of a primitive while a tree is built. `id` is the primitive's index.
struct alignas(32) BuildPrim {
    float lower[3];
    uint32_t id;
    float upper[3];
    uint32_t unused;
};

/// Node of a binary tree in preorder: the left child follows its parent, the right child is named.
/// Slots may stay unused (count 0). Primitives first … first + count − 1 are below the node.
struct BinaryNode {
    float lower[3];
    float upper[3];
    uint32_t right = 0;  ///< 0 for a leaf
    uint32_t first = 0;
    uint32_t count = 0;

    bool is_leaf() const { return right == 0; }

    /// Half the surface area.
    double half_area() const {
        const double x = double(upper[0]) - double(lower[0]);
        const double y = double(upper[1]) - double(lower[1]);
        const double z = double(upper[2]) - double(lower[2]);
        return x * y + y * z + z * x;
    }
};

/// How to split.
struct BinaryBuildOptions {
    int bins = 16;
    int max_depth = 48;
    /// Called for ranges of more than 8 primitives with the same centroid, which no plane can
    /// divide; may move duplicates to the end and return how many are left.
    std::function<size_t(std::span<BuildPrim>)> merge_duplicates;
};

/// Builds a binary tree by the binned surface area heuristic, down to single primitives, and sorts
/// `prims` into its order. Ranges that planes cannot divide, and everything below max_depth, are
/// halved. Parallel; the tree depends on the primitives and options alone.
/// Ref: Wald 2007, "On fast Construction of SAH-based Bounding Volume Hierarchies".
std::vector<BinaryNode> build_binary_tree(std::span<BuildPrim> prims,
                                          const BinaryBuildOptions& options);

}  // namespace velatura::accel
