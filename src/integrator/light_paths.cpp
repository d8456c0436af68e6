// SPDX-License-Identifier: Apache-2.0
// Lights that paths meet or look for.
#include "integrator/direct_light.h"
#include "integrator/emission_walk.h"
#include "integrator/path.h"
#include "integrator/path_tracer.h"
#include "integrator/shadow_segment.h"
#include "sampling/mis.h"
#include "scene/effect_calls.h"

#include <limits>

namespace velatura::integrator {

using sampling::Purpose;
using scene::count_call;
using scene::Effect;

float PathTracer::light_hit_weight(const Path& path, const lights::LightHit& hit) const {
    if (path.is_certain || options_.estimator.light_sampling == LightSampling::Bsdf) return 1.0f;
    if (options_.estimator.light_sampling != LightSampling::Mis) return 0.0f;
    // The density is that of the point that sampled, not of the ray's origin beside it: portals
    // make a difference there
    const float pdf = world_.lights.has_portals(hit.light)
                          ? world_.lights.pdf(hit.light, path.receiver.p, path.ray.d)
                          : hit.pdf;
    const float light_pdf = world_.selector->pmf(path.receiver, hit.light) * pdf;
    return sampling::balance_heuristic(path.scatter_pdf, light_pdf);
}

float PathTracer::surface_hit_weight(const Path& path, const geometry::SurfacePoint& point) const {
    if (path.is_certain || options_.estimator.light_sampling == LightSampling::Bsdf) return 1.0f;
    const std::optional<lights::LightId> light = world_.lights.find_surface(point);
    if (!light) return 1.0f;
    if (options_.estimator.light_sampling != LightSampling::Mis) return 0.0f;
    const float light_pdf = world_.selector->pmf(path.receiver, *light) *
                            world_.lights.surface_pdf(*light, path.receiver.p, point.p);
    return sampling::balance_heuristic(path.scatter_pdf, light_pdf);
}

Rgb PathTracer::light_factor(const Path& path, const lights::LobeMultipliers& multipliers) const {
    if (!world_.has_lobe_multipliers || path.bounce == 0) return Rgb(1.0f);
    count_call(Effect::LobeMultipliers);
    return path.diffuse_share * multipliers.diffuse +
           (Rgb(1.0f) - path.diffuse_share) * multipliers.specular;
}

lights::SurfaceRadiance PathTracer::surface_emission(const Path& path,
                                                     const geometry::SurfacePoint& point,
                                                     const Vec3& wo,
                                                     float footprint) const {
    lights::SurfaceRadiance emitted =
        world_.lights.surface_radiance(point, wo, footprint, path.onlooker);
    emitted.Le *= light_factor(path, emitted.multipliers);
    if (!is_lit(path, emitted.links)) emitted.Le = Rgb(0.0f);
    return emitted;
}

void PathTracer::add_light_hits(const Path& path, float t_max, film::SampleRadiance& out) const {
    // Ask along the whole straight line and keep what this segment adds: a light that a cut-out
    // lies inside of must not count twice, and the density is that of the vertex whose light
    // sampling competed
    const auto with_margin = [&path](float t) {
        return t + flush_light_margin(path.straight_o, t);
    };
    const media::Flight* const flight = path.flight;
    const bool ends_in_volume = flight && flight->collides();
    const float begin = with_margin(path.travelled),
                end = ends_in_volume ? path.travelled + t_max : with_margin(path.travelled + t_max);
    const auto add = [&](const lights::LightHit& hit) {
        if (path.travelled > 0.0f && hit.t <= begin) return;
        if (options_.caustics && options_.caustics->finds(path.history, hit.light, path.pass_count))
            return;
        // What lies beyond the camera's far plane is not seen, but for the lights at infinity
        if (std::isfinite(hit.t) && hit.t - path.travelled > path.ray.t_max) return;
        if (path.bounce == 0) {
            if (!world_.lights.is_camera_visible(hit.light)) return;
            if (!world_.lights.is_infinite(hit.light)) {
                out.alpha = 1.0f;
                if (options_.deep) {
                    count_call(Effect::DeepSamples);
                    const Vec3 p = path.straight_o + path.ray.d * hit.t;
                    out.cover(film::SampleRadiance::DepthKind::Surface, world_.camera.depth(p));
                }
            }
        } else if (world_.has_links()) {
            const scene::LightLinks* links = world_.lights.links(hit.light);
            if (!is_lit(path, links) || is_found_beyond(path, links)) return;
        }
        const lights::LobeMultipliers multipliers = world_.lights.lobe_multipliers(hit.light);
        Rgb Le = path.beta * hit.Le * light_factor(path, multipliers) * light_hit_weight(path, hit);
        if (flight && flight->around.is_drawn())
            Le *= flight->around.weight_at(hit.t - path.travelled);
        else if (!path.interior.is_empty())
            Le *= path.interior.transmittance(world_.materials, hit.t - path.travelled);
        if (flight) Le *= flight->weight_at(hit.t - path.travelled);
        deposit_met(path, world_.lights.group(hit.light), Le, multipliers, "light met by the path",
                    out);
    };
    if (path.line_hit_count == Path::unknown_hits) {
        world_.lights.for_each_hit(path.straight_o, path.ray.d, end,
                                   [&](const lights::LightHit& hit) { add(hit); });
        return;
    }
    for (int i = 0; i < path.line_hit_count; ++i) {
        const lights::LightHit& hit = path.line_hits[size_t(i)];
        if (world_.lights.is_within(hit, end)) add(hit);
    }
}

void PathTracer::add_unoccluded_hits(Path& path, film::SampleRadiance& out) const {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    size_t count = 0;
    world_.lights.for_each_hit(
        path.straight_o, path.ray.d, infinity, [&](const lights::LightHit& hit) {
            // The next segment begins here, too
            if (count < path.line_hits.size()) path.line_hits[count] = hit;
            ++count;
            if (world_.has_links() && !is_lit(path, world_.lights.links(hit.light))) return;
            const lights::LobeMultipliers multipliers = world_.lights.lobe_multipliers(hit.light);
            const Rgb Le =
                path.beta * hit.Le * light_factor(path, multipliers) * light_hit_weight(path, hit);
            add_unoccluded_met(world_.lights.group(hit.light), Le, multipliers, out);
        });
    if (count <= path.line_hits.size()) path.line_hit_count = int(count);
    if (!world_.lights.has_surface_emission()) return;

    for_each_emission(path, path.ray, path.cone_width,
                      [&](const lights::SurfaceRadiance& emitted, float weight) {
                          add_unoccluded_met(emitted.group, path.beta * emitted.Le * weight,
                                             emitted.multipliers, out);
                      });
}

Rgb PathTracer::visibility(const Path& path,
                           const geometry::SurfacePoint& from,
                           const Interior& inside,
                           const lights::LightSample& light,
                           ShadowShares* shares) const {
    ++path.counts->shadow;
    const shading::MaterialEvaluator& materials = world_.materials;
    ShadowSegment segment(from, light);
    const bool may_pass = materials.has_presence() || materials.is_see_through();
    if (!may_pass && !keeps_interior(world_) && !shares)
        return Rgb(world_.accelerator->is_occluded(segment.ray) ? 0.0f : 1.0f);

    Interior interior = inside;
    if (!may_pass && !shares) {
        if (world_.accelerator->is_occluded(segment.ray)) return Rgb(0.0f);
        return interior.transmittance(materials, segment.length(segment.ray.t_max));
    }

    // Cut-outs let light through in proportion to what is absent, as wide a part of them as a path
    // would see, and what is clear without bending light lets through what goes straight on
    Rgb visible(1.0f);
    float cone_width = path.cone_width;
    for (uint32_t i = 0; i < pass_through_limit; ++i) {
        const geometry::Hit hit = world_.accelerator->intersect(segment.ray);
        if (!interior.is_empty())
            visible *= interior.transmittance(
                materials, segment.length(hit.is_valid() ? hit.t : segment.ray.t_max));
        if (!hit.is_valid()) return visible;
        geometry::SurfacePoint point =
            geometry::make_surface_point(world_.scene, world_.geometry, segment.ray, hit);
        cone_width += path.cone_spread * segment.length(hit.t);
        const float presence = materials.presence(point, cone_width);
        const scene::CasterId caster =
            shares ? world_.scene.casters.of(point.instance, point.shape) : scene::none;
        const Rgb passed =
            Rgb(1.0f - presence) +
            pass_bodies(world_, light.wi, cone_width, point, interior, path.counts) * presence;
        if (shares) shares->add(caster, visible * (Rgb(1.0f) - passed));
        visible *= passed;
        if (is_black(visible)) return visible;
        if (!segment.go_on_from(point)) return visible;
    }
    return Rgb(0.0f);
}

}  // namespace velatura::integrator
