// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <span>
#include <vector>

namespace velatura::scene {

/// How something that was made as it is when the shutter opens is carried while it is open: keys at
/// equal steps, entries of matrices straight on between, as those of instances. Immutable, safe to
/// share among threads.
class AffineMotion {
  public:
    /// Where it is at a time.
    struct Pose {
        Mat4d to_render;    ///< from where it was made to where it is, both in render space
        Mat4d to_made;      ///< the way back
        double volume = 0;  ///< |determinant| of to_render; 0: flat, it is nowhere
    };

    /// Stays where it was made.
    AffineMotion() = default;
    /// Args: first: the placement by which it was made, invertible; later: [key − 1] placements at
    /// the later keys, the last one when the shutter closes; empty = it stays.
    AffineMotion(const Mat4d& first, std::span<const Mat4d> later);

    bool moves() const { return !keys_.empty(); }

    /// time: of a ray, in [0, 1]; others count as the nearest of these.
    Pose at(double time) const;

    /// [key] Pose::to_render; what it carries is between those of neighboring keys.
    const std::vector<Mat4d>& keys() const { return keys_; }

    /// Whether all keys differ by translations alone.
    bool only_translates() const;

  private:
    std::vector<Mat4d> keys_;
};

}  // namespace velatura::scene
