// SPDX-License-Identifier: Apache-2.0
#include "accel/bvh_collapse.h"

#include "base/check.h"
#include "base/tasks.h"

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <vector>

namespace velatura::accel {

namespace {

constexpr uint32_t parallel_plan_count = 16384;  // references of subtrees planned on one thread
constexpr size_t leaf_grain = 1024;

// How best to cover a binary node with at most i + 1 roots (i = 0 … 6): the cost of it.
using CoverCosts = std::array<float, 7>;

// What the choice was: `split[i]` says how many of the roots the first child gets, or that fewer
// roots are no worse. split[7]: the same for the eight children of a wide node made of this node.
struct Choice {
    static constexpr uint8_t fewer = 0;
    std::array<uint8_t, 8> split;
    bool is_leaf;
};

// The binary nodes that become children of one wide node.
struct Children {
    std::array<uint32_t, wide> node;
    size_t count = 0;

    void push_back(uint32_t i) { node[count++] = i; }
};

class Collapser {
  public:
    Collapser(const BinaryTree& binary, size_t leaf_size, const CollapseCosts& costs)
        : binary_(binary.nodes.data()), leaf_size_(leaf_size), costs_(costs) {
        // Areas relative to the root, so that no cost overflows
        area_scale_ = 1.0 / std::max(binary_[0].half_area(), std::numeric_limits<double>::min());
        choices_ = std::make_unique_for_overwrite<Choice[]>(binary.node_count);
        CoverCosts costs_of_root;
        plan(0, costs_of_root);
        const BinaryNode& root = binary_[0];
        tree_.bounds = Box3(Vec3(root.lower[0], root.lower[1], root.lower[2]),
                            Vec3(root.upper[0], root.upper[1], root.upper[2]));
        tree_.query_bounds = QueryBounds(tree_.bounds);
        size_t nodes = 1, leaves = 0;
        const Children top = children_of_root();
        count(top, nodes, leaves);
        tree_.nodes.reserve(nodes);
        leaves_.reserve(leaves);
        tree_.nodes.emplace_back();
        emit(0, top, 1);
        VELATURA_CHECK(tree_.depth <= max_wide_depth, "tree too deep for the traversal stack");
    }

    // A leaf and the place that names it.
    struct Leaf {
        uint32_t binary, node, lane;
    };

    const std::vector<Leaf>& leaves() const { return leaves_; }

    WideTree& tree() { return tree_; }

  private:
    void plan(uint32_t i, CoverCosts& cost) const {
        const BinaryNode& node = binary_[i];
        Choice& choice = choices_[i];
        const auto area = float(node.half_area() * area_scale_);
        const float leaf_cost = node.count <= leaf_size_ ? area * float(costs_.leaf)
                                                         : std::numeric_limits<float>::infinity();
        if (node.is_leaf()) {
            choice.is_leaf = true;
            cost.fill(leaf_cost);
            return;
        }
        CoverCosts left, right;
        if (node.count >= parallel_plan_count) {
            parallel_for(2, [&](size_t side) {
                plan(node.child() + uint32_t(side), side == 0 ? left : right);
            });
        } else {
            plan(node.child(), left);
            plan(node.child() + 1, right);
        }
        std::array<float, 8> shared{};
        for (size_t roots = 2; roots <= 8; ++roots) {
            float best = std::numeric_limits<float>::infinity();
            uint8_t best_left = 1;
            for (size_t k = 1; k < roots; ++k) {
                const float sum = left[k - 1] + right[roots - k - 1];
                if (sum < best) {
                    best = sum;
                    best_left = uint8_t(k);
                }
            }
            shared[roots - 1] = best;
            choice.split[roots - 1] = best_left;
        }
        const float node_cost = shared[7] + area * float(costs_.node);
        choice.is_leaf = leaf_cost <= node_cost;
        cost[0] = std::min(leaf_cost, node_cost);
        for (size_t roots = 2; roots <= 7; ++roots) {
            cost[roots - 1] = shared[roots - 1];
            if (cost[roots - 2] <= shared[roots - 1]) {
                cost[roots - 1] = cost[roots - 2];
                choice.split[roots - 1] = Choice::fewer;
            }
        }
    }

    // Roots that cover binary node i when `slot` + 1 are allowed.
    void cover(uint32_t i, size_t slot, Children& roots) const {
        if (!binary_[i].is_leaf()) {
            while (slot > 0 && choices_[i].split[slot] == Choice::fewer) --slot;
        }
        if (slot == 0 || binary_[i].is_leaf()) {
            roots.push_back(i);
        } else {
            gather(i, slot, roots);
        }
    }

