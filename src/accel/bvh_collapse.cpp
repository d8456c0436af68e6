// SPDX-License-Identifier: Apache-2.0
#include "accel/bvh_collapse.h"

#include "base/check.h"

#include <algorithm>
#include <array>
#include <limits>

namespace velatura::accel {

namespace {

// For one binary node, how best to cover it with at most i + 1 roots (i = 0 … 6); `split[i]` says
// how many of them the left child gets, or that fewer roots are no worse. split[7]: the same for
// the eight children of a wide node made of this node.
struct Plan {
    static constexpr uint8_t fewer = 0;
    std::array<float, 7> cost;
    std::array<uint8_t, 8> split{};
    bool is_leaf = false;
};

class Collapser {
  public:
    Collapser(const std::vector<BinaryNode>& binary,
              std::span<const BuildPrim> prims,
              size_t leaf_size,
              const CollapseCosts& costs,
              const MakeLeaf& make_leaf)
        : binary_(binary),
          prims_(prims),
          leaf_size_(leaf_size),
          costs_(costs),
          make_leaf_(make_leaf) {}

    WideTree run() {
        if (binary_.empty()) return {};
        // Areas relative to the root, so that no cost overflows
        area_scale_ = 1.0 / std::max(binary_[0].half_area(), std::numeric_limits<double>::min());
        plan();
        tree_.bounds = Box3(Vec3(binary_[0].lower[0], binary_[0].lower[1], binary_[0].lower[2]),
                            Vec3(binary_[0].upper[0], binary_[0].upper[1], binary_[0].upper[2]));
        tree_.query_bounds = QueryBounds(tree_.bounds);
        tree_.nodes.emplace_back();
        std::vector<uint32_t> children;
        // A root that would be a leaf still becomes a node
        if (plans_[0].is_leaf) {
            children.push_back(0);
        } else {
            gather(0, 7, children);
        }
        emit(0, children, 1);
        VELATURA_CHECK(tree_.depth <= max_wide_depth, "tree too deep for the traversal stack");
        return std::move(tree_);
    }

  private:
    // Children have larger indices than their parents.
    void plan() {
        plans_.resize(binary_.size());
        for (size_t i = binary_.size(); i-- > 0;) {
            if (binary_[i].count > 0) plan_node(i);
        }
    }

    void plan_node(size_t i) {
        const BinaryNode& node = binary_[i];
        Plan& plan = plans_[i];
        const auto area = float(node.half_area() * area_scale_);
        const float leaf_cost = node.count <= leaf_size_ ? area * float(costs_.leaf)
                                                         : std::numeric_limits<float>::infinity();
        if (node.is_leaf()) {
            plan.is_leaf = true;
            plan.cost.fill(leaf_cost);
            return;
        }
        const Plan& left = plans_[i + 1];
        const Plan& right = plans_[node.right];
        std::array<float, 8> shared{};
        for (size_t roots = 2; roots <= 8; ++roots) {
            float best = std::numeric_limits<float>::infinity();
            uint8_t best_left = 1;
            for (size_t k = 1; k < roots; ++k) {
                const float cost = left.cost[k - 1] + right.cost[roots - k - 1];
                if (cost < best) {
                    best = cost;
                    best_left = uint8_t(k);
                }
            }
            shared[roots - 1] = best;
            plan.split[roots - 1] = best_left;
        }
        const float node_cost = shared[7] + area * float(costs_.node);
        plan.is_leaf = leaf_cost <= node_cost;
        plan.cost[0] = std::min(leaf_cost, node_cost);
        for (size_t roots = 2; roots <= 7; ++roots) {
            plan.cost[roots - 1] = shared[roots - 1];
            if (plan.cost[roots - 2] <= shared[roots - 1]) {
                plan.cost[roots - 1] = plan.cost[roots - 2];
                plan.split[roots - 1] = Plan::fewer;
            }
        }
    }

    // Roots that cover binary node i when `slot` + 1 are allowed.
    void cover(size_t i, size_t slot, std::vector<uint32_t>& roots) const {
        const Plan& plan = plans_[i];
        if (!binary_[i].is_leaf()) {
            while (slot > 0 && plan.split[slot] == Plan::fewer) --slot;
        }
        if (slot == 0 || binary_[i].is_leaf()) {
            roots.push_back(uint32_t(i));
        } else {
            gather(i, slot, roots);
        }
    }

    void gather(size_t i, size_t slot, std::vector<uint32_t>& roots) const {
        const size_t left = plans_[i].split[slot];
        cover(i + 1, left - 1, roots);
        cover(binary_[i].right, slot - left, roots);
    }

    void emit(size_t at, std::vector<uint32_t>& children, size_t depth) {
        tree_.depth = std::max(tree_.depth, depth);
        std::sort(children.begin(), children.end(), [&](uint32_t a, uint32_t b) {
            const double area_a = binary_[a].half_area(), area_b = binary_[b].half_area();
            return area_a != area_b ? area_a > area_b : a < b;
        });
        // Inner children get neighbouring places
        size_t next = tree_.nodes.size();
        for (const uint32_t c : children) {
            if (!plans_[c].is_leaf) tree_.nodes.emplace_back();
        }
        WideNode node;
        constexpr float inf = std::numeric_limits<float>::infinity();
        for (size_t lane = 0; lane < wide; ++lane) {
            const BinaryNode* child = lane < children.size() ? &binary_[children[lane]] : nullptr;
            for (size_t k = 0; k < 3; ++k) {
                node.bounds[k][lane] = child ? child->lower[k] : inf;
                node.bounds[k + 3][lane] = child ? child->upper[k] : -inf;
            }
            node.extent[lane] = 0;
            node.child[lane] = 0;
            if (!child) continue;
            for (size_t k = 0; k < 3; ++k) {
                node.extent[lane] = std::max(node.extent[lane], child->upper[k] - child->lower[k]);
            }
            if (plans_[children[lane]].is_leaf) {
                node.child[lane] =
                    leaf_bit | make_leaf_(prims_.subspan(child->first, child->count));
            } else {
                node.child[lane] = uint32_t(next++);
            }
        }
        tree_.nodes[at] = node;
        for (size_t lane = 0; lane < children.size(); ++lane) {
            if (node.child[lane] & leaf_bit) continue;
            std::vector<uint32_t> below;
            gather(children[lane], 7, below);
            emit(node.child[lane], below, depth + 1);
        }
    }

    const std::vector<BinaryNode>& binary_;
    std::span<const BuildPrim> prims_;
    size_t leaf_size_;
    CollapseCosts costs_;
    const MakeLeaf& make_leaf_;
    double area_scale_ = 1;
    std::vector<Plan> plans_;
    WideTree tree_;
};

}  // namespace

WideTree collapse(const std::vector<BinaryNode>& binary,
                  std::span<const BuildPrim> prims,
                  size_t leaf_size,
                  const CollapseCosts& costs,
                  const MakeLeaf& make_leaf) {
    return Collapser(binary, prims, leaf_size, costs, make_leaf).run();
}

}  // namespace velatura::accel
