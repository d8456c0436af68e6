// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "media/homogeneous_medium.h"
#include "scene/scene.h"

#include <optional>
#include <vector>

namespace velatura::integrator {

/// Scattering interior media of closed meshes, by material (docs/adr/0027). Made only for scenes
/// that have such media, or solids without a surface. Immutable, safe to share among threads.
class InteriorMedia {
  public:
    explicit InteriorMedia(const scene::Scene& scene);

    /// The interior medium of a material.
    struct Medium {
        media::HomogeneousMedium medium;
        /// Of the first shape that has the material: paths know materials and not shapes.
        scene::ProvenanceId provenance = scene::none;
        scene::LinkClass link = 0;
    };

    /// Medium of the material whose solid fills the space; null when it does not scatter.
    const Medium* find(scene::MaterialId filling) const {
        return filling < media_.size() && media_[filling] ? &*media_[filling] : nullptr;
    }

  private:
    void place(scene::MaterialId material, scene::ProvenanceId provenance, scene::LinkClass link);

    std::vector<std::optional<Medium>> media_;  // [material]
    std::vector<bool> is_placed_;
};

}  // namespace velatura::integrator
