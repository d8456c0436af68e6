// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench_scenes.h"
#include "geometry/surface_point.h"

#include <memory>

namespace velatura::bench {

/// Embree 3 over the same triangles: robust mode, medium quality, one thread, single rays.
class EmbreePeer {
  public:
    explicit EmbreePeer(const BenchScene& scene);
    ~EmbreePeer();

    float closest(const geometry::Ray& ray) const;  ///< t, infinity without a hit
    bool is_occluded(const geometry::Ray& ray) const;
    size_t bytes() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace velatura::bench
