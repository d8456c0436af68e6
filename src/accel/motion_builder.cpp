// SPDX-License-Identifier: Apache-2.0
#include "accel/motion_builder.h"

#include "accel/bvh_builder.h"
#include "accel/bvh_collapse.h"
#include "accel/motion_fit.h"
#include "accel/ray_query.h"
#include "base/check.h"
#include "geometry/motion.h"

#include <algorithm>
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

// The triangles of some shapes that move over the same number of segments.
class MotionBuilder {
  public:
    MotionBuilder(std::span<const TriangleSoupView> shapes,
                  const TriangleNumbers& numbers,
                  uint32_t segments)
        : shapes_(shapes), numbers_(numbers), segments_(segments) {}

    MovingTree run(const BvhOptions& options, Box3& bounds, AcceleratorStats& stored) const {
        BinaryBuildOptions binary_options = binary_options_of(options);
        binary_options.leaf_size = options.leaf_size;
        binary_options.block = wide;
        binary_options.merge_duplicates = [&](std::span<BuildPrim> range) {
            return merge_equal(range, [&](const BuildPrim& a, const BuildPrim& b) {
                const int ways = order_of_ways(a.id, b.id);
                return ways != 0 ? ways : order_of_shapes(numbers_, options, a.id, b.id);
            });
        };
        BuildPrims prims = collect(bounds);
        const size_t collected = prims.count;
        const BinaryTree binary = build_binary_tree(std::move(prims), binary_options);
        MovingTree tree;
        tree.segments = segments_;
        const WideTree shape = collapse(
            binary, wide, {}, [&](size_t count) { tree.leaves.resize(count * (segments_ + 1)); },
            [&](uint32_t block, std::span<const uint32_t> ids) {
                fill_block(&tree.leaves[block * (segments_ + 1)], ids);
            });
        const auto box_of_leaf = [&](uint32_t block, uint32_t segment) {
            return boxes_of(&tree.leaves[block * (segments_ + 1) + segment]);
        };
        fit_boxes(shape, box_of_leaf, tree);
        count_triangles(tree, collected, stored);
        return tree;
    }

  private:
    Corners corners(const TriangleSoupView& shape, size_t triangle, uint32_t key) const {
        const std::span<const Vec3> positions =
            key == 0 ? shape.positions : std::span<const Vec3>(shape.later_positions[key - 1]);
        const auto& v = shape.triangles[triangle];
        return {{positions[v[0]], positions[v[shape.second()]], positions[v[shape.third()]]}};
    }

    Corners corners(uint32_t id, uint32_t key) const {
        const uint32_t shape = numbers_.shape(id);
        return corners(shapes_[shape], id - numbers_.first(shape), key);
    }

    int order_of_ways(uint32_t a, uint32_t b) const {
        for (uint32_t key = 0; key <= segments_; ++key) {
            const Corners ca = corners(a, key), cb = corners(b, key);
            // What is nowhere is alike: numbers that are none have no order
            const bool is_a_there = ca.is_usable(), is_b_there = cb.is_usable();
            if (is_a_there != is_b_there) return is_a_there ? -1 : 1;
            for (int i = 0; i < 3 && is_a_there; ++i) {
                const int order = order_of(ca.p[i], cb.p[i]);
                if (order != 0) return order;
            }
        }
        return 0;
    }

    // With the boxes of triangles when the shutter is half through, or in the middle of the first
    // segment that they are there in.
    BuildPrims collect(Box3& bounds) const {
        size_t max = 0;
        for (const TriangleSoupView& shape : shapes_)
            max += shape.segments() == segments_ ? shape.triangles.size() : 0;
        BuildPrims prims(max);
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

    void count_triangles(const MovingTree& tree, size_t collected, AcceleratorStats& stored) const {
        std::vector<bool> seen(numbers_.count());
        size_t count = 0;
        for (size_t block = 0; block < tree.leaves.size(); block += segments_ + 1) {
            for (const uint32_t id : tree.leaves[block].id) {
                if (id == unused_lane) continue;
                seen[id] = true;
                ++count;
            }
        }
        stored.references += count;
        stored.triangles += count;
        if (count == collected) return;
        const auto is_collected = [&](size_t shape, size_t triangle) {
            Box3 bounds;
            return shapes_[shape].segments() == segments_ &&
                   !half_through(shapes_[shape], triangle, bounds).isEmpty();
        };
        count_duplicates(numbers_, shapes_, seen, is_collected, stored.duplicates);
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
            if (!from.is_usable() || !to.is_usable()) continue;
            for (int k = 0; k < 3; ++k) {
                boxes.from.extendBy(from.p[k]);
                boxes.to.extendBy(to.p[k]);
            }
        }
        return boxes;
    }

    std::span<const TriangleSoupView> shapes_;
    const TriangleNumbers& numbers_;
    uint32_t segments_;
};

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
        MovingTree tree =
            MotionBuilder(shapes, numbers, segments).run(options, result.bounds, stored);
        if (tree.node_count == 0) continue;
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
