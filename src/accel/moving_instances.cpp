// SPDX-License-Identifier: Apache-2.0
#include "accel/moving_instances.h"

#include "accel/bvh_builder.h"
#include "accel/bvh_collapse.h"
#include "accel/motion_fit.h"
#include "accel/placement.h"

#include <algorithm>
#include <map>
#include <utility>

namespace velatura::accel {

namespace {

// Boxes at the keys of the instances of one number of segments.
class InstancePlacer {
  public:
    explicit InstancePlacer(size_t segments) : segments_(segments) {}

    // Instances with a key that cannot be placed are left out.
    void add(const SoupInstance& instance, uint32_t index, const Outline& outline) {
        std::vector<Mat4> keys = {instance.render_from_prototype};
        keys.insert(keys.end(), instance.later.begin(), instance.later.end());
        std::vector<Box3d> placed;
        if (!place_keys(keys, outline.boxes, placed)) return;
        std::vector<Box3> boxes(placed.size());
        for (size_t key = 0; key < placed.size(); ++key)
            if (!round_outward(placed[key], boxes[key])) return;
        group_.instances.push_back({instance.prototype, index});
        group_.keys.insert(group_.keys.end(), keys.begin(), keys.end());
        boxes_.insert(boxes_.end(), boxes.begin(), boxes.end());
        condition_ = std::max(condition_, outline.condition);
    }

    MovingInstances run(const BvhOptions& options, Box3& bounds) {
        BuildPrims prims(group_.instances.size());
        Box3 all;
        for (const Box3& box : boxes_) all.extendBy(box);
        for (size_t i = 0; i < group_.instances.size(); ++i) {
            // The keys around the middle: where the shutter is half through
            Box3 half = key_box(i, segments_ / 2);
            half.extendBy(key_box(i, (segments_ + 1) / 2));
            BuildPrim prim{};
            prim.id = uint32_t(i);
            for (int k = 0; k < 3; ++k) {
                prim.lower[k] = half.min[k];
                prim.upper[k] = half.max[k];
            }
            prims.push_back(prim);
        }
        const WideTree shape =
            collapse_to_ids(build_binary_tree(std::move(prims), binary_options_of(options)));
        group_.boxes.segments = uint32_t(segments_);
        const auto box_of_leaf = [&](uint32_t i, uint32_t segment) {
            return KeyBoxes{key_box(i, segment), key_box(i, segment + 1)};
        };
        fit_boxes(shape, box_of_leaf, group_.boxes);
        group_.query_bounds = QueryBounds(all);
        group_.origin_slack = 0x1p-46 * worst_moving_condition * condition_;
        bounds.extendBy(all);
        return std::move(group_);
    }

  private:
    const Box3& key_box(size_t instance, size_t key) const {
        return boxes_[instance * (segments_ + 1) + key];
    }

    size_t segments_;
    MovingInstances group_;
    std::vector<Box3> boxes_;  // [instance][key]
    double condition_ = 1;
};

}  // namespace

std::vector<MovingInstances> place_moving_instances(std::span<const SoupInstance> instances,
                                                    std::span<const Outline> outlines,
                                                    const BvhOptions& options,
                                                    Box3& bounds) {
    std::map<size_t, InstancePlacer> placers;  // by the number of segments
    std::vector<MovingInstances> groups;
    for (size_t i = 0; i < instances.size(); ++i) {
        const SoupInstance& instance = instances[i];
        const Outline& outline = outlines[instance.prototype];
        if (instance.later.empty() || outline.boxes.empty()) continue;
        const size_t segments = instance.later.size();
        placers.try_emplace(segments, segments).first->second.add(instance, uint32_t(i), outline);
    }
    for (auto& [segments, placer] : placers) {
        MovingInstances group = placer.run(options, bounds);
        if (!group.instances.empty()) groups.push_back(std::move(group));
    }
    return groups;
}

}  // namespace velatura::accel
