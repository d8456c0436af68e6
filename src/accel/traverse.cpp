// SPDX-License-Identifier: Apache-2.0
// Compiled once per instruction set by Highway; see the README of this tier for the seam.
#include "accel/traverse.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <utility>

// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "accel/traverse.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "accel/kernel_steps.inl"
// clang-format on

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
HWY_INLINE uint32_t push_sorted(Stack& stack,
                                const WideNode& node,
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

// Walks the tree front to back. on_leaf(ref) may lower t_bound (scaled).
template <class OnLeaf>
HWY_INLINE void walk_closest(const WideTree& tree,
                             const QueryRay& q,
                             const float& t_bound,
                             const OnLeaf& on_leaf) {
    const SlabLanes slabs(q);
    Stack stack;
    ChildRef ref = 0;
    alignas(64) float t_near[wide];
    while (true) {
        if (!(ref & leaf_bit)) {
            const WideNode& node = tree.nodes[ref];
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
template <class OnLeaf>
HWY_INLINE bool walk_any(const WideTree& tree,
                         const QueryRay& q,
                         float t_bound,
                         const OnLeaf& on_leaf) {
    const SlabLanes slabs(q);
    ChildRef stack[stack_size];
    ChildRef* top = stack;
    ChildRef ref = 0;
    alignas(64) float t_near[wide];
    while (true) {
        if (!(ref & leaf_bit)) {
            const WideNode& node = tree.nodes[ref];
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

HWY_INLINE void closest_in_tree(const WideTree& tree,
                                const QueryRay& q,
                                uint32_t instance,
                                TreeHit& best) {
    float t_bound = float(double(best.t) * q.scaled_from_t);
    walk_closest(tree, q, t_bound, [&](uint32_t block) VELATURA_LEAF {
        if (improve_hit(tree.leaves[block], q, instance, t_bound, best))
            t_bound = float(double(best.t) * q.scaled_from_t);
    });
}

HWY_INLINE bool any_in_tree(const WideTree& tree, const QueryRay& q, float t_max) {
    const float t_bound = float(double(t_max) * q.scaled_from_t);
    const float certain_bound = certain_bound_of(q, t_bound);
    return walk_any(tree, q, t_bound, [&](uint32_t block) VELATURA_LEAF {
        return is_block_hit(tree.leaves[block], q, t_max, t_bound, certain_bound);
    });
}

// A ray in the space of a prototype or of the scene.
struct PlacedRay {
    Vec3d o, d;
    uint32_t instance = scene::none;
};

void closest_primitive(const PrimitiveRecord& record, const PlacedRay& ray, TreeHit& best) {
    // Ties count, by the smaller id
    const float t_max = next_float_up(best.t);
    const std::optional<geometry::PrimitiveHit> found =
        record.set->intersect(record.index, ray.o, ray.d, t_max);
    if (!found) return;
    const auto t = float(found->t);
    if (!is_before(t, ray.instance, record.id, best)) return;
    best = {t, found->u, found->v, ray.instance, record.id};
}

QuerySlack primitive_slack(double origin_slack) {
    QuerySlack slack;
    slack.inverse = 0x1p-18f;
    slack.origin = origin_slack;
    return slack;
}

void closest_in_primitives(const PrimitiveTree& set, const PlacedRay& ray, TreeHit& best) {
    QueryRay q;
    const QuerySlack slack = primitive_slack(set.origin_slack);
    if (set.tree.is_empty() || !make_query(ray.o, ray.d, set.tree.query_bounds, slack, q)) return;
    float t_bound = float(double(best.t) * q.scaled_from_t);
    walk_closest(set.tree, q, t_bound, [&](uint32_t index) HWY_ATTR {
        closest_primitive(set.primitives[index], ray, best);
        t_bound = float(double(best.t) * q.scaled_from_t);
    });
}

bool is_occluded_by(const PrimitiveRecord& record, const PlacedRay& ray, float t_max) {
    return record.set->is_occluded(record.index, ray.o, ray.d, t_max);
}

bool any_in_primitives(const PrimitiveTree& set, const PlacedRay& ray, float t_max) {
    QueryRay q;
    const QuerySlack slack = primitive_slack(set.origin_slack);
    if (set.tree.is_empty() || !make_query(ray.o, ray.d, set.tree.query_bounds, slack, q))
        return false;
    const float t_bound = float(double(t_max) * q.scaled_from_t);
    return walk_any(set.tree, q, t_bound, [&](uint32_t index) HWY_ATTR {
        return is_occluded_by(set.primitives[index], ray, t_max);
    });
}

// The ray in prototype space, in double; d is not normalised, so t keeps its meaning.
HWY_INLINE bool enter_instance(const SceneTrees& trees,
                               const InstanceRecord& record,
                               const geometry::Ray& ray,
                               PlacedRay& inner,
                               QueryRay& q) {
    const auto& m = record.prototype_from_render;
    Vec3d &o = inner.o, &d = inner.d;
    inner.instance = record.instance;
    for (int k = 0; k < 3; ++k) {
        d[k] = double(ray.d.x) * m[0][k] + double(ray.d.y) * m[1][k] + double(ray.d.z) * m[2][k];
        o[k] = double(ray.o.x) * m[0][k] + double(ray.o.y) * m[1][k] + double(ray.o.z) * m[2][k] +
               m[3][k];
    }
    const WideTree& tree = trees.prototypes[record.tree];
    return !tree.is_empty() && make_query(o, d, tree.query_bounds, {}, q);
}

QuerySlack top_slack(const SceneTrees& trees) {
    return primitive_slack(trees.top_origin_slack);
}

bool intersect(const SceneTrees& trees, const geometry::Ray& ray, TreeHit& best) {
    // make_query refuses what is not finite
    if (!(ray.t_max > 0.0f)) return false;
    best = {};
    best.t = ray.t_max;
    QueryRay q;
    if (!trees.direct.is_empty() && make_query(ray, trees.direct.query_bounds, {}, q)) {
        closest_in_tree(trees.direct, q, scene::none, best);
    }
    if (!trees.top.is_empty() && make_query(ray, trees.top.query_bounds, top_slack(trees), q)) {
        float t_bound = float(double(best.t) * q.scaled_from_t);
        walk_closest(trees.top, q, t_bound, [&](uint32_t index) HWY_ATTR {
            if (index >= trees.instances.size()) {
                const PlacedRay direct{Vec3d(ray.o), Vec3d(ray.d)};
                closest_primitive(trees.primitives[index - trees.instances.size()], direct, best);
            } else {
                const InstanceRecord& record = trees.instances[index];
                PlacedRay placed;
                QueryRay inner;
                if (enter_instance(trees, record, ray, placed, inner))
                    closest_in_tree(trees.prototypes[record.tree], inner, record.instance, best);
                if (!trees.prototype_primitives.empty())
                    closest_in_primitives(trees.prototype_primitives[record.tree], placed, best);
            }
            t_bound = float(double(best.t) * q.scaled_from_t);
        });
    }
    return best.id != scene::none;
}

bool is_occluded(const SceneTrees& trees, const geometry::Ray& ray) {
    if (!(ray.t_max > 0.0f)) return false;
    QueryRay q;
    if (!trees.direct.is_empty() && make_query(ray, trees.direct.query_bounds, {}, q) &&
        any_in_tree(trees.direct, q, ray.t_max)) {
        return true;
    }
    if (trees.top.is_empty() || !make_query(ray, trees.top.query_bounds, top_slack(trees), q))
        return false;
    const float t_bound = float(double(ray.t_max) * q.scaled_from_t);
    return walk_any(trees.top, q, t_bound, [&](uint32_t index) HWY_ATTR {
        if (index >= trees.instances.size())
            return is_occluded_by(trees.primitives[index - trees.instances.size()],
                                  {Vec3d(ray.o), Vec3d(ray.d)}, ray.t_max);
        const InstanceRecord& record = trees.instances[index];
        PlacedRay placed;
        QueryRay inner;
        if (enter_instance(trees, record, ray, placed, inner) &&
            any_in_tree(trees.prototypes[record.tree], inner, ray.t_max))
            return true;
        return !trees.prototype_primitives.empty() &&
               any_in_primitives(trees.prototype_primitives[record.tree], placed, ray.t_max);
    });
}

}  // namespace

Kernels kernels();

Kernels kernels() {
    Kernels all{hwy::TargetName(HWY_TARGET), &intersect, &is_occluded, nullptr, nullptr};
    if (has_batch()) {
        all.intersect_batch = &intersect_batch;
        all.occlude_batch = &occlude_batch;
    }
    return all;
}

}  // namespace HWY_NAMESPACE
}  // namespace velatura::accel

HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace velatura::accel {

HWY_EXPORT(kernels);

namespace {

// The kernels that Highway chooses for the running processor.
Kernels chosen_kernels() {
    return HWY_DYNAMIC_DISPATCH(kernels)();
}

}  // namespace

const Kernels& best_kernels() {
    static const Kernels chosen = chosen_kernels();
    return chosen;
}

std::vector<Kernels> all_kernels() {
    std::vector<Kernels> all;
    for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        all.push_back(chosen_kernels());
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    return all;
}

}  // namespace velatura::accel
#endif
