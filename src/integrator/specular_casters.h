// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/world.h"
#include "sampling/distribution.h"

#include <cstdint>
#include <vector>

namespace velatura::integrator {

/// A ball around things.
struct BoundingSphere {
    Vec3d center = Vec3d(0.0);
    double radius2 = 0;
};

BoundingSphere sphere_around(const Box3d& box);

/// The shapes of a world that may reflect or refract without blur: where specular chains begin.
/// Immutable, safe to share among threads; the world must outlive it.
class SpecularCasters {
  public:
    explicit SpecularCasters(const World& world);

    bool is_empty() const { return casters_.empty(); }

    /// Around all of them, at all times.
    BoundingSphere sphere() const;

    /// Largest half angle [rad], about, that a light in the ball fills as seen from one of them (of
    /// at most 256 that stand for all).
    double half_angle_of(const BoundingSphere& light) const;

    /// How much light a material passes on by delta lobes, very roughly, in [0, 1]; 0: chains do
    /// not go by it, and paths keep the light.
    double weight(scene::MaterialId material) const {
        return material < weights_.size() ? weights_[material] : 0.0;
    }

    /// A direction (unit) from x that may meet one of them at a time (Ray::time); every direction
    /// that does can come. Its density is nobody's business. u, u_piece, v: in [0,1). Zero: none.
    Vec3d direction_from(
        const Vec3d& x, float time, const Vec2& u, float u_piece, const Vec2& v) const;

  private:
    /// A shape where it stands.
    struct Caster {
        uint32_t instance = scene::none, shape = scene::none;
        uint32_t pieces = 0;    ///< index into pieces_
        BoundingSphere sphere;  ///< at all times
    };

    uint32_t add_pieces(const geometry::TriangleMesh& mesh, scene::MaterialId override);
    Vec3d point_on(const Caster& caster, float time, float u_piece, const Vec2& u) const;

    const World& world_;
    std::vector<double> weights_;  // [material]
    std::vector<Caster> casters_;
    sampling::Distribution1D choice_;               // [caster]
    std::vector<sampling::Distribution1D> pieces_;  // triangles or primitives of each mesh with one
                                                    // set of materials
};

}  // namespace velatura::integrator
