// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "media/body_medium.h"
#include "scene/scene.h"

#include <optional>
#include <vector>

namespace velatura::integrator {

/// What scatters light inside bodies, by their materials (docs/adr/0027). Made only for scenes with
/// such bodies, or with bodies that have no surface. Immutable, safe to share among threads.
class BodyMedia {
  public:
    explicit BodyMedia(const scene::Scene& scene);

    struct Medium {
        media::BodyMedium matter;
        /// Of the first shape that has the material: paths know materials and not shapes.
        scene::ProvenanceId provenance = scene::none;
        scene::LinkClass link = 0;
    };

    /// Of what fills the space; null where nothing scatters.
    const Medium* find(scene::MaterialId filling) const {
        return filling < media_.size() && media_[filling] ? &*media_[filling] : nullptr;
    }

  private:
    void place(scene::MaterialId material, scene::ProvenanceId provenance, scene::LinkClass link);

    std::vector<std::optional<Medium>> media_;  // [material]
    std::vector<bool> is_placed_;
};

}  // namespace velatura::integrator
