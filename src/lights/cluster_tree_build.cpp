// SPDX-License-Identifier: Apache-2.0
#include "base/check.h"
#include "base/tasks.h"
#include "lights/cluster_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace velatura::lights {
namespace {

/// From this depth on clusters are halved by count, so that a trail fits its bits.
constexpr int deepest_by_cost = 32;
constexpr size_t bin_count = 12;
/// Clusters of more leaves build their children side by side.
constexpr size_t parallel_size = size_t(1) << 15;

float float_below(double x) {
    const float y = float(x);
    return double(y) > x ? next_float_down(y) : y;
}

float float_above(double x) {
    return -float_below(-x);
}

/// What the choice of a plane looks at: small, since it is moved about.
struct BuildLeaf {
    Box3 box;
    Vec3 axis;
    float one_minus_cos_normals, intensity;
    uint32_t leaf;

    float center(int axis_index) const {
        return 0.5f * (box.min[axis_index] + box.max[axis_index]);
    }
};

float area_measure(const Box3& box) {
    const Vec3 s = box.size();
    // Flat clusters have an area of zero along one split: their extent keeps them apart
    return 2.0f * (s.x * s.y + s.y * s.z + s.z * s.x) + s.dot(s);
}

/// Leaves on one side of a plane, as far as their cost goes.
struct Bin {
    Box3 box;
    Vec3 axes = Vec3(0.0f);  // weighed by intensity, turned towards a common side
    float intensity = 0, one_minus_cos_normals = 0;
    size_t count = 0;

    void add(const BuildLeaf& leaf, const Vec3& side) {
        box.extendBy(leaf.box);
        axes += leaf.axis * (leaf.axis.dot(side) < 0.0f ? -leaf.intensity : leaf.intensity);
        intensity += leaf.intensity;
        one_minus_cos_normals = std::max(one_minus_cos_normals, leaf.one_minus_cos_normals);
        ++count;
    }

    void add(const Bin& other) {
        if (other.count == 0) return;
        box.extendBy(other.box);
        axes += other.axes;
        intensity += other.intensity;
        one_minus_cos_normals = std::max(one_minus_cos_normals, other.one_minus_cos_normals);
        count += other.count;
    }

    /// Strength × extent × solid angle that is shone into, about. Axes spread evenly over a cap of
    /// half angle θ have a mean of length (1 + cos θ) / 2.
    float cost() const {
        if (count == 0) return 0.0f;
        const float mean = std::min(axes.length() / intensity, 1.0f);
        const float cap = std::max(2.0f - 2.0f * mean, one_minus_cos_normals);
        return intensity * area_measure(box) * (1.0f + 2.0f * std::min(cap, 2.0f));
    }
};

struct Plane {
    int axis = -1;  // none
    size_t bin = 0;
    float low = 0, scale = 0;

    size_t bin_of(const BuildLeaf& leaf) const {
        // Written so that NaN, of an extent too small for its inverse, gives the first bin
        const float x = (leaf.center(axis) - low) * scale;
        return x > 0.0f ? size_t(std::min(x, float(bin_count - 1))) : 0;
    }
};

/// The cheapest of the planes between bins along each axis.
Plane cheapest_plane(const BuildLeaf* begin, const BuildLeaf* end) {
    Box3 centers;
    for (const BuildLeaf* leaf = begin; leaf != end; ++leaf)
        centers.extendBy({leaf->center(0), leaf->center(1), leaf->center(2)});
    const Vec3 size = centers.size();
    const float longest = std::max({size.x, size.y, size.z});
    Plane best;
    float min = std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
        if (!(size[axis] > 0.0f)) continue;
        Plane plane{axis, 0, centers.min[axis], float(bin_count) / size[axis]};
        std::array<Bin, bin_count> bins;
        for (const BuildLeaf* leaf = begin; leaf != end; ++leaf)
            bins[plane.bin_of(*leaf)].add(*leaf, begin->axis);
        std::array<float, bin_count> above{};
        Bin sum;
        for (size_t b = bin_count - 1; b > 0; --b) {
            sum.add(bins[b]);
            above[b] = bins[b].count > 0 || b + 1 == bin_count ? sum.cost() : above[b + 1];
        }
        sum = {};
        for (plane.bin = 0; plane.bin + 1 < bin_count; ++plane.bin) {
            if (bins[plane.bin].count == 0) continue;
            sum.add(bins[plane.bin]);
            // Thin slabs are worse clusters than their area tells
            const float cost = longest / size[axis] * (sum.cost() + above[plane.bin + 1]);
            if (sum.count == size_t(end - begin) || !(cost < min)) continue;
            min = cost;
            best = plane;
        }
    }
    return best;
}

