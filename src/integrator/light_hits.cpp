// SPDX-License-Identifier: Apache-2.0
#include "integrator/light_hits.h"

#include "integrator/custom_shadow.h"
#include "integrator/deposit.h"
#include "integrator/shadow_attribution.h"
#include "integrator/shadow_segment.h"
#include "sampling/mis.h"
#include "scene/effect_calls.h"

#include <cmath>
#include <limits>

namespace velatura::integrator {

using scene::count_call;
using scene::Effect;

/// Whether light sampling could have found what the path meets now.
bool LightHits::has_rivals(const Path& path) const {
    return !path.is_certain && context_.options.estimator.light_sampling == LightSampling::Mis;
}

/// Density of light sampling where the path scattered last.
float LightHits::light_hit_pdf(const Path& path, const lights::LightHit& hit) const {
    // The density is that of the point that sampled, not of the ray's origin beside it: portals
    // make a difference there
    const float pdf =
        world_.lights.has_portals(hit.light)
            ? world_.lights.pdf(hit.light, path.receiver.p, path.ray.d, path.receiver.time)
            : hit.pdf;
    return world_.selector->pmf(path.receiver, hit.light) * pdf;
}

float LightHits::surface_hit_pdf(const Path& path,
                                 const geometry::SurfacePoint& point,
                                 lights::LightId light) const {
    return world_.selector->pmf(path.receiver, light) *
           world_.lights.surface_pdf(light, path.receiver.p, point.p, point.time);
}

float LightHits::light_hit_weight(const Path& path, const lights::LightHit& hit) const {
    if (path.is_certain || context_.options.estimator.light_sampling == LightSampling::Bsdf)
        return 1.0f;
    if (context_.options.estimator.light_sampling != LightSampling::Mis) return 0.0f;
    return sampling::power_heuristic(path.scatter_pdf, light_hit_pdf(path, hit));
}

float LightHits::surface_hit_weight(const Path& path, const geometry::SurfacePoint& point) const {
    if (path.is_certain || context_.options.estimator.light_sampling == LightSampling::Bsdf)
        return 1.0f;
    const std::optional<lights::LightId> light = world_.lights.find_surface(point);
    if (!light) return 1.0f;
    if (context_.options.estimator.light_sampling != LightSampling::Mis) return 0.0f;
    return sampling::power_heuristic(path.scatter_pdf, surface_hit_pdf(path, point, *light));
}

/// Of what the observer of a path is told.
void LightHits::tell_emission(const Path& path,
                              const geometry::SurfacePoint& point,
                              float weight,
                              const Rgb& Le) const {
    FoundLight found{world_.lights.find_surface(point), path.ray.o, path.ray.d, path.segment_t};
    if (found.light && has_rivals(path)) {
        found.light_pdf = surface_hit_pdf(path, point, *found.light);
        found.scatter_pdf = path.scatter_pdf;
    }
    found.weight = weight;
    found.radiance = Le;
    path.observer->on_light(found);
}

Rgb LightHits::light_factor(const Path& path, const lights::LobeMultipliers& multipliers) const {
    if (!world_.has_lobe_multipliers || path.bounce == 0) return Rgb(1.0f);
    count_call(Effect::LobeMultipliers);
    return path.diffuse_share * multipliers.diffuse +
           (Rgb(1.0f) - path.diffuse_share) * multipliers.specular;
}

lights::SurfaceRadiance LightHits::surface_emission(const Path& path,
                                                    const geometry::SurfacePoint& point,
                                                    const Vec3& wo,
                                                    float footprint) const {
    const Vec3* const receiver = path.bounce == 0 ? nullptr : &path.straight_o;
    lights::SurfaceRadiance emitted =
        world_.lights.surface_radiance(point, wo, footprint, path.emission_receiver, receiver);
    emitted.Le *= light_factor(path, emitted.multipliers);
    if (!is_lit(path, emitted.links)) emitted.Le = Rgb(0.0f);
    return emitted;
}

void LightHits::add_emission(const Path& path,
                             const geometry::SurfacePoint& point,
                             const Vec3& wo,
                             film::SampleRadiance& out) const {
    if (!context_.has_emission || !world_.lights.can_emit(point)) return;
    const lights::SurfaceRadiance emitted = surface_emission(path, point, wo, path.cone_width);
    if (is_found_beyond(path, emitted.links)) return;
    const float weight = surface_hit_weight(path, point);
    const Rgb Le = path.beta * emitted.Le * weight;
    if (path.observer && !is_black(Le)) tell_emission(path, point, weight, Le);
    deposit_hit(world_, path, emitted.group, Le, emitted.multipliers, "surface emission", out);
}

void LightHits::add(const Path& path, float t_max, film::SampleRadiance& out) const {
    // Ask along the whole straight line and keep what this segment adds: a light that a cut-out
    // lies inside of must not count twice, and the density is that of the vertex whose light
    // sampling competed
    const auto with_margin = [&path](float t) {
        return t + flush_light_margin(path.straight_o, t);
    };
    const media::Flight* const flight = path.flight;
    const bool ends_in_volume = flight && flight->collides();
    const float begin = with_margin(path.traveled),
                end = ends_in_volume ? path.traveled + t_max : with_margin(path.traveled + t_max);
    const auto add = [&](const lights::LightHit& hit) {
        if (path.traveled > 0.0f && hit.t <= begin) return;
        if (context_.options.caustics &&
            context_.options.caustics->finds(path.history, hit.light, path.pass_count))
            return;
        if (is_light_traced(context_.options.caustic_paths, path, hit.light)) return;
        // What lies beyond the camera's far plane is not seen, but for the lights at infinity
        if (std::isfinite(hit.t) && hit.t - path.traveled > path.ray.t_max) return;
        if (path.bounce == 0) {
            if (!world_.lights.is_camera_visible(hit.light)) return;
            if (!world_.lights.is_infinite(hit.light)) {
                out.alpha = 1.0f;
                if (context_.options.deep) {
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
        const Rgb seen = path.bounce == 0 ? world_.lights.unfiltered_radiance(
                                                hit, path.straight_o, path.ray.d, path.ray.time)
                                          : hit.Le;
        const float weight = light_hit_weight(path, hit);
        Rgb Le = path.beta * seen * light_factor(path, multipliers) * weight;
        if (flight && flight->around.is_drawn())
            Le *= flight->around.weight_at(hit.t - path.traveled);
        else if (!path.interior.is_empty())
            Le *= path.interior.transmittance(world_.materials, hit.t - path.traveled);
        if (flight) Le *= flight->weight_at(hit.t - path.traveled);
        if (path.observer && !is_black(Le))
            path.observer->on_light({lights::LightId(hit.light), path.straight_o, path.ray.d, hit.t,
                                     has_rivals(path) ? light_hit_pdf(path, hit) : 0.0f,
                                     has_rivals(path) ? path.scatter_pdf : 0.0f, weight, Le});
        deposit_hit(world_, path, world_.lights.group(hit.light), Le, multipliers,
                    "light hit by the path", out);
    };
    if (path.line_hit_count == Path::unknown_hits) {
        world_.lights.for_each_hit(path.straight_o, path.ray.d, end, path.ray.time,
                                   [&](const lights::LightHit& hit) { add(hit); });
        return;
    }
    for (int i = 0; i < path.line_hit_count; ++i) {
        const lights::LightHit& hit = path.line_hits[size_t(i)];
        if (world_.lights.is_within(hit, end)) add(hit);
    }
}

void LightHits::add_unoccluded(Path& path, film::SampleRadiance& out) const {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    size_t count = 0;
    world_.lights.for_each_hit(
        path.straight_o, path.ray.d, infinity, path.ray.time, [&](const lights::LightHit& hit) {
            // The next segment begins here, too
            if (count < path.line_hits.size()) path.line_hits[count] = hit;
            ++count;
            if (world_.has_links() && !is_lit(path, world_.lights.links(hit.light))) return;
            const lights::LobeMultipliers multipliers = world_.lights.lobe_multipliers(hit.light);
            const Rgb Le =
                path.beta * hit.Le * light_factor(path, multipliers) * light_hit_weight(path, hit);
            add_unoccluded_hit(world_, world_.lights.group(hit.light), Le, multipliers, out);
        });
    if (count <= path.line_hits.size()) path.line_hit_count = int(count);
    if (!world_.lights.has_surface_emission()) return;

    for_each_emission(path, path.ray, path.cone_width,
                      [&](const lights::SurfaceRadiance& emitted, float weight) {
                          add_unoccluded_hit(world_, emitted.group, path.beta * emitted.Le * weight,
                                             emitted.multipliers, out);
                      });
}

bool LightHits::is_lit(const Path& path, const scene::LightLinks* links) const {
    // Whoever looks from the camera sees every light
    return !world_.has_light_links || path.bounce == 0 ||
           world_.lights.illuminates(links, path.receiver.link);
}

bool LightHits::is_found_beyond(const Path& path, const scene::LightLinks* links) const {
    if (!world_.has_custom_shadows || path.bounce == 0 || !links || !links->has_custom_shadows())
        return false;
    // What a mirror shows is up to its own rays, where only the kinds of rays differ
    return !(path.is_certain && world_.has_ray_visibility &&
             scene::has_plain_shadows(world_.scene, *links));
}

void LightHits::add_beyond(const Path& path,
                           const geometry::SurfacePoint& from,
                           film::SampleRadiance& out) const {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    ShadowShares scratch;
    ShadowShares* const shares = context_.credits_casters(path.bounce) ? &scratch : nullptr;
    world_.lights.for_each_hit(
        path.straight_o, path.ray.d, infinity, path.ray.time, [&](const lights::LightHit& hit) {
            const scene::LightLinks* links = world_.lights.links(hit.light);
            if (!is_found_beyond(path, links) || !is_lit(path, links)) return;
            if (context_.options.caustics &&
                context_.options.caustics->finds(path.history, hit.light, 0))
                return;
            const lights::LobeMultipliers multipliers = world_.lights.lobe_multipliers(hit.light);
            const Rgb Le =
                path.beta * hit.Le * light_factor(path, multipliers) * light_hit_weight(path, hit);
            if (is_black(Le)) return;
            lights::LightSample light;
            light.wi = path.ray.d;
            light.distance = hit.t;
            const lights::RayCone cone{path.cone_width, path.cone_spread};
            scratch.clear();
            const Rgb visible = CustomShadow(world_, *links, path.interior, cone,
                                             custom_shadow_numbers(path), shares)
                                    .visibility(ShadowSegment(from, light), *path.counts);
            deposit_hit(world_, path, world_.lights.group(hit.light), Le * visible, multipliers,
                        "light hit, with its own shadow settings", out);
            deposit_occluded(scratch, world_.lights.group(hit.light), Le, out);
        });
    for (const CustomShadowSurfaces& surfaces : world_.custom_shadow_surfaces)
        add_surfaces_beyond(path, surfaces, out);
}

void LightHits::add_surfaces_beyond(const Path& path,
                                    const CustomShadowSurfaces& surfaces,
                                    film::SampleRadiance& out) const {
    ShadowShares shares;
    CustomShadow shadow(world_, surfaces.links, path.interior, {path.cone_width, path.cone_spread},
                        custom_shadow_numbers(path),
                        context_.credits_casters(path.bounce) ? &shares : nullptr);
    geometry::Ray ray = path.ray;
    for (uint32_t i = 0; i < pass_through_limit && !shadow.is_over(); ++i) {
        ++path.counts->shadow;
        const geometry::Hit hit = surfaces.met
                                      ? world_.accelerator->intersect_some(ray, *surfaces.met)
                                      : world_.accelerator->intersect(ray);
        if (!hit.is_valid()) return;
        shadow.go(ray, ray.d, hit.t, *path.counts);
        geometry::SurfacePoint point =
            geometry::make_surface_point(world_.scene, world_.geometry, ray, hit);
        if (world_.lights.can_emit(point)) {
            const float width = shadow.cone_width();
            const lights::SurfaceRadiance emitted = surface_emission(path, point, -ray.d, width);
            if (is_found_beyond(path, emitted.links) && surfaces.is_of(*emitted.links)) {
                const float weight =
                    world_.materials.presence(point, width) * surface_hit_weight(path, point);
                deposit_hit(world_, path, emitted.group,
                            path.beta * emitted.Le * weight * shadow.visible(), emitted.multipliers,
                            "surface hit, with its own shadow settings", out);
                deposit_occluded(shares, emitted.group, path.beta * emitted.Le * weight, out);
            }
        }
        shadow.cross_surface(point, ray.d);
        ray = geometry::spawn_ray(point, ray.d);
    }
}

}  // namespace velatura::integrator
