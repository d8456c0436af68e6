// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator.h"

#include <bit>
#include <cstdint>
#include <ostream>
#include <vector>

namespace velatura::accel::test {

inline bool is_same(const geometry::Hit& a, const geometry::Hit& b) {
    return a.instance == b.instance && a.shape == b.shape && a.triangle == b.triangle &&
           std::bit_cast<uint32_t>(a.t) == std::bit_cast<uint32_t>(b.t) &&
           std::bit_cast<uint32_t>(a.b1) == std::bit_cast<uint32_t>(b.b1) &&
           std::bit_cast<uint32_t>(a.b2) == std::bit_cast<uint32_t>(b.b2);
}

/// What an accelerator finds among some of the geometry. Both must outlive it.
class Some final : public Accelerator {
  public:
    Some(const Accelerator& all, const scene::LinkSet& met) : all_(all), met_(met) {}

    geometry::Hit intersect(const geometry::Ray& ray) const override {
        return all_.intersect_some(ray, met_);
    }

    bool is_occluded(const geometry::Ray& ray) const override {
        return all_.is_occluded_by_some(ray, met_);
    }

    geometry::Hit intersect_some(const geometry::Ray& ray,
                                 const scene::LinkSet& met) const override {
        return all_.intersect_some(ray, met);
    }

    bool is_occluded_by_some(const geometry::Ray& ray, const scene::LinkSet& met) const override {
        return all_.is_occluded_by_some(ray, met);
    }

    Box3 bounds() const override { return all_.bounds(); }

    AcceleratorStats stats() const override { return all_.stats(); }

  private:
    const Accelerator& all_;
    const scene::LinkSet& met_;
};

/// How two accelerators agree on some rays, which the first traces one by one and all at once.
struct Agreement {
    size_t rays = 0, hits = 0, different = 0, different_occlusion = 0;
};

inline std::vector<geometry::Hit> hits_of(const Accelerator& a,
                                          const std::vector<geometry::Ray>& rays) {
    std::vector<geometry::Hit> hits;
    hits.reserve(rays.size());
    for (const geometry::Ray& ray : rays) hits.push_back(a.intersect(ray));
    return hits;
}

inline Agreement compare(const Accelerator& a,
                         const std::vector<geometry::Hit>& expected,
                         const std::vector<geometry::Ray>& rays) {
    Agreement result;
    for (size_t i = 0; i < rays.size(); ++i) {
        ++result.rays;
        result.hits += expected[i].is_valid();
        result.different += !is_same(a.intersect(rays[i]), expected[i]);
        result.different_occlusion += a.is_occluded(rays[i]) != expected[i].is_valid();
    }
    std::vector<geometry::Hit> hits(rays.size());
    std::vector<uint8_t> occluded(rays.size(), 2);
    a.intersect_batch(rays, hits);
    a.is_occluded_batch(rays, occluded);
    for (size_t i = 0; i < rays.size(); ++i) {
        result.different += !is_same(hits[i], expected[i]);
        result.different_occlusion += occluded[i] != uint8_t(expected[i].is_valid());
    }
    return result;
}

inline Agreement compare(const Accelerator& a,
                         const Accelerator& b,
                         const std::vector<geometry::Ray>& rays) {
    return compare(a, hits_of(b, rays), rays);
}

}  // namespace velatura::accel::test
