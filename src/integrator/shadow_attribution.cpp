// SPDX-License-Identifier: Apache-2.0
#include "integrator/shadow_attribution.h"

#include "integrator/shadow_segment.h"

#include <limits>

namespace velatura::integrator {

void ShadowAttribution::credit_caster(const Path& path,
                                      float t,
                                      scene::CasterId caster,
                                      const Rgb& taken,
                                      const geometry::Ray& behind,
                                      film::SampleRadiance& out) const {
    if (caster == scene::none || is_black(taken)) return;
    constexpr float infinity = std::numeric_limits<float>::infinity();
    // As far as add_light_hits() has met them
    const float end = path.traveled + t + flush_light_margin(path.straight_o, path.traveled + t);
    world_.lights.for_each_hit(
        path.straight_o, path.ray.d, infinity, path.ray.time, [&](const lights::LightHit& hit) {
            if (world_.lights.is_within(hit, end)) return;
            if (world_.has_links()) {
                const scene::LightLinks* links = world_.lights.links(hit.light);
                if (!hits_.is_lit(path, links) || hits_.is_found_beyond(path, links)) return;
            }
            out.add_occluded(
                int(world_.lights.group(hit.light)), caster,
                taken * hit.Le *
                    hits_.light_factor(path, world_.lights.lobe_multipliers(hit.light)) *
                    hits_.light_hit_weight(path, hit));
        });
    if (!world_.lights.has_surface_emission()) return;
    hits_.for_each_emission(
        path, behind, path.cone_width, [&](const lights::SurfaceRadiance& emitted, float weight) {
            if (!hits_.is_found_beyond(path, emitted.links))
                out.add_occluded(int(emitted.group), caster, taken * emitted.Le * weight);
        });
}

void ShadowAttribution::credit_surface(const Path& path,
                                       const Vertex& vertex,
                                       film::SampleRadiance& out) const {
    const geometry::SurfacePoint& point = vertex.point;
    const Vec3 d = path.ray.d;
    const Rgb passed =
        straight_through(world_.materials, point, d, path.cone_width,
                         vertex.crossing ? vertex.crossing->surrounding_index : 1.0f);
    const scene::CasterId caster = world_.scene.casters.of(point.instance, point.shape);
    credit_caster(path, path.segment_t, caster, path.beta * (Rgb(1.0f) - passed),
                  geometry::spawn_ray(point, d), out);
}

}  // namespace velatura::integrator
