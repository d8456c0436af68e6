// SPDX-License-Identifier: Apache-2.0
#include "accel/motion_fit.h"

#include "base/tasks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace velatura::accel {

namespace {

// What a node holds in a segment.
struct NodeFit {
    std::array<KeyBoxes, wide> children;
    float change[3] = {};
};

// A part of the way from one key to the next.
struct Slab {
    double begin = 0, end = 1;
};

// How the children of a node move along an axis: so that the sum of what their boxes grow by, for
// each does something else, is least. A box whose bounds change by a and b grows by
// max(change − a, 0) + max(b − change, 0); the median of all a and b makes the sum least.
float common_change(const NodeFit& fit, int axis) {
    std::array<float, 2 * wide> changes;
    size_t count = 0;
    for (const KeyBoxes& box : fit.children) {
        if (box.is_empty()) continue;
        changes[count++] = box.to.min[axis] - box.from.min[axis];
        changes[count++] = box.to.max[axis] - box.from.max[axis];
    }
    if (count == 0) return 0;
    const auto middle = changes.begin() + std::ptrdiff_t(count / 2);
    std::nth_element(changes.begin(), middle, changes.begin() + std::ptrdiff_t(count));
    return *middle;
}

// Areas of boxes halfway, as they are and as they are when 2^i slabs share the way.
struct Areas {
    double exact = 0;
    std::array<double, 5> grown = {};

    void add(const NodeFit& fit) {
        for (const KeyBoxes& box : fit.children) {
            if (box.is_empty()) continue;
            double size[3], growth[3];
            for (int k = 0; k < 3; ++k) {
                const double first = double(box.from.max[k]) - double(box.from.min[k]);
                const double last = double(box.to.max[k]) - double(box.to.min[k]);
                const double change = double(fit.change[k]);
                size[k] = 0.5 * (first + last);
                growth[k] =
                    std::max(change - (double(box.to.min[k]) - double(box.from.min[k])), 0.0) +
                    std::max(double(box.to.max[k]) - double(box.from.max[k]) - change, 0.0);
            }
            const auto area = [&](double share) {
                const double x = size[0] + share * growth[0], y = size[1] + share * growth[1],
                             z = size[2] + share * growth[2];
                return x * y + y * z + z * x;
            };
            exact += area(0);
            for (size_t i = 0; i < grown.size(); ++i) grown[i] += area(1 / double(1u << i));
        }
    }

    // As few as make boxes hardly larger than they must be, as far as there are so many.
    uint32_t slabs() const {
        constexpr double tolerable = 1.15;
        size_t i = 0;
        while (i + 1 < grown.size() && grown[i] > tolerable * exact) ++i;
        return 1u << i;
    }
};

// A bound that moves by `change`: bound + f·change, as kernels compute it, is not above any
// coordinate that moves from at least a to at least b, as geometry::moved computes that. The former
// errs by less than 4 and the latter by less than 6 times 2^-24 of `largest`, which no coordinate
// of the box exceeds, nor its sum with the change. Kernels choose the slab by the same f, rounded
// once.
float lower_bound(double a, double b, double change, double largest, const Slab& slab) {
    const double rest = b - a - change;
    const double min = a + std::min(slab.begin * rest, slab.end * rest);
    return next_float_down(float(min - 10 * 0x1p-24 * largest - 0x1p-140));
}

void set_boxes(MovingNode& node, const NodeFit& fit, const Slab& slab) {
    constexpr float inf = std::numeric_limits<float>::infinity();
    for (int k = 0; k < 3; ++k) {
        const auto change = double(fit.change[k]);
        node.change[k] = fit.change[k];
        for (size_t lane = 0; lane < wide; ++lane) {
            const KeyBoxes& box = fit.children[lane];
            node.bounds[k][lane] = inf;
            node.bounds[k + 3][lane] = -inf;
            if (box.is_empty()) continue;
            const double lower[2] = {double(box.from.min[k]), double(box.to.min[k])};
            const double upper[2] = {double(box.from.max[k]), double(box.to.max[k])};
            const double largest = std::max(std::max(std::abs(lower[0]), std::abs(lower[1])),
                                            std::max(std::abs(upper[0]), std::abs(upper[1]))) +
                                   std::abs(change);
            node.bounds[k][lane] = lower_bound(lower[0], lower[1], change, largest, slab);
            node.bounds[k + 3][lane] = -lower_bound(-upper[0], -upper[1], -change, largest, slab);
        }
    }
}

std::vector<NodeFit> fits_of(
    const WideTree& shape,
    const std::function<KeyBoxes(uint32_t leaf, uint32_t segment)>& box_of_leaf,
    uint32_t segment) {
    std::vector<NodeFit> fits(shape.nodes.size());
    // Children come after their parents
    for (size_t i = shape.nodes.size(); i-- > 0;) {
        const WideNode& node = shape.nodes[i];
        for (size_t lane = 0; lane < wide; ++lane) {
            const bool is_used = node.bounds[0][lane] <= node.bounds[3][lane];
            if (!is_used) continue;
            const ChildRef child = node.child[lane];
            KeyBoxes& boxes = fits[i].children[lane];
            if (child & leaf_bit) {
                boxes = box_of_leaf(child & ~leaf_bit, segment);
            } else {
                for (const KeyBoxes& below : fits[child].children) boxes.extend(below);
            }
        }
        for (int k = 0; k < 3; ++k) fits[i].change[k] = common_change(fits[i], k);
    }
    return fits;
}

}  // namespace

void fit_boxes(const WideTree& shape,
               const std::function<KeyBoxes(uint32_t leaf, uint32_t segment)>& box_of_leaf,
               MovingTree& tree) {
    const size_t segments = tree.segments;
    tree.depth = shape.depth;
    tree.node_count = shape.nodes.size();
    std::vector<std::vector<NodeFit>> fits(segments);
    std::vector<uint32_t> slabs(segments);
    parallel_for(segments, [&](size_t segment) {
        fits[segment] = fits_of(shape, box_of_leaf, uint32_t(segment));
        Areas areas;
        for (const NodeFit& fit : fits[segment]) areas.add(fit);
        slabs[segment] = areas.slabs();
    });
    tree.slabs = *std::max_element(slabs.begin(), slabs.end());
    tree.nodes.resize(tree.node_count * segments * tree.slabs);
    parallel_for(segments * tree.slabs, [&](size_t i) {
        const size_t segment = i / tree.slabs, slab = i % tree.slabs;
        const Slab part = {double(slab) / tree.slabs, double(slab + 1) / tree.slabs};
        MovingNode* const nodes = tree.nodes.data() + i * tree.node_count;
        for (size_t k = 0; k < tree.node_count; ++k) {
            std::copy_n(shape.nodes[k].child, wide, nodes[k].child);
            set_boxes(nodes[k], fits[segment][k], part);
        }
    });
}

}  // namespace velatura::accel
