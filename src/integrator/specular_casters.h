// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/caster_shapes.h"

#include <cstdint>
#include <vector>

namespace velatura::integrator {

/// The shapes of a world that may reflect or refract without blur: where specular chains begin.
/// Immutable, safe to share among threads; the world must outlive it.
class SpecularCasters {
  public:
    explicit SpecularCasters(const World& world);

    bool is_empty() const { return shapes_.casters().empty(); }

    /// Around all of them, at all times.
    BoundingSphere sphere() const;

    /// Largest half angle [rad], about, that a light in the ball fills as seen from one of them (of
    /// at most 256 that stand for all).
    double half_angle_of(const BoundingSphere& light) const;

    /// How much light a material passes on by delta lobes, very roughly, in [0, 1]; 0: chains do
    /// not go by it, and paths keep the light.
    double weight(scene::MaterialId material) const { return shapes_.weight(material); }

    /// A direction (unit) from x that may meet one of them at a time (Ray::time); every direction
    /// that does can come. Its density is nobody's business. u, u_piece, v: in [0,1). Zero: none.
    Vec3d direction_from(
        const Vec3d& x, float time, const Vec2& u, float u_piece, const Vec2& v) const;

  private:
    Vec3d point_on(const CasterShapes::Caster& caster,
                   float time,
                   float u_piece,
                   const Vec2& u) const;

    const World& world_;
    CasterShapes shapes_;
};

}  // namespace velatura::integrator
