// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

namespace velatura::media {

/// Where light goes on that a medium scatters (Henyey & Greenstein 1941), by the mean cosine g of
/// the angle that it turns by: 1 straight on, −1 straight back, 0 anywhere. The density over
/// directions is p = (1 − g²) / (4π (1 + g² − 2g cosθ)^(3/2)); it is also the value: sampling
/// weights are 1.
///
/// Near |g| = 1 both forms above and the usual inverse cancel: pbrt-v4 clamps g to ±0.99 for that
/// reason. Here nothing is subtracted that is nearly equal: the density is
/// (1 − g²) / (4π ((1 − |g|)² + 2|g| (1 − cosθ))^(3/2)) with 1 − cosθ of the difference of the
/// directions, and sampling yields 1 − cosθ itself. θ counts from the direction that g prefers.
class HenyeyGreenstein {
  public:
    /// |g| below 1: what lies outside is moved to the nearest float inside.
    explicit HenyeyGreenstein(float g);

    /// Density of light that arrives along the unit vector d going on along the unit vector wi
    /// [1/sr].
    float pdf(const Vec3& d, const Vec3& wi) const;

    /// Direction with this density; unit as far as d is. u in [0,1)².
    Vec3 sample(const Vec3& d, const Vec2& u) const;

    float g() const { return g_; }

  private:
    float g_;
};

}  // namespace velatura::media
