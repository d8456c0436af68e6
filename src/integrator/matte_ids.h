// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/matte_kind.h"
#include "geometry/surface_point.h"
#include "layers/layer_file.h"
#include "scene/scene.h"

#include <array>
#include <cstdint>
#include <vector>

namespace velatura::integrator {

/// Surfaces whose mattes are those of what is seen by way of them.
struct MatteThrough {
    bool refraction = false;  ///< clear solids and sheets
    bool reflection = false;  ///< mirrors

    bool any() const { return refraction || reflection; }
};

/// Ids of all that Cryptomattes tell apart in a scene, which must outlive them: hashing names is no
/// work for paths.
class MatteIds {
  public:
    explicit MatteIds(const scene::Scene& scene);

    /// Of the prim that the surface belongs to; of an instance, whose prim is the one that places
    /// it. 0: nobody knows it.
    uint32_t object(const geometry::SurfacePoint& point) const {
        const scene::ProvenanceId id = placing_prim(point);
        return id < of_provenance_.size() ? of_provenance_[id] : 0;
    }

    uint32_t material(const geometry::SurfacePoint& point) const {
        return point.material == scene::none ? without_name_ : of_material_[point.material];
    }

    /// Of what the prim of object() is part of.
    uint32_t asset(const geometry::SurfacePoint& point) const {
        const scene::ProvenanceId id = placing_prim(point);
        const uint32_t found =
            id < scene_.provenance.size() ? scene_.provenance[id].asset : scene::none;
        return found == scene::none ? without_name_ : of_asset_[found];
    }

    /// All of them, by accumulate::MatteKind.
    std::array<uint32_t, accumulate::matte_kinds.size()> ids(
        const geometry::SurfacePoint& point) const {
        return {object(point), material(point), asset(point)};
    }

    /// What a surface without a material, or of no asset, goes by.
    static constexpr const char* no_name = "default";

    layers::MatteNames names() const;

  private:
    scene::ProvenanceId placing_prim(const geometry::SurfacePoint& point) const {
        return point.instance == scene::none ? point.provenance
                                             : scene_.instances[point.instance].provenance;
    }

    const scene::Scene& scene_;
    std::vector<uint32_t> of_provenance_, of_material_, of_asset_;
    uint32_t without_name_;
};

}  // namespace velatura::integrator
