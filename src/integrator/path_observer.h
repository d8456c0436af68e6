// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/surface_point.h"
#include "guiding/guiding_field.h"
#include "scene/ids.h"

namespace velatura::integrator {

/// Looks at one path while it is traced, for `--replay`. Called in the order of events.
class PathObserver {
  public:
    virtual ~PathObserver() = default;
    virtual void on_hit(int bounce,
                        const geometry::SurfacePoint& point,
                        float t,
                        const Rgb& beta) = 0;

    /// The path collides in a volume at p, a distance t on; beta before it does.
    virtual void on_volume(int bounce, const Vec3& p, float t, const Rgb& beta) {
        (void)bounce, (void)p, (void)t, (void)beta;
    }

    virtual void on_deposit(int bounce,
                            scene::GroupId group,
                            const Rgb& radiance,
                            const char* what) = 0;

    /// Clamps leave the next deposit as it is.
    virtual void on_unlimited() {}

    /// The path may scatter at `at` by lobes that are no delta; beta before it does. Lights sampled
    /// there came before.
    virtual void on_vertex(const guiding::GuidingPoint& at, const Rgb& beta) {
        (void)at, (void)beta;
    }

    /// It did, and goes on along wi. Not called for delta lobes.
    virtual void on_scatter(const Vec3& wi) { (void)wi; }

    /// The path outlived a chance to end, of a roulette that has gains; carried: of what it began
    /// with, largest channel.
    virtual void on_survival(int bounce, float carried) { (void)bounce, (void)carried; }

    virtual void on_end(int bounce, const char* why) = 0;
};

}  // namespace velatura::integrator
