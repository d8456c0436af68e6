// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/surface_point.h"
#include "integrator/path.h"
#include "integrator/tracer_context.h"
#include "shading/bsdf.h"

namespace velatura::integrator {

/// What a mirror lobe that looks at a lamp is sampled with, at least.
inline constexpr float mirrored_lamp_probability = 1.0f / 3;

/// Whether a mirror lobe that is sampled less often would look at a lamp of Scene::lights: glass
/// and varnish reflect 4 % of its light, and one sample of 25 would bring all of that. Inside a
/// clear solid, of what the camera sees through sharp surfaces: through the surface that the
/// reflected ray meets next. After more reflections too little of a lamp is left. What is in the
/// way outside is not asked for.
/// Args: bsdf: for the direction that the path came from.
bool mirrors_lamp(const TracerContext& context,
                  const Path& path,
                  const geometry::SurfacePoint& point,
                  const shading::Bsdf& bsdf);

}  // namespace velatura::integrator
