// SPDX-License-Identifier: Apache-2.0
#include "lights/emitter_tree.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::lights {

namespace {

constexpr size_t longest_list = 16;
constexpr uint32_t largest_leaf = 4;

/// The smallest box in float around a box that is widened by more than the rounding of boxes and of
/// the test, relative to the coordinates.
Box3 widened(const Box3d& b) {
    Box3 out;
    for (int i = 0; i < 3; ++i) {
        const double margin = 1e-12 * std::max(std::abs(b.min[i]), std::abs(b.max[i]));
        const double low = b.min[i] - margin, high = b.max[i] + margin;
        out.min[i] = float(low);
        out.max[i] = float(high);
        if (double(out.min[i]) > low) out.min[i] = next_float_down(out.min[i]);
        if (double(out.max[i]) < high) out.max[i] = next_float_up(out.max[i]);
    }
    return out;
}

}  // namespace

EmitterTree::EmitterTree(std::vector<Item> items) {
    if (items.size() <= longest_list) {
        for (const Item& item : items) short_list_.push_back(item.light);
        return;
    }
    nodes_.reserve(3 * items.size() / 2);
    build(add_nodes(1), items.data(), uint32_t(items.size()));
}

/// Room for this many nodes side by side.
uint32_t EmitterTree::add_nodes(uint32_t count) {
    const uint32_t first = uint32_t(2 * nodes_.size());
    nodes_.resize(nodes_.size() + (count + 1) / 2);
    return first;
}

void EmitterTree::build(uint32_t number, Item* items, uint32_t count) {
    Box3d box, centers;
    for (uint32_t i = 0; i < count; ++i) {
        box.extendBy(items[i].box);
        centers.extendBy(items[i].box.center());
    }
    node(number).box = widened(box);
    if (count <= largest_leaf) {
        const uint32_t first = add_nodes(count);
        node(number).first = first;
        node(number).count = count;
        for (uint32_t i = 0; i < count; ++i) {
            node(first + i).box = widened(items[i].box);
            node(first + i).first = items[i].light;
        }
        return;
    }
    // Halve by number along the widest axis: depth stays below log2(count), whatever the positions
    const int axis = int(centers.majorAxis());
    const uint32_t middle = count / 2;
    std::nth_element(items, items + middle, items + count, [axis](const Item& a, const Item& b) {
        const double ca = a.box.min[axis] + a.box.max[axis];
        const double cb = b.box.min[axis] + b.box.max[axis];
        return ca != cb ? ca < cb : a.light < b.light;
    });
    const uint32_t left = add_nodes(2);
    node(number).first = left;
    build(left, items, middle);
    build(left + 1, items + middle, count - middle);
}

bool EmitterTree::can_intersect_along_side(const Node& node, const Line& line) {
    double near = 0.0, far = line.t_max;
    for (int i = 0; i < 3; ++i) {
        const double a = (double(node.box.min[i]) - line.o[i]) * line.inverse[i];
        const double b = (double(node.box.max[i]) - line.o[i]) * line.inverse[i];
        // 0 · infinity: the ray runs inside a side of the box, this axis decides nothing
        if (std::isnan(a) || std::isnan(b)) continue;
        near = std::max(near, std::min(a, b));
        far = std::min(far, std::max(a, b));
    }
    return near <= far * (1.0 + 1e-14);
}

}  // namespace velatura::lights
