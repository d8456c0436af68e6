// SPDX-License-Identifier: Apache-2.0
// Direct light by a direction that a vertex chooses without regard to lights.
#pragma once

#include "integrator/path.h"
#include "integrator/path_tracer.h"
#include "integrator/shadow_segment.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace velatura::integrator {

/// A direction in which to look for lights.
struct Look {
    Vec3 wi;
    float pdf = 0;  ///< [1/sr]
};

/// By the cosine or uniformly, over the hemisphere of the receiver's normal, over both where light
/// comes through; over the sphere where there is no normal. u in [0,1)².
Look look_around(const lights::Receiver& from, LightSampling sampling, const Vec2& u);

/// Tells give(const ChosenLight&) of every light along the direction, delta lights left out, as if
/// each had been sampled there alone: what blocks it is for the taker to find.
template <class Give>
void PathTracer::for_each_light_along(const Path& path,
                                      const geometry::SurfacePoint& from,
                                      const lights::Receiver& receiver,
                                      const Look& look,
                                      const Give& give) const {
    ChosenLight chosen;
    chosen.light.wi = look.wi;
    chosen.light.pdf = look.pdf;
    const auto offer = [&](lights::LightId id) {
        chosen.choice = {id, 1.0f};
        chosen.links = world_.has_links() ? world_.lights.links(id) : nullptr;
        if (world_.lights.shines_on(chosen.links, receiver.link) && !is_black(chosen.light.Le))
            give(chosen);
    };
    geometry::Ray ray = geometry::spawn_ray(from, look.wi);
    world_.lights.for_each_hit(ray.o, look.wi, std::numeric_limits<float>::infinity(),
                               [&](const lights::LightHit& hit) {
                                   chosen.light.distance = hit.t;
                                   chosen.light.Le = hit.Le;
                                   offer(hit.light);
                               });
    if (!has_emission_) return;

    // Surfaces that emit, as far as somebody might see them
    const bool sees_all = has_unoccluded_ || world_.has_own_shadows || world_.nested;
    chosen.light.is_surface = true;
    chosen.light.distance = 0;
    for (uint32_t i = 0; i < pass_through_limit; ++i) {
        const geometry::Hit hit = world_.accelerator->intersect(ray);
        ++path.counts->shadow;
        if (!hit.is_valid()) return;
        geometry::SurfacePoint point =
            geometry::make_surface_point(world_.scene, world_.geometry, ray, hit);
        chosen.light.distance += hit.t;
        ray = geometry::spawn_ray(point, look.wi);
        const std::optional<lights::LightId> id =
            world_.lights.may_emit(point) ? world_.lights.find_surface(point) : std::nullopt;
        if (id) {
            const float footprint = path.cone_width + path.cone_spread * chosen.light.distance;
            chosen.light.Le =
                world_.lights
                    .surface_radiance(point, -look.wi, footprint, lights::Onlooker::Scattering)
                    .Le *
                world_.materials.presence(point, footprint);
            // As of emissive triangles that are sampled: beside the surface, seen from where the
            // vertex is
            for (int c = 0; c < 3; ++c)
                point.p_error[c] += 0x1p-23f * std::abs(from.p[c] - point.p[c]);
            chosen.light.target = geometry::offset_ray_origin(point, from.p - point.p);
            offer(*id);
        }
        const bool may_pass = world_.materials.material_has_presence(point.material) ||
                              world_.materials.material_is_see_through(point.material);
        if (!may_pass && !sees_all) return;
    }
}

}  // namespace velatura::integrator
