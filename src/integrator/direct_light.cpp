// SPDX-License-Identifier: Apache-2.0
#include "integrator/direct_light.h"

#include "integrator/custom_shadow.h"
#include "integrator/light_hits.h"

namespace velatura::integrator {

Rgb DirectLight::visibility(const Path& path,
                            const geometry::SurfacePoint& from,
                            const Interior& inside,
                            const lights::LightSample& light,
                            ShadowShares* shares) const {
    ++path.counts->shadow;
    const shading::MaterialEvaluator& materials = world_.materials;
    ShadowSegment segment(from, light);
    const bool can_pass = materials.has_presence() || materials.is_see_through();
    if (!can_pass && !keeps_interior(world_) && !shares)
        return Rgb(world_.accelerator->is_occluded(segment.ray) ? 0.0f : 1.0f);

    Interior interior = inside;
    if (!can_pass && !shares) {
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
            pass_dielectrics(world_, light.wi, cone_width, point, interior, path.counts) * presence;
        if (shares) shares->add(caster, visible * (Rgb(1.0f) - passed));
        visible *= passed;
        if (is_black(visible)) return visible;
        if (!segment.continue_from(point)) return visible;
    }
    return Rgb(0.0f);
}

Rgb DirectLight::own_visibility(const Path& path,
                                const geometry::SurfacePoint& from,
                                const Interior& inside,
                                const lights::LightSample& light,
                                const scene::LightLinks& links,
                                ShadowShares* shares) const {
    return CustomShadow(world_, links, inside, {path.cone_width, path.cone_spread},
                        custom_shadow_numbers(path), shares)
        .visibility(ShadowSegment(from, light), *path.counts);
}

Rgb DirectLight::volume_transmittance(const Path& path,
                                      const Vec3& p,
                                      const lights::LightSample& light) const {
    const float distance = light.is_surface ? (light.target - p).length() : light.distance;
    sampling::RandomStream numbers =
        path.sampler.stream(path.bounce, sampling::Purpose::VolumeShadow, path.pass_count);
    return world_.volumes->transmittance(p, light.wi, distance, nullptr, numbers,
                                         path.counts->tracking, path.ray.time);
}

}  // namespace velatura::integrator
