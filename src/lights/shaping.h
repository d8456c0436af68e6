// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "lights/light_bounds.h"
#include "scene/light.h"

namespace velatura::lights {

/// UsdLuxShapingAPI cone and focus around the light's −Z axis in render space. Angles are measured
/// in render space, also under non-uniform scale. Focus uses the axis for every shape (OpenUSD's
/// reference code), not the normal.
class LightShaping {
  public:
    /// Shapes nothing.
    LightShaping() = default;
    /// Shapes nothing either when the shaping is not active or its axis is degenerate.
    LightShaping(const scene::Shaping& shaping, const Mat4d& render_from_light);

    explicit LightShaping(const scene::Light& light)
        : LightShaping(light.shaping, light.render_from_light) {}

    /// Factor of the radiance that leaves in the unit direction `wo` (away from the light).
    Rgb factor(const Vec3d& wo) const;

    bool is_active() const { return has_cone_ || has_focus_; }

    /// The shaped directions alone: a cone without intensity that all emission stays in; the
    /// whole sphere when nothing is cut off.
    EmissionCone cone() const;

    /// Mean of the factor's luminance over the sphere, or cosine-weighted over the hemisphere
    /// around −Z.
    double mean_over_sphere() const;
    double mean_over_hemisphere() const;

  private:
    Rgb factor_of_cosine(double cos_theta) const;

    Vec3d axis_ = Vec3d(0.0, 0.0, -1.0);
    bool has_cone_ = false, has_focus_ = false;
    double cone_outer_ = 0, cone_inner_ = 0;  // radians
    double focus_ = 0;
    Rgb tint_ = Rgb(0.0f);
};

}  // namespace velatura::lights
