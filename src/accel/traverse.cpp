// SPDX-License-Identifier: Apache-2.0
// Compiled once per instruction set by Highway; see the README of this tier for the seam.
#include "accel/traverse.h"

#include "accel/placement.h"

// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "accel/traverse.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "accel/kernel_walks.inl"
// clang-format on

HWY_BEFORE_NAMESPACE();

namespace velatura::accel {
namespace HWY_NAMESPACE {
namespace {

// What is in the instance. met: MeetAll or MeetSome, what the ray meets of the scene.
template <bool moving, class Met>
HWY_INLINE void closest_in_instance(const SceneTrees& trees,
                                    const InstanceRecord& record,
                                    const geometry::Ray& ray,
                                    const Met& met,
                                    TreeHit& best) {
    if (!met.enters(record.instance)) return;
    const auto met_there = met.in_instance(record.instance);
    PlacedRay placed;
    QueryRay inner;
    if (enter_instance(trees, record, ray, placed, inner))
        closest_in_tree(trees.prototypes[record.tree], inner, record.instance, met_there, best);
    if (moving && !trees.prototype_motion.empty())
        closest_in_motion(trees.prototype_motion[record.tree], placed, ray.time, met_there, best);
    if (!trees.prototype_primitives.empty())
        closest_in_primitives(trees.prototype_primitives[record.tree], placed, met_there, best);
}

template <bool moving, class Met>
HWY_INLINE bool any_in_instance(const SceneTrees& trees,
                                const InstanceRecord& record,
                                const geometry::Ray& ray,
                                const Met& met) {
    if (!met.enters(record.instance)) return false;
    const auto met_there = met.in_instance(record.instance);
    PlacedRay placed;
    QueryRay inner;
    if (enter_instance(trees, record, ray, placed, inner) &&
        any_in_tree(trees.prototypes[record.tree], inner, ray.t_max, met_there))
        return true;
    if (moving && !trees.prototype_motion.empty() &&
        any_in_motion(trees.prototype_motion[record.tree], placed, ray.time, ray.t_max, met_there))
        return true;
    return !trees.prototype_primitives.empty() &&
           any_in_primitives(trees.prototype_primitives[record.tree], placed, ray.t_max, met_there);
}

// The instance as one that stays where it is at the time of the ray. False: it is not there then.
bool stop(const MovingInstances& moving, uint32_t index, float time, InstanceRecord& record) {
    record.tree = moving.instances[index].tree;
    record.instance = moving.instances[index].instance;
    const size_t keys = moving.boxes.segments + 1;
    return place_at_time({moving.keys.data() + index * keys, keys}, time, record);
}

template <class Met>
void closest_in_moving_instances(const SceneTrees& trees,
                                 const geometry::Ray& ray,
                                 const Met& met,
                                 TreeHit& best) {
    for (const MovingInstances& moving : trees.moving_instances) {
        QueryRay q;
        if (!make_query(ray, moving.query_bounds, primitive_slack(moving.origin_slack), q))
            continue;
        const SegmentTree tree(moving.boxes, ray.time);
        float t_bound = float(double(best.t) * q.scaled_from_t);
        walk_closest(tree, MovingSlabs(q, tree.f), t_bound, [&](uint32_t index) HWY_ATTR {
            InstanceRecord record;
            if (stop(moving, index, ray.time, record))
                closest_in_instance<true>(trees, record, ray, met, best);
            t_bound = float(double(best.t) * q.scaled_from_t);
        });
    }
}

template <class Met>
bool any_in_moving_instances(const SceneTrees& trees, const geometry::Ray& ray, const Met& met) {
    for (const MovingInstances& moving : trees.moving_instances) {
        QueryRay q;
        if (!make_query(ray, moving.query_bounds, primitive_slack(moving.origin_slack), q))
            continue;
        const SegmentTree tree(moving.boxes, ray.time);
        const float t_bound = float(double(ray.t_max) * q.scaled_from_t);
        const bool is_hit =
            walk_any(tree, MovingSlabs(q, tree.f), t_bound, [&](uint32_t index) HWY_ATTR {
                InstanceRecord record;
                return stop(moving, index, ray.time, record) &&
                       any_in_instance<true>(trees, record, ray, met);
            });
        if (is_hit) return true;
    }
    return false;
}

// moving: whether the scene has anything that moves. Without it no instruction is spent on that.
template <bool moving, class Met>
HWY_INLINE bool intersect(const SceneTrees& trees,
                          const geometry::Ray& ray,
                          const Met& met,
                          TreeHit& best) {
    // make_query refuses what is not finite
    if (!(ray.t_max > 0.0f)) return false;
    best = {};
    best.t = ray.t_max;
    QueryRay q;
    if (!trees.direct.is_empty() && make_query(ray, trees.direct.query_bounds, {}, q)) {
        closest_in_tree(trees.direct, q, scene::none, met.direct(), best);
    }
    if (moving && !trees.direct_motion.is_empty() &&
        make_query(ray, trees.direct_motion.query_bounds, {}, q)) {
        closest_in_motion(trees.direct_motion, q, ray.time, scene::none, met.direct(), best);
    }
    if (!trees.top.is_empty() && make_query(ray, trees.top.query_bounds, top_slack(trees), q)) {
        float t_bound = float(double(best.t) * q.scaled_from_t);
        const RecordTree<InstanceRecord> top{trees.top, trees.instances};
        walk_closest(top, met.top().slabs(q), t_bound, [&](uint32_t index) HWY_ATTR {
            if (index >= trees.instances.size()) {
                const PlacedRay direct{Vec3d(ray.o), Vec3d(ray.d)};
                closest_primitive(trees.primitives[index - trees.instances.size()], direct,
                                  met.direct(), best);
            } else {
                closest_in_instance<moving>(trees, trees.instances[index], ray, met, best);
            }
            t_bound = float(double(best.t) * q.scaled_from_t);
        });
    }
    if (moving) closest_in_moving_instances(trees, ray, met, best);
    return best.id != scene::none;
}

template <bool moving, class Met>
HWY_INLINE bool is_occluded(const SceneTrees& trees, const geometry::Ray& ray, const Met& met) {
    if (!(ray.t_max > 0.0f)) return false;
    QueryRay q;
    if (!trees.direct.is_empty() && make_query(ray, trees.direct.query_bounds, {}, q) &&
        any_in_tree(trees.direct, q, ray.t_max, met.direct())) {
        return true;
    }
    if (moving && !trees.direct_motion.is_empty() &&
        make_query(ray, trees.direct_motion.query_bounds, {}, q) &&
        any_in_motion(trees.direct_motion, q, ray.time, ray.t_max, met.direct())) {
        return true;
    }
    if (moving && any_in_moving_instances(trees, ray, met)) return true;
    if (trees.top.is_empty() || !make_query(ray, trees.top.query_bounds, top_slack(trees), q))
        return false;
    const float t_bound = float(double(ray.t_max) * q.scaled_from_t);
    const RecordTree<InstanceRecord> top{trees.top, trees.instances};
    return walk_any(top, met.top().slabs(q), t_bound, [&](uint32_t index) HWY_ATTR {
        if (index >= trees.instances.size())
            return is_occluded_by(trees.primitives[index - trees.instances.size()],
                                  {Vec3d(ray.o), Vec3d(ray.d)}, ray.t_max, met.direct());
        return any_in_instance<moving>(trees, trees.instances[index], ray, met);
    });
}

template <bool moving>
bool intersect_all(const SceneTrees& trees, const geometry::Ray& ray, TreeHit& best) {
    return intersect<moving>(trees, ray, MeetAll(), best);
}

template <bool moving>
bool is_occluded_by_all(const SceneTrees& trees, const geometry::Ray& ray) {
    return is_occluded<moving>(trees, ray, MeetAll());
}

bool intersect_some(const SceneTrees& trees,
                    const geometry::Ray& ray,
                    const scene::LinkSet& met,
                    TreeHit& best) {
    return intersect<true>(trees, ray, MeetSome{trees.classes, met}, best);
}

bool is_occluded_by_some(const SceneTrees& trees,
                         const geometry::Ray& ray,
                         const scene::LinkSet& met) {
    return is_occluded<true>(trees, ray, MeetSome{trees.classes, met});
}

}  // namespace

Kernels kernels();

Kernels kernels() {
    Kernels all{hwy::TargetName(HWY_TARGET),
                &intersect_all<false>,
                &is_occluded_by_all<false>,
                &intersect_all<true>,
                &is_occluded_by_all<true>,
                &intersect_some,
                &is_occluded_by_some,
                nullptr,
                nullptr};
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
