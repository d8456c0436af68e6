// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace velatura::bench {

/// A ray of a render, in the order of the render.
struct RecordedRay {
    geometry::Ray ray;
    uint32_t path = 0;
    uint16_t depth = 0;  ///< closest-hit rays of its path before it
    bool is_any_hit = false;
};

/// An accelerator that notes every ray on its way to another one. For one thread.
class RayRecorder final : public accel::Accelerator {
  public:
    explicit RayRecorder(const accel::Accelerator& traced) : traced_(traced) {}

    /// Forgets those so far.
    void clear() {
        rays_.clear();
        path_ = depth_ = 0;
    }

    void begin_path() {
        ++path_;
        depth_ = 0;
    }

    geometry::Hit intersect(const geometry::Ray& ray) const override {
        rays_.push_back({ray, path_, depth_++, false});
        return traced_.intersect(ray);
    }

    bool is_occluded(const geometry::Ray& ray) const override {
        rays_.push_back({ray, path_, depth_, true});
        return traced_.is_occluded(ray);
    }

    geometry::Hit intersect_some(const geometry::Ray& ray,
                                 const scene::LinkSet& met) const override {
        rays_.push_back({ray, path_, depth_++, false});
        return traced_.intersect_some(ray, met);
    }

    bool is_occluded_by_some(const geometry::Ray& ray, const scene::LinkSet& met) const override {
        rays_.push_back({ray, path_, depth_, true});
        return traced_.is_occluded_by_some(ray, met);
    }

    Box3 bounds() const override { return traced_.bounds(); }

    accel::AcceleratorStats stats() const override { return traced_.stats(); }

    const std::vector<RecordedRay>& rays() const { return rays_; }

  private:
    const accel::Accelerator& traced_;
    mutable std::vector<RecordedRay> rays_;
    uint32_t path_ = 0;
    mutable uint16_t depth_ = 0;
};

/// Seconds of one thread that tracing the rays alone takes.
struct ReplayTimes {
    double all_s = 0;     ///< one by one in their own order, as the render traces them
    double shadow_s = 0;  ///< of these the any-hit rays
    double bounce_s = 0;  ///< of these the closest-hit rays beyond the first of each path
    /// The same two kinds handed over in batches of many paths, each batch one by one or side by
    /// side, whichever is faster for its kind.
    double batched_shadow_s = 0, batched_bounce_s = 0;
};

/// Traces the rays alone, several times in turns; medians.
ReplayTimes replay(const std::vector<RecordedRay>& rays, const accel::Accelerator& accelerator);

}  // namespace velatura::bench
