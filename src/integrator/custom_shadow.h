// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/interior.h"
#include "integrator/ray_counts.h"
#include "integrator/shadow_segment.h"
#include "integrator/shadow_shares.h"
#include "integrator/world.h"
#include "lights/light_sample.h"
#include "scene/linking.h"

namespace velatura::integrator {

/// Visibility of a light with custom shadows (scene::LightLinks::has_custom_shadows): shadow
/// linking, and UsdLux ShadowAPI's distance, falloff and color. A function of the segment alone, so
/// that light sampling and BSDF sampling agree (docs/adr/0021).
class CustomShadow {
  public:
    /// Args: interior: at the start of the segment; cone: of the path, filters textures; numbers:
    ///       random numbers for volumes; shares: receives what each caster occludes; null: unused.
    CustomShadow(const World& world,
                 const scene::LightLinks& links,
                 const Interior& interior,
                 const lights::RayCone& cone,
                 const sampling::RandomStream& numbers,
                 ShadowShares* shares = nullptr);

    /// Visibility along the whole segment, [0, 1].
    Rgb visibility(ShadowSegment segment, RayCounts& counts);

    // Step by step, for lights that are hit as surfaces

    /// Advances from o by a distance along the unit direction d, through media and interiors.
    void go(const geometry::Ray& ray, const Vec3& d, float distance, RayCounts& counts);
    /// Crosses a surface along the unit direction d; surfaces that are not casters do not occlude.
    /// point: is moved to where the segment continues.
    void cross_surface(geometry::SurfacePoint& point, const Vec3& d);

    /// Visibility so far, [0, 1].
    Rgb visible() const;

    /// True when the light is fully occluded.
    bool is_over() const { return is_blocked_ && is_black(visible()); }

    /// Width of the ray cone here [scene unit].
    float cone_width() const { return cone_.width; }

  private:
    bool casts(const geometry::SurfacePoint& point) const;
    float strength() const;
    /// Multiplies the visibility; the rest is what the caster occludes.
    void pass(const Rgb& share, scene::CasterId caster);

    const World& world_;
    const scene::LightLinks& links_;
    const scene::LinkSet* casters_;  // null: everything
    Interior interior_;
    lights::RayCone cone_;
    sampling::RandomStream numbers_;
    Rgb passed_ = Rgb(1.0f);
    float traveled_ = 0;
    ShadowShares* shares_;
    bool is_blocked_ = false;  // what is further on is of no account
};

}  // namespace velatura::integrator
