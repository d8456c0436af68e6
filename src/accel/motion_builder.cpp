// SPDX-License-Identifier: Apache-2.0
#include "accel/motion_builder.h"

#include "accel/bvh_builder.h"
#include "accel/bvh_collapse.h"
#include "accel/ray_query.h"
#include "base/check.h"
#include "base/tasks.h"
#include "geometry/motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <vector>

namespace velatura::accel {

namespace {

struct Corners {
    Vec3 p[3];

    bool is_usable() const {
        return accel::is_usable(p[0]) && accel::is_usable(p[1]) && accel::is_usable(p[2]);
    }
};

// A box at both keys of a segment; empty where nothing is there.
struct KeyBoxes {
    Box3 from, to;

    bool is_empty() const { return from.isEmpty(); }

    void extend(const Corners& a, const Corners& b) {
        for (int i = 0; i < 3; ++i) {
            from.extendBy(a.p[i]);
            to.extendBy(b.p[i]);
        }
    }

    void extend(const KeyBoxes& other) {
        from.extendBy(other.from);
        to.extendBy(other.to);
    }
};

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
    const double least = a + std::min(slab.begin * rest, slab.end * rest);
    return next_float_down(float(least - 10 * 0x1p-24 * largest - 0x1p-140));
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

// The triangles of some shapes that move over the same number of segments.
class MotionBuilder {
  public:
    MotionBuilder(std::span<const TriangleSoupView> shapes,
                  const TriangleNumbers& numbers,
                  uint32_t segments)
        : shapes_(shapes), numbers_(numbers), segments_(segments) {}

    MovingTree run(const BvhOptions& options, Box3& bounds) const {
        BinaryBuildOptions binary_options = binary_options_of(options);
        binary_options.leaf_size = options.leaf_size;
        binary_options.block = wide;
        binary_options.merge_duplicates = [&](std::span<BuildPrim> range) {
            return merge_equal(range, [&](const BuildPrim& a, const BuildPrim& b) {
                return order_of_ways(a.id, b.id);
            });
        };
        const BinaryTree binary = build_binary_tree(collect(bounds), binary_options);
        MovingTree tree;
        tree.segments = segments_;
        const WideTree shape = collapse(
            binary, wide, {}, [&](size_t count) { tree.leaves.resize(count * (segments_ + 1)); },
            [&](uint32_t block, std::span<const uint32_t> ids) {
                fill_block(&tree.leaves[block * (segments_ + 1)], ids);
            });
        tree.depth = shape.depth;
        tree.node_count = shape.nodes.size();
        fit(shape, tree);
        return tree;
    }

  private:
    Corners corners(const TriangleSoupView& shape, size_t triangle, uint32_t key) const {
        const std::span<const Vec3> positions =
            key == 0 ? shape.positions : std::span<const Vec3>(shape.later_positions[key - 1]);
        const auto& v = shape.triangles[triangle];
        return {{positions[v[0]], positions[v[1]], positions[v[2]]}};
    }

    Corners corners(uint32_t id, uint32_t key) const {
        const uint32_t shape = numbers_.shape(id);
        return corners(shapes_[shape], id - numbers_.first(shape), key);
    }

    int order_of_ways(uint32_t a, uint32_t b) const {
        for (uint32_t key = 0; key <= segments_; ++key) {
            const Corners ca = corners(a, key), cb = corners(b, key);
            for (int i = 0; i < 3; ++i) {
                const int order = order_of(ca.p[i], cb.p[i]);
                if (order != 0) return order;
            }
        }
        return 0;
    }

    // With the boxes of triangles when the shutter is half through, or in the middle of the first
    // segment that they are there in.
    BuildPrims collect(Box3& bounds) const {
        size_t most = 0;
        for (const TriangleSoupView& shape : shapes_)
            most += shape.segments() == segments_ ? shape.triangles.size() : 0;
        BuildPrims prims(most);
        for (size_t s = 0; s < shapes_.size(); ++s) {
            if (shapes_[s].segments() != segments_) continue;
            for (size_t i = 0; i < shapes_[s].triangles.size(); ++i) {
                const Box3 box = half_through(shapes_[s], i, bounds);
                if (box.isEmpty()) continue;
                BuildPrim prim{};
                prim.id = numbers_.first(s) + uint32_t(i);
                for (int k = 0; k < 3; ++k) {
                    prim.lower[k] = box.min[k];
                    prim.upper[k] = box.max[k];
                }
                prims.push_back(prim);
            }
        }
        return prims;
    }

    // Empty: the triangle is never there. Also takes all that it is into `bounds`.
    Box3 half_through(const TriangleSoupView& shape, size_t triangle, Box3& bounds) const {
        const geometry::MotionTime half = geometry::motion_time(0.5f, segments_);
        Box3 box;
        Corners from = corners(shape, triangle, 0);
        for (uint32_t segment = 0; segment < segments_; ++segment) {
            const Corners to = corners(shape, triangle, segment + 1);
            if (from.is_usable() && to.is_usable()) {
                const bool is_half = segment == half.segment;
                if (is_half) box = Box3();
                const bool is_wanted = box.isEmpty();
                for (int k = 0; k < 3; ++k) {
                    bounds.extendBy(from.p[k]);
                    bounds.extendBy(to.p[k]);
                    if (is_wanted)
                        box.extendBy(geometry::moved(from.p[k], to.p[k], is_half ? half.f : 0.5f));
                }
            }
            from = to;
        }
        return box;
    }

