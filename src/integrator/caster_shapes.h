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

/// The placed shapes of a world that have materials of some weight, and distributions to choose
/// among them. Immutable, safe to share among threads; the world must outlive it.
class CasterShapes {
  public:
    /// A shape where it stands.
    struct Caster {
        uint32_t instance = scene::none, shape = scene::none;
        uint32_t pieces = 0;    ///< index for choice_in()
        BoundingSphere sphere;  ///< at all times
    };

    /// material_weights: [material of the scene], 0 for those that are no casters.
    CasterShapes(const World& world, std::vector<double> material_weights);

    const std::vector<Caster>& casters() const { return casters_; }

    double weight(scene::MaterialId material) const {
        return material < weights_.size() ? weights_[material] : 0.0;
    }

    /// Of casters: by weight and area, half of it in equal shares.
    const sampling::Distribution1D& choice() const { return choice_; }

    /// Of the triangles or primitives of a caster, by weight and area at their largest.
    const sampling::Distribution1D& choice_in(const Caster& caster) const {
        return pieces_[caster.pieces];
    }

    const geometry::TriangleMesh& mesh(const Caster& caster) const;

  private:
    uint32_t add_pieces(const geometry::TriangleMesh& mesh, scene::MaterialId override);

    const World& world_;
    std::vector<double> weights_;  // [material]
    std::vector<Caster> casters_;
    sampling::Distribution1D choice_;               // [caster]
    std::vector<sampling::Distribution1D> pieces_;  // triangles or primitives of each mesh with one
                                                    // set of materials
};

}  // namespace velatura::integrator
