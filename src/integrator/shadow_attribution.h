// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/sample_radiance.h"
#include "integrator/light_hits.h"
#include "integrator/path.h"
#include "integrator/shadow_shares.h"
#include "integrator/tracer_context.h"

namespace velatura::integrator {

/// Which caster takes the light that does not arrive, for the layers by caster: of lights that are
/// sampled (deposit_occluded), and of those that the path's first scattered direction would have
/// met.
class ShadowAttribution {
  public:
    ShadowAttribution(const TracerContext& context, const LightHits& hits)
        : world_(context.world), hits_(hits) {}

    /// The path's first scattered direction ends, a distance t on: credits the caster with what it
    /// takes of the lights beyond. behind: where that lies. taken: radiance of the path that is not
    /// let through.
    void credit_caster(const Path& path,
                       float t,
                       scene::CasterId caster,
                       const Rgb& taken,
                       const geometry::Ray& behind,
                       film::SampleRadiance& out) const;
    /// As credit_caster(), of a surface at which the path arrived.
    void credit_surface(const Path& path, const Vertex& vertex, film::SampleRadiance& out) const;

  private:
    const World& world_;
    const LightHits& hits_;
};

/// Adds to each caster what it takes of a light's radiance.
inline void deposit_occluded(const ShadowShares& shares,
                             scene::GroupId group,
                             const Rgb& radiance,
                             film::SampleRadiance& out) {
    for (const ShadowShares::Share& s : shares)
        out.add_occluded(int(group), s.caster, radiance * s.taken);
}

}  // namespace velatura::integrator
