// SPDX-License-Identifier: Apache-2.0
#include "lights/emitter_tree.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::lights {

namespace {

constexpr size_t longest_list = 16;
constexpr uint32_t largest_leaf = 4;

}  // namespace

EmitterTree::EmitterTree(std::vector<Item> items) : items_(std::move(items)) {
    if (items_.size() <= longest_list) return;
    for (Item& item : items_) {
        // Widen by more than the rounding of boxes and of the test below, relative to the
        // coordinates
        Box3d& b = item.box;
        for (int i = 0; i < 3; ++i) {
            const double margin = 1e-12 * std::max(std::abs(b.min[i]), std::abs(b.max[i]));
            b.min[i] -= margin;
            b.max[i] += margin;
        }
    }
    nodes_.reserve(2 * items_.size());
    nodes_.emplace_back();
    build(0, 0, uint32_t(items_.size()));
}

void EmitterTree::build(uint32_t node, uint32_t first, uint32_t count) {
    Box3d box, centres;
    for (uint32_t i = first; i < first + count; ++i) {
        box.extendBy(items_[i].box);
        centres.extendBy(items_[i].box.center());
    }
    nodes_[node].box = box;
    if (count <= largest_leaf) {
        nodes_[node].first = first;
        nodes_[node].count = count;
        return;
    }
    // Halve by number along the widest axis: depth stays below log2(count), whatever the positions
    const int axis = int(centres.majorAxis());
    const uint32_t middle = first + count / 2;
    std::nth_element(items_.begin() + first, items_.begin() + middle,
                     items_.begin() + first + count, [axis](const Item& a, const Item& b) {
                         const double ca = a.box.min[axis] + a.box.max[axis];
                         const double cb = b.box.min[axis] + b.box.max[axis];
                         return ca != cb ? ca < cb : a.light < b.light;
                     });
    const uint32_t left = uint32_t(nodes_.size());
    nodes_.emplace_back();
    nodes_.emplace_back();
    nodes_[node].first = left;
    build(left, first, middle - first);
    build(left + 1, middle, first + count - middle);
}

bool EmitterTree::may_meet(const Box3d& box, const Vec3d& o, const Vec3d& inverse, double t_max) {
    double near = 0.0, far = t_max;
    for (int i = 0; i < 3; ++i) {
        const double a = (box.min[i] - o[i]) * inverse[i];
        const double b = (box.max[i] - o[i]) * inverse[i];
        // 0 · infinity: the ray runs inside a side of the box, this axis decides nothing
        if (std::isnan(a) || std::isnan(b)) continue;
        near = std::max(near, std::min(a, b));
        far = std::min(far, std::max(a, b));
    }
    return near <= far * (1.0 + 1e-14);
}

}  // namespace velatura::lights
