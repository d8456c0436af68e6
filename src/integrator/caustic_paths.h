// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/caster_points.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::integrator {

struct PathTracerOptions;

/// The paths that light tracing finds and that camera paths skip.
///
/// Of all paths light … camera these are the ones that scatter at surfaces alone, twice or more:
/// first, as seen from the camera, by a wide lobe (see shading::narrow_lobe_alpha); last by a
/// narrow lobe of a point that casts() is true for, lit by a light that takes_light() is true for;
/// and nowhere by fibers or below the surface. Where a scattering has lobes of both kinds, each
/// path belongs to one of them: PathTracer draws which. So each layer gets the same light, whoever
/// finds it.
/// Immutable, safe to share among threads; the world must outlive it.
class CausticPaths {
  public:
    explicit CausticPaths(const World& world);

    /// False: a scene has none, whatever its geometry.
    static bool can_exist(const scene::Scene& scene);

    /// Why light tracing cannot be part of a render; empty when it can. Lights with shadows of
    /// their own, multipliers by lobe, volumes and interior media are met by paths alone.
    static std::string why_not(const World& world, const PathTracerOptions& options);

    /// Nothing casts caustics, or no light could.
    bool is_empty() const { return casters_.is_empty() || !has_light_; }

    /// True for analytic lights that are on, but for domes.
    bool takes_light(lights::LightId light) const {
        return light.index < takes_light_.size() && takes_light_[light.index];
    }

    bool casts(const geometry::SurfacePoint& point) const { return casters_.holds(point); }

    const CasterPoints& casters() const { return casters_; }

  private:
    CasterPoints casters_;
    std::vector<uint8_t> takes_light_;  // [light of the scene]
    bool has_light_ = false;
};

}  // namespace velatura::integrator
