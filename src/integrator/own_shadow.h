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

/// How much arrives of a light whose shadows are its own (scene::LightLinks::has_own_shadows):
/// only its casters take something away, no further off than they may be, and what they take comes
/// back in the colour of the shadow. A function of the way alone, whoever found it: light sampling
/// and scattering see the same (docs/adr/0021).
class OwnShadow {
  public:
    /// interior: what the way starts in. cone: of the path that looks along it. numbers: for
    /// volumes on the way. shares: receives who takes what; null: nobody asks.
    OwnShadow(const World& world,
              const scene::LightLinks& links,
              const Interior& interior,
              const lights::RayCone& cone,
              const sampling::RandomStream& numbers,
              ShadowShares* shares = nullptr);

    /// Share of the light that arrives by the whole segment.
    Rgb visibility(ShadowSegment segment, RayCounts& counts);

    // Step by step, for lights that are met as surfaces

    /// Goes on from o along the unit direction d through whatever fills the space.
    void go(const Vec3& o, const Vec3& d, float distance, RayCounts& counts);
    /// Meets a surface along the unit direction d, which may be no caster. point: becomes the one
    /// from which the way goes on.
    void meet(geometry::SurfacePoint& point, const Vec3& d);

    /// What arrives from here.
    Rgb visible() const;

    /// Nothing arrives from here on.
    bool is_over() const { return is_blocked_ && is_black(visible()); }

    /// Width of the path here.
    float cone_width() const { return cone_.width; }

  private:
    bool casts(const geometry::SurfacePoint& point) const;
    float strength() const;
    /// Lets this part of the light go on.
    void pass(const Rgb& share, scene::CasterId caster);

    const World& world_;
    const scene::LightLinks& links_;
    const scene::LinkSet* casters_;  // null: everything
    Interior interior_;
    lights::RayCone cone_;
    sampling::RandomStream numbers_;
    Rgb passed_ = Rgb(1.0f);
    float travelled_ = 0;
    ShadowShares* shares_;
    bool is_blocked_ = false;  // what is further on is of no account
};

}  // namespace velatura::integrator
