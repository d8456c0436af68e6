// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/world.h"
#include "sampling/distribution.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace velatura::integrator {

/// A ball around things.
struct BoundingSphere {
    Vec3d center = Vec3d(0.0);
    double radius2 = 0;
};

BoundingSphere sphere_around(const Box3d& box);

/// How much light a material reflects by lobes that are narrow enough, very roughly, in [0, 1].
/// is_narrow(const scene::Input& roughness): of a base or a coat with that roughness.
template <class IsNarrow>
double reflected_weight(const scene::Material& m, const IsNarrow& is_narrow) {
    constexpr double dielectric_reflection = 0.04;
    double weight = 0.0;
    if (m.has_specular && is_narrow(m.roughness)) {
        const double metallic = scene::is_constant(m.metallic) ? double(m.metallic.value.x) : 1.0;
        const double specular = !m.use_specular_workflow ? 0.0
                                : scene::is_constant(m.specular_color)
                                    ? double(max_component(m.specular_color.value))
                                    : 1.0;
        weight = std::max({dielectric_reflection, metallic, specular});
    }
    const bool has_coat = !scene::is_constant(m.clearcoat) || m.clearcoat.value.x > 0.0f;
    if (has_coat && is_narrow(m.clearcoat_roughness))
        weight = std::max(weight, dielectric_reflection);
    return std::min(weight, 1.0);
}

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
