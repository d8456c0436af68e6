// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "lights/light_bounds.h"
#include "scene/light.h"

#include <memory>

namespace velatura::lights {

/// UsdLuxShapingAPI: cone, focus and measured profile around the light's −Z axis. Angles are
/// measured in render space, also under non-uniform scale. Focus uses the axis for every shape
/// (OpenUSD's reference code), not the normal. Profiles: vertical angles from −Z, horizontal ones
/// from +X towards +Y of light space, both of the direction towards the light (luxtest's reference
/// code); `angleScale` as in the schema's documentation.
class LightShaping {
  public:
    /// Shapes nothing.
    LightShaping() = default;
    /// Shapes nothing either when the shaping is not active or its axis is degenerate.
    LightShaping(const scene::Shaping& shaping, const Mat4d& render_from_light);

    explicit LightShaping(const scene::Light& light)
        : LightShaping(light.shaping, light.render_from_light) {}

    /// Factor of the radiance that leaves in the unit direction `wo` (away from the light).
    Rgb factor(const Vec3d& wo) const { return is_active() ? active_factor(wo) : Rgb(1.0f); }

    bool is_active() const { return has_cone_ || has_focus_ || profile_; }

    /// The shaped directions alone: a cone without intensity that all emission stays in; the
    /// whole sphere when nothing is cut off.
    EmissionCone cone() const;

    /// Mean of the factor's luminance over the sphere, or cosine-weighted over the hemisphere
    /// around −Z.
    double mean_over_sphere() const;
    double mean_over_hemisphere() const;

  private:
    void set_profile(const scene::Shaping& shaping, const Mat4d& render_from_light);
    Rgb active_factor(const Vec3d& wo) const;
    Rgb factor_of_cosine(double cos_theta) const;
    double profile_factor(double theta, double phi) const;
    /// Of the profile, over all horizontal angles; 1 without one.
    double mean_profile_factor(double theta) const;

    Vec3d axis_ = Vec3d(0.0, 0.0, -1.0);
    bool has_cone_ = false, has_focus_ = false;
    double cone_outer_ = 0, cone_inner_ = 0;  // radians
    double focus_ = 0;
    Rgb tint_ = Rgb(0.0f);
    std::shared_ptr<const scene::IesProfile> profile_;
    Vec3d across_x_ = Vec3d(1.0, 0.0, 0.0), across_y_ = Vec3d(0.0, 1.0, 0.0);
    double angle_scale_ = 0, profile_scale_ = 1;
};

}  // namespace velatura::lights
