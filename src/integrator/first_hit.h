// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/sample_radiance.h"
#include "integrator/path.h"
#include "integrator/tracer_context.h"

namespace velatura::integrator {

// What a camera sample sees first, for alpha, data layers, mattes and deep samples

void record_first_hit(const TracerContext& context,
                      const geometry::SurfacePoint& point,
                      const shading::Bsdf& bsdf,
                      film::SampleRadiance& out);

void record_first_collision(const TracerContext& context,
                            const Scatterer& scatterer,
                            const Vec3& p,
                            film::SampleRadiance& out);

}  // namespace velatura::integrator