ClusterTree::Node make_node(const LightBounds& bounds, double intensity_unit) {
    ClusterTree::Node n{};
    const Vec3d center = bounds.box.center(), half = bounds.box.size() / 2.0;
    n.center = to_float(center);
    const Vec3d moved = center - Vec3d(n.center);
    n.radius = float_above(std::sqrt(half.dot(half)) + std::sqrt(moved.dot(moved)));
    n.axis = to_float(bounds.cone.axis);
    n.cos_normals = float_below(std::cos(bounds.cone.normals));
    n.cos_spread = float_below(std::cos(bounds.cone.spread));
    // Strengths below the range of float stay what can be chosen
    n.intensity =
        std::max(float(bounds.cone.intensity / intensity_unit), std::numeric_limits<float>::min());
    n.is_two_sided = bounds.cone.is_two_sided;
    return n;
}

/// Builds the subtree of some leaves. A subtree of n leaves has 2n − 2 nodes below its root, so
/// that every subtree knows its place beforehand and none waits for another.
class Builder {
  public:
    Builder(const std::vector<ClusterTree::Leaf>& leaves,
            std::vector<ClusterTree::Node>& nodes,
            double intensity_unit)
        : leaves_(leaves), nodes_(nodes), intensity_unit_(intensity_unit) {
        order_.reserve(leaves.size());
        for (uint32_t i = 0; i < leaves.size(); ++i) {
            const LightBounds& b = leaves[i].bounds;
            BuildLeaf leaf{};
            leaf.box = Box3(to_float(b.box.min), to_float(b.box.max));
            leaf.axis = to_float(b.cone.axis);
            leaf.one_minus_cos_normals = float(1.0 - std::cos(b.cone.normals));
            leaf.intensity = std::max(float(b.cone.intensity / intensity_unit),
                                      std::numeric_limits<float>::min());
            leaf.leaf = i;
            order_.push_back(leaf);
        }
    }

    LightBounds build() { return build(0, 0, order_.size(), 1, 0); }

  private:
    LightBounds build(uint32_t node, size_t first, size_t end, uint32_t free, int depth) {
        if (end - first == 1) {
            const ClusterTree::Leaf& leaf = leaves_[order_[first].leaf];
            nodes_[node] = make_node(leaf.bounds, intensity_unit_);
            nodes_[node].left = leaf.item;
            nodes_[node].is_leaf = true;
            return leaf.bounds;
        }
        const size_t middle = split(first, end, depth);
        const uint32_t left = free;
        const uint32_t left_below = left + 2;
        const uint32_t right_below = left_below + 2 * uint32_t(middle - first) - 2;
        LightBounds children[2];
        const auto build_child = [&](size_t which) {
            children[which] = which == 0 ? build(left, first, middle, left_below, depth + 1)
                                         : build(left + 1, middle, end, right_below, depth + 1);
        };
        if (end - first > parallel_size) {
            parallel_for(2, build_child);
        } else {
            build_child(0);
            build_child(1);
        }
        const LightBounds both = LightBounds::merged(children[0], children[1]);
        nodes_[node] = make_node(both, intensity_unit_);
        nodes_[node].left = left;
        nodes_[node].is_leaf = false;
        return both;
    }

    /// Puts the leaves of the left child first; returns where the right child's begin.
    size_t split(size_t first, size_t end, int depth) {
        const auto at = [this](size_t i) { return order_.data() + i; };
        size_t middle = first;
        if (end - first > 2 && depth < deepest_by_cost) {
            const Plane plane = cheapest_plane(at(first), at(end));
            if (plane.axis >= 0) {
                const BuildLeaf* right = std::stable_partition(
                    at(first), at(end),
                    [&](const BuildLeaf& leaf) { return plane.bin_of(leaf) <= plane.bin; });
                middle = size_t(right - at(0));
            }
        }
        // In the middle where no plane divides
        return middle == first || middle == end ? first + (end - first) / 2 : middle;
    }

    const std::vector<ClusterTree::Leaf>& leaves_;
    std::vector<ClusterTree::Node>& nodes_;
    double intensity_unit_;
    std::vector<BuildLeaf> order_;
};

}  // namespace

ClusterTree::ClusterTree(std::vector<Leaf> leaves) {
    if (leaves.empty()) return;
    VELATURA_CHECK(leaves.size() < size_t(1) << 31, "too many lights for one tree");
    double total = 0.0;
    for (const Leaf& leaf : leaves) total += leaf.bounds.cone.intensity;
    int exponent = 0;
    if (total > 0.0 && std::isfinite(total)) std::frexp(total, &exponent);
    intensity_unit_ = std::ldexp(1.0, exponent);
    nodes_.resize(2 * leaves.size() - 1);
    bounds_ = Builder(leaves, nodes_, intensity_unit_).build();
}

}  // namespace velatura::lights
