// SPDX-License-Identifier: Apache-2.0
// Surfaces that emit along a line, whatever blocks them.
#pragma once

#include "integrator/path.h"
#include "integrator/path_tracer.h"
#include "integrator/shadow_segment.h"

#include <cstdint>

namespace velatura::integrator {

template <class Visit>
void PathTracer::for_each_emission(const Path& path,
                                   geometry::Ray ray,
                                   float cone_width,
                                   const Visit& visit) const {
    for (uint32_t i = 0; i < pass_through_limit; ++i) {
        const geometry::Hit hit = world_.accelerator->intersect(ray);
        ++path.counts->shadow;
        if (!hit.is_valid()) return;
        const geometry::SurfacePoint point =
            geometry::make_surface_point(world_.scene, world_.geometry, ray, hit);
        cone_width += path.cone_spread * hit.t;
        if (world_.lights.may_emit(point)) {
            const float weight =
                world_.materials.presence(point, cone_width) * surface_hit_weight(path, point);
            visit(surface_emission(path, point, -ray.d, cone_width), weight);
        }
        ray = geometry::spawn_ray(point, ray.d);
    }
}

}  // namespace velatura::integrator
