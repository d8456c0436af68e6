// SPDX-License-Identifier: Apache-2.0
// What paths do about lights that shine on some geometry only, or whose shadows some geometry
// casts (docs/adr/0021).
#include "integrator/direct_light.h"
#include "integrator/own_shadow.h"
#include "integrator/path.h"
#include "integrator/path_tracer.h"
#include "integrator/shadow_segment.h"

#include <cmath>
#include <limits>

namespace velatura::integrator {

namespace {

/// For ways through volumes to lights with shadows of their own. Lights may share them: each is
/// seen on its own.
template <class Path>
sampling::RandomStream own_numbers(const Path& path) {
    return path.sampler.stream(path.bounce, sampling::Purpose::VolumeOwnShadow, path.pass_count);
}

}  // namespace

bool PathTracer::is_lit(const Path& path, const scene::LightLinks* links) const {
    // Whoever looks from the camera sees every light
    return !world_.has_light_links || path.bounce == 0 ||
           world_.lights.shines_on(links, path.receiver.link);
}

bool PathTracer::is_found_beyond(const Path& path, const scene::LightLinks* links) const {
    return world_.has_own_shadows && path.bounce > 0 && links && links->has_own_shadows();
}

Rgb PathTracer::own_visibility(const Path& path,
                               const geometry::SurfacePoint& from,
                               const Interior& inside,
                               const lights::LightSample& light,
                               const scene::LightLinks& links,
                               ShadowShares* shares) const {
    return OwnShadow(world_, links, inside, {path.cone_width, path.cone_spread}, own_numbers(path),
                     shares)
        .visibility(ShadowSegment(from, light), *path.counts);
}

void PathTracer::add_lights_beyond(const Path& path,
                                   const geometry::SurfacePoint& from,
                                   film::SampleRadiance& out) const {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    ShadowShares room;
    ShadowShares* const shares = credits_casters(path.bounce) ? &room : nullptr;
    world_.lights.for_each_hit(
        path.straight_o, path.ray.d, infinity, [&](const lights::LightHit& hit) {
            const scene::LightLinks* links = world_.lights.links(hit.light);
            if (!is_found_beyond(path, links) || !is_lit(path, links)) return;
            if (options_.caustics && options_.caustics->finds(path.history, hit.light, 0)) return;
            const lights::LobeMultipliers multipliers = world_.lights.lobe_multipliers(hit.light);
            const Rgb Le =
                path.beta * hit.Le * light_factor(path, multipliers) * light_hit_weight(path, hit);
            if (is_black(Le)) return;
            lights::LightSample light;
            light.wi = path.ray.d;
            light.distance = hit.t;
            const lights::RayCone cone{path.cone_width, path.cone_spread};
            room.clear();
            const Rgb visible =
                OwnShadow(world_, *links, path.interior, cone, own_numbers(path), shares)
                    .visibility(ShadowSegment(from, light), *path.counts);
            deposit_met(path, world_.lights.group(hit.light), Le * visible, multipliers,
                        "light met, by its own shadows", out);
            deposit_taken(room, world_.lights.group(hit.light), Le, out);
        });
    for (const OwnShadowSurfaces& surfaces : world_.own_shadow_surfaces)
        add_surfaces_beyond(path, surfaces, out);
}

void PathTracer::add_surfaces_beyond(const Path& path,
                                     const OwnShadowSurfaces& surfaces,
                                     film::SampleRadiance& out) const {
    ShadowShares shares;
    OwnShadow shadow(world_, surfaces.links, path.interior, {path.cone_width, path.cone_spread},
                     own_numbers(path), credits_casters(path.bounce) ? &shares : nullptr);
    geometry::Ray ray = path.ray;
    for (uint32_t i = 0; i < pass_through_limit && !shadow.is_over(); ++i) {
        ++path.counts->shadow;
        const geometry::Hit hit = surfaces.met
                                      ? world_.accelerator->intersect_some(ray, *surfaces.met)
                                      : world_.accelerator->intersect(ray);
        if (!hit.is_valid()) return;
        shadow.go(ray.o, ray.d, hit.t, *path.counts);
        geometry::SurfacePoint point =
            geometry::make_surface_point(world_.scene, world_.geometry, ray, hit);
        if (world_.lights.may_emit(point)) {
            const float width = shadow.cone_width();
            const lights::SurfaceRadiance emitted = surface_emission(path, point, -ray.d, width);
            if (is_found_beyond(path, emitted.links) && surfaces.is_of(*emitted.links)) {
                const float weight =
                    world_.materials.presence(point, width) * surface_hit_weight(path, point);
                deposit_met(path, emitted.group, path.beta * emitted.Le * weight * shadow.visible(),
                            emitted.multipliers, "surface met, by its own shadows", out);
                deposit_taken(shares, emitted.group, path.beta * emitted.Le * weight, out);
            }
        }
        shadow.meet(point, ray.d);
        ray = geometry::spawn_ray(point, ray.d);
    }
}

}  // namespace velatura::integrator