    void gather(uint32_t i, size_t slot, Children& roots) const {
        const size_t left = choices_[i].split[slot];
        cover(binary_[i].child(), left - 1, roots);
        cover(binary_[i].child() + 1, slot - left, roots);
    }

    // Larger ones first.
    Children children_of(uint32_t i) const {
        Children children;
        gather(i, wide - 1, children);
        std::array<double, wide> area;
        for (size_t lane = 0; lane < children.count; ++lane)
            area[lane] = binary_[children.node[lane]].half_area();
        for (size_t lane = 1; lane < children.count; ++lane) {
            for (size_t k = lane; k > 0 && area[k] > area[k - 1]; --k) {
                std::swap(area[k], area[k - 1]);
                std::swap(children.node[k], children.node[k - 1]);
            }
        }
        return children;
    }

    // A root that would be a leaf still becomes a node.
    Children children_of_root() const {
        if (!choices_[0].is_leaf) return children_of(0);
        Children children;
        children.push_back(0);
        return children;
    }

    void count(const Children& children, size_t& nodes, size_t& leaves) const {
        for (size_t lane = 0; lane < children.count; ++lane) {
            const uint32_t child = children.node[lane];
            if (choices_[child].is_leaf) {
                ++leaves;
            } else {
                ++nodes;
                Children below;
                gather(child, wide - 1, below);
                count(below, nodes, leaves);
            }
        }
    }

    void emit(uint32_t at, const Children& children, size_t depth) {
        tree_.depth = std::max(tree_.depth, depth);
        // Inner children get neighboring places
        auto next = uint32_t(tree_.nodes.size());
        WideNode& node = tree_.nodes[at];
        constexpr float inf = std::numeric_limits<float>::infinity();
        for (size_t lane = 0; lane < wide; ++lane) {
            const BinaryNode* child =
                lane < children.count ? &binary_[children.node[lane]] : nullptr;
            for (size_t k = 0; k < 3; ++k) {
                node.bounds[k][lane] = child ? child->lower[k] : inf;
                node.bounds[k + 3][lane] = child ? child->upper[k] : -inf;
            }
            node.child[lane] = 0;
            if (!child) continue;
            if (choices_[children.node[lane]].is_leaf) {
                node.child[lane] = leaf_bit | uint32_t(leaves_.size());
                leaves_.push_back({children.node[lane], at, uint32_t(lane)});
            } else {
                node.child[lane] = next++;
            }
        }
        tree_.nodes.resize(next);
        for (size_t lane = 0; lane < children.count; ++lane) {
            const ChildRef ref = tree_.nodes[at].child[lane];
            if (ref & leaf_bit) continue;
            emit(ref, children_of(children.node[lane]), depth + 1);
        }
    }

    const BinaryNode* binary_;
    size_t leaf_size_;
    CollapseCosts costs_;
    double area_scale_ = 1;
    std::unique_ptr<Choice[]> choices_;
    std::vector<Leaf> leaves_;
    WideTree tree_;
};

}  // namespace

WideTree collapse(
    const BinaryTree& binary,
    size_t leaf_size,
    const CollapseCosts& costs,
    const std::function<void(size_t count)>& begin_leaves,
    const std::function<void(uint32_t index, std::span<const uint32_t> ids)>& make_leaf) {
    if (binary.is_empty()) return {};
    Collapser collapser(binary, leaf_size, costs);
    const auto& leaves = collapser.leaves();
    begin_leaves(leaves.size());
    parallel_for(
        leaves.size(),
        [&](size_t i) {
            const BinaryNode& node = binary.nodes[leaves[i].binary];
            const std::span ids(&binary.order[binary.first_reference(leaves[i].binary)],
                                node.count);
            make_leaf(uint32_t(i), ids);
        },
        leaf_grain);
    return std::move(collapser.tree());
}

WideTree collapse_to_ids(const BinaryTree& binary) {
    if (binary.is_empty()) return {};
    Collapser collapser(binary, 1, {});
    for (const auto& leaf : collapser.leaves()) {
        collapser.tree().nodes[leaf.node].child[leaf.lane] =
            leaf_bit | binary.order[binary.nodes[leaf.binary].first()];
    }
    return std::move(collapser.tree());
}

}  // namespace velatura::accel
