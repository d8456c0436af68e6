// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cstdint>
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
            for (const Item& item : items_) visit(item.light);
            return;
        }
        const Vec3d inverse(1.0 / d.x, 1.0 / d.y, 1.0 / d.z);
        uint32_t stack[64];
        uint32_t depth = 0;
        stack[depth++] = 0;
        while (depth > 0) {
            const Node& node = nodes_[stack[--depth]];
            if (!may_meet(node.box, o, inverse, t_max)) continue;
            if (node.count > 0) {
                for (uint32_t i = 0; i < node.count; ++i) visit(items_[node.first + i].light);
            } else {
                stack[depth++] = node.first;
                stack[depth++] = node.first + 1;
            }
        }
    }

  private:
    struct Node {
        Box3d box;
        uint32_t first = 0;  // item of a leaf, left child of an inner node (the right one follows)
        uint32_t count = 0;  // items of a leaf; 0 = inner node
    };

    static bool may_meet(const Box3d& box, const Vec3d& o, const Vec3d& inverse, double t_max);
    void build(uint32_t node, uint32_t first, uint32_t count);

    std::vector<Item> items_;
    std::vector<Node> nodes_;
};

}  // namespace velatura::lights
