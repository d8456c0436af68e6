// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/direct_light.h"
#include "integrator/interior_media.h"
#include "integrator/light_hits.h"
#include "integrator/shadow_attribution.h"

#include <cstdint>

namespace velatura::integrator {

/// A path's segment through participating media: volumes, and what fills solids
/// (docs/reference/volumes.md).
class VolumeSegment {
  public:
    VolumeSegment(const TracerContext& context,
                  const LightHits& hits,
                  const DirectLight& direct,
                  const ShadowAttribution& attribution)
        : context_(context),
          world_(context.world),
          hits_(hits),
          direct_(direct),
          attribution_(attribution) {}

    /// What became of the path.
    enum class End : uint8_t { Through, Scattered, Ended };

    /// Adds what volumes and lights give along the segment, and lets the path scatter if it
    /// collides before t_max. solid: what scatters in the solid that the path is in, or null. why:
    /// it ended, if it did.
    End cross(Path& path,
              const InteriorMedia::Medium* solid,
              float t_max,
              const char*& why,
              film::SampleRadiance& out) const;

  private:
    /// Returns: why the path ends there, or null.
    const char* scatter(Path& path,
                        const Scatterer& scatterer,
                        const Vec3& p,
                        film::SampleRadiance& out) const;
    void add_direct_light(Path& path,
                          const Scatterer& scatterer,
                          const geometry::SurfacePoint& point,
                          film::SampleRadiance& out) const;

    const TracerContext& context_;
    const World& world_;
    const LightHits& hits_;
    const DirectLight& direct_;
    const ShadowAttribution& attribution_;
};

}  // namespace velatura::integrator
