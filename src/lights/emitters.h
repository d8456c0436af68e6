// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "lights/emitter.h"
#include "lights/environment_image.h"
#include "lights/light_filter.h"
#include "lights/shaping.h"
#include "scene/light.h"

#include <memory>
#include <vector>

namespace velatura::lights {

/// What an emitter is made from.
struct EmitterInput {
    const scene::Light& light;
    EnvironmentImage* image = nullptr;  ///< dome and rect, is moved from; null = no texture
    bool compensate_mis = false;        ///< see LightSetOptions
};

using EmitterResult = Result<std::unique_ptr<Emitter>>;

/// One maker per kind. The light's Le is finite, not negative and not black. An error (code,
/// message) tells why the light cannot shine: it is then off.
EmitterResult make_rect(const EmitterInput& input);      ///< one-sided, −Z
EmitterResult make_disk(const EmitterInput& input);      ///< one-sided, −Z
EmitterResult make_sphere(const EmitterInput& input);    ///< both sides of the surface
EmitterResult make_cylinder(const EmitterInput& input);  ///< outside of the mantle, axis X, no caps
EmitterResult make_distant(const EmitterInput& input);  ///< from −Z's opposite, a cone or a delta
EmitterResult make_dome(const EmitterInput& input);     ///< pole +Y, latlong

/// The dome, sampled also through windows. Portals: makers' rects of radiance 1, not empty.
std::unique_ptr<Emitter> with_portals(std::unique_ptr<Emitter> dome,
                                      std::vector<std::unique_ptr<Emitter>> portals);

/// The light with its points chosen by area, EmitterSample::pdf accordingly and no EmitterHit::pdf;
/// lights at infinity as they were.
std::unique_ptr<Emitter> sampled_by_area(std::unique_ptr<Emitter> emitter);

/// The light behind filters.
std::unique_ptr<Emitter> with_filters(std::unique_ptr<Emitter> light, FilterChain filters);

/// 0 at infinity.
double area_of(const Emitter& emitter);

/// Rows of the matrix: images of the axes and of the origin.
inline Vec3d axis_of(const Mat4d& m, int row) {
    return {m[row][0], m[row][1], m[row][2]};
}

/// Cone of a shape that emits alike to all sides where nothing shapes it. power: of the shaped
/// light.
inline EmissionCone shaped_cone(const LightShaping& shaping, double power) {
    EmissionCone cone = shaping.cone();
    cone.intensity = power / (4.0 * pi_d * shaping.mean_over_sphere());
    return cone;
}

}  // namespace velatura::lights
