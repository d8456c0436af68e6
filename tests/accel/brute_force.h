// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator.h"
#include "accel/bvh.h"
#include "accel/placement.h"

#include <memory>
#include <vector>

namespace velatura::accel::test {

/// Tests every triangle of every instance by hit_triangle, and every primitive: what any tree over
/// it must find, bit for bit, with what moves where it is at the ray's time. Refers to the
/// triangles of the scene.
class BruteForce final : public Accelerator {
  public:
    explicit BruteForce(const SoupScene& scene);

    /// Of triangles, each for what rays are made ready for.
    struct Bounds {
        Box3 still, moving;
    };

    geometry::Hit intersect(const geometry::Ray& ray) const override {
        return intersect(ray, nullptr);
    }

    bool is_occluded(const geometry::Ray& ray) const override { return intersect(ray).is_valid(); }

    geometry::Hit intersect_some(const geometry::Ray& ray,
                                 const scene::LinkSet& met) const override {
        return intersect(ray, &met);
    }

    bool is_occluded_by_some(const geometry::Ray& ray, const scene::LinkSet& met) const override {
        return intersect(ray, &met).is_valid();
    }

    Box3 bounds() const override;

    AcceleratorStats stats() const override { return {}; }

  private:
    /// met: null = everything.
    geometry::Hit intersect(const geometry::Ray& ray, const scene::LinkSet* met) const;

    SoupScene scene_;
    Bounds direct_bounds_;
    std::vector<Bounds> prototype_bounds_;
    std::vector<InstanceRecord> placed_;  ///< only those that can be hit

    struct MovingPlacement {
        uint32_t prototype, instance;
        std::vector<Mat4> keys;
    };

    std::vector<MovingPlacement> moving_;  ///< the same
};

/// Closest hit by Möller and Trumbore in long double, on the triangles placed directly: shares no
/// code with the tiers under test. Returns also the smallest barycentric weight, to tell hits that
/// rounding cannot change.
struct OracleHit {
    geometry::Hit hit;
    double t = 0;
    double margin = 0;
};

/// Whether a tree with these bounds is searched at all.
bool is_traced(const geometry::Ray& ray, const Box3& bounds);

OracleHit moller_trumbore(const SoupScene& scene, const geometry::Ray& ray);

}  // namespace velatura::accel::test
