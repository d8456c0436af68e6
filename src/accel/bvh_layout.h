// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/ray_query.h"
#include "base/math.h"
#include "base/process/large_pages.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::accel {

/// Children of a node, triangles of a leaf block.
inline constexpr size_t wide = 8;

/// Names a child: an inner node, or (leaf_bit set) a leaf block or an instance.
using ChildRef = uint32_t;
inline constexpr ChildRef leaf_bit = 0x80000000u;

/// Eight boxes in rows, so that a kernel picks near and far rows by the signs of the ray. Four
/// cache lines. Unused children have lower = +inf, upper = -inf, which no ray meets. Children are
/// ordered by falling surface area.
struct alignas(64) WideNode {
    float bounds[6][wide];  ///< lower x, y, z, upper x, y, z
    ChildRef child[wide];
    uint32_t classes[wide];  ///< scene::LinkSet::folded_bit of what is below; see SceneClasses
};

/// Id of a lane without a triangle.
inline constexpr uint32_t unused_lane = 0xffffffffu;

/// Eight triangles in rows. Corners of unused lanes are not a number, so that no ray
/// meets them; their id is unused_lane.
struct alignas(64) LeafBlock {
    float corner[3][3][wide];  ///< [corner][axis][lane]
    uint32_t id[wide];         ///< counts the triangles of the tree in (shape, triangle) order
};

/// A tree as kernels read it. Node 0 is the root, an inner node, unless the tree is empty (no
/// nodes).
struct WideTree {
    std::vector<WideNode, LargePages<WideNode>> nodes;
    std::vector<LeafBlock, LargePages<LeafBlock>> leaves;  ///< empty when leaves are instances
    Box3 bounds;                                           ///< empty Box3 for an empty tree
    QueryBounds query_bounds;                              ///< the same, ready for make_query
    size_t depth = 0;                                      ///< inner nodes from root to leaf

    bool is_empty() const { return nodes.empty(); }

    size_t bytes() const {
        return nodes.size() * sizeof(WideNode) + leaves.size() * sizeof(LeafBlock);
    }
};

/// Eight boxes that move together between two keys of a motion: f of the way a bound is
/// bounds + f·change, and every triangle below lies inside. What they do not do together is room in
/// the boxes. As large as a WideNode.
struct alignas(64) MovingNode {
    float bounds[6][wide];  ///< as those of WideNode
    ChildRef child[wide];
    float change[3];
};

/// The triangles of a tree that move over the same number of segments. One tree for all of these;
/// only the boxes differ. Node 0 is the root.
struct MovingTree {
    uint32_t segments = 0;
    uint32_t slabs = 1;  ///< equal parts of each segment that have boxes of their own
    size_t node_count = 0;
    std::vector<MovingNode, LargePages<MovingNode>> nodes;  ///< [segment][slab][node]
    std::vector<LeafBlock, LargePages<LeafBlock>> leaves;   ///< [block][key]
    size_t depth = 0;                                       ///< as WideTree's

    size_t bytes() const {
        return nodes.size() * sizeof(MovingNode) + leaves.size() * sizeof(LeafBlock);
    }
};

/// The triangles of a tree that move.
struct MovingTrees {
    std::vector<MovingTree> trees;  ///< none of them empty
    Box3 bounds;                    ///< of all keys of all of them; what rays are made ready for
    QueryBounds query_bounds;       ///< the same

    bool is_empty() const { return trees.empty(); }
};

/// Levels that a traversal stack has room for; the builder promises not to go deeper.
inline constexpr size_t max_wide_depth = 96;

}  // namespace velatura::accel
