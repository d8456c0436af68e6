// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/bvh.h"
#include "geometry/surface_point.h"

#include <memory>

namespace velatura::bench {

/// The two ways of running Embree that matter here. Its robust scenes get no spatial splits
/// whatever quality they ask for, so medium is all that robust has.
enum class EmbreeMode {
    RobustMedium,
    FastHigh,
};

/// Embree 3 over the same triangles: one thread, single rays.
class EmbreePeer {
  public:
    /// Copies the triangles and builds.
    EmbreePeer(const accel::SoupScene& scene, EmbreeMode mode);
    ~EmbreePeer();

    float closest(const geometry::Ray& ray) const;  ///< t, infinity without a hit
    bool is_occluded(const geometry::Ray& ray) const;

    /// What its memory monitor says the trees hold, without its copies of vertices and indices.
    size_t tree_bytes() const;
    size_t mesh_bytes() const;     ///< those copies
    double build_seconds() const;  ///< CPU time of commits, without copying the triangles

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace velatura::bench
