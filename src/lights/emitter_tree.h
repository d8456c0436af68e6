// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace velatura::lights {

/// Finds the finite lights whose boxes a ray crosses. A list below 17 lights, a tree of boxes
/// above.
class EmitterTree {
  public:
    struct Item {
        uint32_t light = 0;
        Box3d box;
    };

    explicit EmitterTree(std::vector<Item> items);

    /// Calls visit(light) for every item whose box may meet o + t·d, 0 <= t <= t_max; boxes are
    /// never missed. The order depends on the items only.
    template <class Visitor>
    void for_each(const Vec3d& o, const Vec3d& d, double t_max, Visitor&& visit) const {
        if (nodes_.empty()) {
            for (const uint32_t light : short_list_) visit(light);
            return;
        }
        const Line line(o, d, t_max);
        if (!can_intersect(node(0), line)) return;
        const Node* stack[64];
        uint32_t depth = 0;
        stack[depth++] = &node(0);
        while (depth > 0) {
            const Node& parent = *stack[--depth];
            // Children and lights are tested here, where they lie side by side
            for (uint32_t i = 0; i < std::max(parent.count, 2u); ++i) {
                const Node& below = node(parent.first + i);
                if (!can_intersect(below, line)) continue;
                if (parent.count > 0) {
                    visit(below.first);
                } else {
                    __builtin_prefetch(&node(below.first));
                    stack[depth++] = &below;
                }
            }
        }
    }

  private:
    /// Half a cache line: siblings share one. Boxes in float hold those in double.
    struct alignas(32) Node {
        Box3 box;
        uint32_t first =
            0;  // inner: left child, the right one follows; leaf: lights; light: itself
        uint32_t count = 0;  // of lights below a leaf; 0 = inner node or light
    };

    struct alignas(64) Pair {
        Node nodes[2];
    };

    struct Line {
        Line(const Vec3d& origin, const Vec3d& d, double end)
            : o(origin), inverse(1.0 / d.x, 1.0 / d.y, 1.0 / d.z), t_max(end) {
            const double sum = std::abs(inverse.x) + std::abs(inverse.y) + std::abs(inverse.z);
            is_skew = sum <= std::numeric_limits<double>::max();
        }

        Vec3d o, inverse;
        double t_max;
        bool is_skew;  ///< along no side of a box
    };

    const Node& node(uint32_t i) const { return nodes_[i / 2].nodes[i % 2]; }

    Node& node(uint32_t i) { return nodes_[i / 2].nodes[i % 2]; }

    static bool can_intersect(const Node& node, const Line& line) {
        return line.is_skew ? can_intersect_skew(node, line) : can_intersect_along_side(node, line);
    }

    static bool can_intersect_skew(const Node& node, const Line& line) {
        double near = 0.0, far = line.t_max;
        for (int i = 0; i < 3; ++i) {
            const double a = (double(node.box.min[i]) - line.o[i]) * line.inverse[i];
            const double b = (double(node.box.max[i]) - line.o[i]) * line.inverse[i];
            near = std::max(near, std::min(a, b));
            far = std::min(far, std::max(a, b));
        }
        return near <= far * (1.0 + 1e-14);
    }

    static bool can_intersect_along_side(const Node& node, const Line& line);
    void build(uint32_t number, Item* items, uint32_t count);
    uint32_t add_nodes(uint32_t count);

    std::vector<uint32_t> short_list_;  // instead of a tree
    std::vector<Pair> nodes_;           // the root, then siblings and the lights of leaves
};

}  // namespace velatura::lights
