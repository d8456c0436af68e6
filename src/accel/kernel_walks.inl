// SPDX-License-Identifier: Apache-2.0
// Walks of one ray through trees. Included once per instruction set.
#if defined(VELATURA_KERNEL_WALKS) == defined(HWY_TARGET_TOGGLE)
#ifdef VELATURA_KERNEL_WALKS
#undef VELATURA_KERNEL_WALKS
#else
#define VELATURA_KERNEL_WALKS
#endif

#include "accel/kernel_filter.inl"
#include "accel/kernel_motion.inl"
#include "accel/kernel_steps.inl"

#include <optional>
#include <utility>

HWY_BEFORE_NAMESPACE();

namespace velatura::accel {
namespace HWY_NAMESPACE {
namespace {

struct StackEntry {
    float t_near;
    ChildRef ref;
};

struct Stack {
    StackEntry entries[stack_size];
    StackEntry* top = entries;
};

// Pushes all but the nearest of three or more children, the nearer on top; returns the nearest.
// near and far: two of them in order; bits: the others.
template <class Node>
HWY_INLINE uint32_t push_sorted(Stack& stack,
                                const Node& node,
                                uint32_t near,
                                uint32_t far,
                                uint32_t bits,
                                const float* t_near) {
    StackEntry* const first = stack.top;
    *stack.top++ = {t_near[far], node.child[far]};
    for (; bits != 0; bits &= bits - 1) {
        auto lane = uint32_t(std::countr_zero(bits));
        if (t_near[lane] < t_near[near]) std::swap(lane, near);
        const StackEntry entry{t_near[lane], node.child[lane]};
        StackEntry* place = stack.top++;
        for (; place != first && place[-1].t_near < entry.t_near; --place) *place = place[-1];
        *place = entry;
    }
    return near;
}

HWY_INLINE const WideNode& node_of(const WideTree& tree, ChildRef ref) {
    return tree.nodes[ref];
}

HWY_INLINE const MovingNode& node_of(const SegmentTree& tree, ChildRef ref) {
    return tree.node(ref);
}

// A tree whose leaves are numbers of records, to be fetched as leaves are.
template <class Record>
struct RecordTree {
    const WideTree& tree;
    const std::vector<Record>& records;
};

template <class Record>
HWY_INLINE const WideNode& node_of(const RecordTree<Record>& tree, ChildRef ref) {
    return tree.tree.nodes[ref];
}

template <class Record>
HWY_INLINE void prefetch(const RecordTree<Record>& tree, ChildRef ref) {
    const bool is_leaf = (ref & leaf_bit) != 0;
    const auto* base = is_leaf ? reinterpret_cast<const char*>(tree.records.data())
                               : reinterpret_cast<const char*>(tree.tree.nodes.data());
    const size_t size = is_leaf ? sizeof(Record) : sizeof(WideNode);
    const char* const p = base + size_t(ref & ~leaf_bit) * size;
    // Up to three lines of a record, all four of a node
    __builtin_prefetch(p);
    __builtin_prefetch(p + std::min<size_t>(size - 1, 64));
    __builtin_prefetch(p + std::min<size_t>(size - 1, 128));
    __builtin_prefetch(is_leaf ? p : p + 192);
}

// Walks the tree front to back. on_leaf(ref) may lower t_bound (scaled).
template <class Tree, class Slabs, class OnLeaf>
HWY_INLINE void walk_closest(const Tree& tree,
                             const Slabs& slabs,
                             const float& t_bound,
                             const OnLeaf& on_leaf) {
    Stack stack;
    ChildRef ref = 0;
    alignas(64) float t_near[wide];
    while (true) {
        if (!(ref & leaf_bit)) {
            const auto& node = node_of(tree, ref);
            uint32_t bits = meet_children(node, slabs, t_bound, t_near);
            if (bits != 0) {
                // Go on with the nearest child; the usual one or two never wait for the stack
                auto lane = uint32_t(std::countr_zero(bits));
                bits &= bits - 1;
                if (bits != 0) {
                    auto other = uint32_t(std::countr_zero(bits));
                    bits &= bits - 1;
                    if (t_near[other] < t_near[lane]) std::swap(lane, other);
                    if (bits != 0)
                        lane = push_sorted(stack, node, lane, other, bits, t_near);
                    else
                        *stack.top++ = {t_near[other], node.child[other]};
                }
                ref = node.child[lane];
                prefetch(tree, ref);
                continue;
            }
        } else {
            on_leaf(ref & ~leaf_bit);
        }
        // Pop the nearest entry that is not behind the best hit
        do {
            if (stack.top == stack.entries) return;
            --stack.top;
        } while (stack.top->t_near > t_bound);
        ref = stack.top->ref;
        prefetch(tree, ref);
    }
}

// Walks until on_leaf(ref) returns true. No sorting; large children first.
template <class Tree, class Slabs, class OnLeaf>
HWY_INLINE bool walk_any(const Tree& tree,
                         const Slabs& slabs,
                         float t_bound,
                         const OnLeaf& on_leaf) {
    ChildRef stack[stack_size];
    ChildRef* top = stack;
    ChildRef ref = 0;
    alignas(64) float t_near[wide];
    while (true) {
        if (!(ref & leaf_bit)) {
            const auto& node = node_of(tree, ref);
            uint32_t bits = meet_children(node, slabs, t_bound, t_near);
            if (bits != 0) {
                // Go on with the largest child, leave the others for later
                ref = node.child[std::countr_zero(bits)];
                prefetch(tree, ref);
                for (bits &= bits - 1; bits != 0; bits &= bits - 1)
                    *top++ = node.child[std::countr_zero(bits)];
                continue;
            }
        } else if (on_leaf(ref & ~leaf_bit)) {
            return true;
        }
        if (top == stack) return false;
        ref = *--top;
        prefetch(tree, ref);
    }
}

// met, here and below: what the ray meets of the tree (kernel_filter.inl).
template <class Met>
HWY_INLINE void closest_in_tree(
    const WideTree& tree, const QueryRay& q, uint32_t instance, const Met& met, TreeHit& best) {
    float t_bound = float(double(best.t) * q.scaled_from_t);
    walk_closest(tree, met.slabs(q), t_bound, [&](uint32_t block) VELATURA_LEAF {
        if (improve_hit(tree.leaves[block], q, instance, t_bound, best, met.in_blocks()))
            t_bound = float(double(best.t) * q.scaled_from_t);
    });
}

template <class Met>
HWY_INLINE bool any_in_tree(const WideTree& tree, const QueryRay& q, float t_max, const Met& met) {
    const float t_bound = float(double(t_max) * q.scaled_from_t);
    const float certain_bound = certain_bound_of(q, t_bound);
    return walk_any(tree, met.slabs(q), t_bound, [&](uint32_t block) VELATURA_LEAF {
        return is_block_hit(tree.leaves[block], q, t_max, t_bound, certain_bound, met.in_blocks());
    });
}

// A ray in the space of a prototype or of the scene.
struct PlacedRay {
    Vec3d o, d;
    uint32_t instance = scene::none;
};

template <class Met>
void closest_primitive(const PrimitiveRecord& record,
                       const PlacedRay& ray,
                       const Met& met,
                       TreeHit& best) {
    if (!met.takes(record.id)) return;
    // Ties count, by the smaller id
    const float t_max = next_float_up(best.t);
    const std::optional<geometry::PrimitiveHit> found =
        record.set->intersect(record.index, ray.o, ray.d, t_max);
    if (!found) return;
    const auto t = float(found->t);
    if (!is_before(t, false, ray.instance, record.id, best)) return;
    best = {t, found->u, found->v, ray.instance, record.id};
}

QuerySlack primitive_slack(double origin_slack) {
    QuerySlack slack;
    slack.inverse = 0x1p-18f;
    slack.origin = origin_slack;
    return slack;
}

template <class Met>
void closest_in_primitives(const PrimitiveTree& set,
                           const PlacedRay& ray,
                           const Met& met,
                           TreeHit& best) {
    QueryRay q;
    const QuerySlack slack = primitive_slack(set.origin_slack);
    if (set.tree.is_empty() || !make_query(ray.o, ray.d, set.tree.query_bounds, slack, q)) return;
    float t_bound = float(double(best.t) * q.scaled_from_t);
    const RecordTree<PrimitiveRecord> tree{set.tree, set.primitives};
    walk_closest(tree, SlabLanes(q), t_bound, [&](uint32_t index) HWY_ATTR {
        closest_primitive(set.primitives[index], ray, met, best);
        t_bound = float(double(best.t) * q.scaled_from_t);
    });
}

template <class Met>
bool is_occluded_by(const PrimitiveRecord& record,
                    const PlacedRay& ray,
                    float t_max,
                    const Met& met) {
    return met.takes(record.id) && record.set->is_occluded(record.index, ray.o, ray.d, t_max);
}

template <class Met>
bool any_in_primitives(const PrimitiveTree& set,
                       const PlacedRay& ray,
                       float t_max,
                       const Met& met) {
    QueryRay q;
    const QuerySlack slack = primitive_slack(set.origin_slack);
    if (set.tree.is_empty() || !make_query(ray.o, ray.d, set.tree.query_bounds, slack, q))
        return false;
    const float t_bound = float(double(t_max) * q.scaled_from_t);
    const RecordTree<PrimitiveRecord> tree{set.tree, set.primitives};
    return walk_any(tree, SlabLanes(q), t_bound, [&](uint32_t index) HWY_ATTR {
        return is_occluded_by(set.primitives[index], ray, t_max, met);
    });
}

// The ray in prototype space, in double; d is not normalized, so t keeps its meaning.
HWY_INLINE bool enter_instance(const SceneTrees& trees,
                               const InstanceRecord& record,
                               const geometry::Ray& ray,
                               PlacedRay& inner,
                               QueryRay& q) {
    using axes::Double4;
    const auto row = [&](int i) {
        const auto& m = record.prototype_from_render[i];
        return Double4{m[0], m[1], m[2], 1};
    };
    const Double4 d =
        double(ray.d.x) * row(0) + double(ray.d.y) * row(1) + double(ray.d.z) * row(2);
    const Double4 o =
        double(ray.o.x) * row(0) + double(ray.o.y) * row(1) + double(ray.o.z) * row(2) + row(3);
    inner = {Vec3d(o[0], o[1], o[2]), Vec3d(d[0], d[1], d[2]), record.instance};
    const WideTree& tree = trees.prototypes[record.tree];
    return !tree.is_empty() && make_query(o, d, tree.query_bounds, {}, q);
}

QuerySlack top_slack(const SceneTrees& trees) {
    return primitive_slack(trees.top_origin_slack);
}

template <class Met>
void closest_in_motion(const MovingTrees& trees,
                       const QueryRay& q,
                       float time,
                       uint32_t instance,
                       const Met& met,
                       TreeHit& best) {
    for (const MovingTree& moving : trees.trees) {
        const SegmentTree tree(moving, time);
        float t_bound = float(double(best.t) * q.scaled_from_t);
        walk_closest(tree, MovingSlabs(q, tree.f), t_bound, [&](uint32_t block) VELATURA_LEAF {
            LeafBlock moved;
            move_block(tree.leaf(block), tree.f, moved);
            if (improve_hit(moved, q, instance, t_bound, best, met.in_moved_blocks()))
                t_bound = float(double(best.t) * q.scaled_from_t);
        });
    }
}

template <class Met>
void closest_in_motion(
    const MovingTrees& trees, const PlacedRay& ray, float time, const Met& met, TreeHit& best) {
    QueryRay q;
    if (!trees.is_empty() && make_query(ray.o, ray.d, trees.query_bounds, {}, q))
        closest_in_motion(trees, q, time, ray.instance, met, best);
}

template <class Met>
bool any_in_motion(
    const MovingTrees& trees, const QueryRay& q, float time, float t_max, const Met& met) {
    const float t_bound = float(double(t_max) * q.scaled_from_t);
    const float certain_bound = certain_bound_of(q, t_bound);
    for (const MovingTree& moving : trees.trees) {
        const SegmentTree tree(moving, time);
        const bool is_hit =
            walk_any(tree, MovingSlabs(q, tree.f), t_bound, [&](uint32_t block) VELATURA_LEAF {
                LeafBlock moved;
                move_block(tree.leaf(block), tree.f, moved);
                return is_block_hit(moved, q, t_max, t_bound, certain_bound, met.in_moved_blocks());
            });
        if (is_hit) return true;
    }
    return false;
}

template <class Met>
bool any_in_motion(
    const MovingTrees& trees, const PlacedRay& ray, float time, float t_max, const Met& met) {
    QueryRay q;
    return !trees.is_empty() && make_query(ray.o, ray.d, trees.query_bounds, {}, q) &&
           any_in_motion(trees, q, time, t_max, met);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace velatura::accel

HWY_AFTER_NAMESPACE();

#endif