    // Corners that are not usable become nothing that a ray meets, in the segments on either side.
    void fill_block(LeafBlock* keys, std::span<const uint32_t> ids) const {
        const Vec3 nowhere(std::numeric_limits<float>::quiet_NaN());
        for (uint32_t key = 0; key <= segments_; ++key) {
            LeafBlock& block = keys[key];
            for (size_t lane = 0; lane < wide; ++lane) {
                Corners c{{nowhere, nowhere, nowhere}};
                block.id[lane] = lane < ids.size() ? ids[lane] : unused_lane;
                if (lane < ids.size()) {
                    const Corners at_key = corners(ids[lane], key);
                    if (at_key.is_usable()) c = at_key;
                }
                for (int corner = 0; corner < 3; ++corner) {
                    for (int k = 0; k < 3; ++k) block.corner[corner][k][lane] = c.p[corner][k];
                }
            }
        }
    }

    static KeyBoxes boxes_of(const LeafBlock* keys) {
        KeyBoxes boxes;
        for (size_t lane = 0; lane < wide; ++lane) {
            const auto at = [&](const LeafBlock& block) {
                Corners c;
                for (int corner = 0; corner < 3; ++corner) {
                    for (int k = 0; k < 3; ++k) c.p[corner][k] = block.corner[corner][k][lane];
                }
                return c;
            };
            const Corners from = at(keys[0]), to = at(keys[1]);
            if (from.is_usable() && to.is_usable()) boxes.extend(from, to);
        }
        return boxes;
    }

    // Gives every node the boxes of what is below it in each segment.
    void fit(const WideTree& shape, MovingTree& tree) const {
        std::vector<std::vector<NodeFit>> fits(segments_);
        std::vector<uint32_t> slabs(segments_);
        parallel_for(segments_, [&](size_t segment) {
            fits[segment] = fits_of(shape, tree, segment);
            Areas areas;
            for (const NodeFit& fit : fits[segment]) areas.add(fit);
            slabs[segment] = areas.slabs();
        });
        tree.slabs = *std::max_element(slabs.begin(), slabs.end());
        tree.nodes.resize(tree.node_count * segments_ * tree.slabs);
        parallel_for(segments_ * tree.slabs, [&](size_t i) {
            const size_t segment = i / tree.slabs, slab = i % tree.slabs;
            const Slab part = {double(slab) / tree.slabs, double(slab + 1) / tree.slabs};
            MovingNode* const nodes = &tree.nodes[i * tree.node_count];
            for (size_t k = 0; k < tree.node_count; ++k) {
                std::copy_n(shape.nodes[k].child, wide, nodes[k].child);
                set_boxes(nodes[k], fits[segment][k], part);
            }
        });
    }

    std::vector<NodeFit> fits_of(const WideTree& shape,
                                 const MovingTree& tree,
                                 size_t segment) const {
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
                    boxes = boxes_of(&tree.leaves[(child & ~leaf_bit) * (segments_ + 1) + segment]);
                } else {
                    for (const KeyBoxes& below : fits[child].children) boxes.extend(below);
                }
            }
            for (int k = 0; k < 3; ++k) fits[i].change[k] = common_change(fits[i], k);
        }
        return fits;
    }

    std::span<const TriangleSoupView> shapes_;
    const TriangleNumbers& numbers_;
    uint32_t segments_;
};

void count_triangles(const MovingTree& tree, AcceleratorStats& stored) {
    for (size_t block = 0; block < tree.leaves.size(); block += tree.segments + 1) {
        for (const uint32_t id : tree.leaves[block].id) {
            stored.references += id != unused_lane;
            stored.triangles += id != unused_lane;
        }
    }
}

}  // namespace

MovingTrees build_moving_trees(std::span<const TriangleSoupView> shapes,
                               const TriangleNumbers& numbers,
                               const BvhOptions& options,
                               AcceleratorStats& stored) {
    std::set<uint32_t> kinds;
    for (const TriangleSoupView& shape : shapes) {
        for (const std::vector<Vec3>& key : shape.later_positions)
            VELATURA_CHECK(key.size() == shape.positions.size(),
                           "a key of motion with another topology");
        if (shape.segments() > 0) kinds.insert(shape.segments());
    }
    MovingTrees result;
    for (const uint32_t segments : kinds) {
        MovingTree tree = MotionBuilder(shapes, numbers, segments).run(options, result.bounds);
        if (tree.node_count == 0) continue;
        count_triangles(tree, stored);
        result.trees.push_back(std::move(tree));
    }
    if (!result.is_empty()) result.query_bounds = QueryBounds(result.bounds);
    return result;
}

Box3 box_of_motion(const MovingTrees& trees) {
    Box3 box = trees.bounds;
    for (int k = 0; k < 3; ++k) {
        const float room = 0x1p-22f * std::max(std::abs(box.min[k]), std::abs(box.max[k]));
        box.min[k] -= room;
        box.max[k] += room;
    }
    return box;
}

}  // namespace velatura::accel
