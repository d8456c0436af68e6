// SPDX-License-Identifier: Apache-2.0
#include "integrator/custom_shadow.h"

#include "scene/effect_calls.h"

#include <algorithm>
#include <cmath>

namespace velatura::integrator {

CustomShadow::CustomShadow(const World& world,
                           const scene::LightLinks& links,
                           const Interior& interior,
                           const lights::RayCone& cone,
                           const sampling::RandomStream& numbers,
                           ShadowShares* shares)
    : world_(world),
      links_(links),
      casters_(scene::find_link_set(world.scene, links.casters)),
      interior_(interior),
      cone_(cone),
      numbers_(numbers),
      shares_(shares) {
    if (scene::has_shadow_links(world.scene, links)) scene::count_call(scene::Effect::LightLinking);
    if (world.has_ray_visibility) scene::count_call(scene::Effect::RayVisibility);
    if (scene::has_shadow_controls(world.scene, links))
        scene::count_call(scene::Effect::ShadowControls);
    // Solids that cast no shadow take nothing
    if (casters_ && !interior_.is_empty())
        interior_.keep_only([&](scene::MaterialId m) { return world.casts(links.casters, m); });
}

bool CustomShadow::casts(const geometry::SurfacePoint& point) const {
    return !casters_ ||
           casters_->holds(scene::link_class(world_.scene, point.instance, point.shape));
}

/// Of the shadow that a caster here throws.
float CustomShadow::strength() const {
    if (!(traveled_ < links_.shadow_distance)) return 0.0f;
    const float rest = links_.shadow_distance - traveled_;
    if (rest >= links_.shadow_falloff) return 1.0f;
    return std::pow(rest / links_.shadow_falloff, links_.shadow_falloff_gamma);
}

Rgb CustomShadow::visible() const {
    return passed_ + (Rgb(1.0f) - passed_) * links_.shadow_color;
}

void CustomShadow::pass(const Rgb& share, scene::CasterId caster) {
    // Of what is taken the color of the shadow comes back
    if (shares_)
        shares_->add(caster, passed_ * (Rgb(1.0f) - share) * (Rgb(1.0f) - links_.shadow_color));
    passed_ *= share;
}

void CustomShadow::go(const geometry::Ray& ray, const Vec3& d, float distance, RayCounts& counts) {
    const float within = std::min(distance, links_.shadow_distance - traveled_);
    if (!is_blocked_ && within > 0.0f) {
        if (!interior_.is_empty()) passed_ *= interior_.transmittance(world_.materials, within);
        if (world_.volumes)
            pass(world_.volumes->transmittance(ray.o, d, within, casters_, numbers_,
                                               counts.tracking, ray.time),
                 world_.scene.casters.volumes);
    }
    traveled_ += distance;
    cone_.width += cone_.spread * distance;
}

void CustomShadow::cross_surface(geometry::SurfacePoint& point, const Vec3& d) {
    if (is_blocked_ || !casts(point)) return;
    const shading::MaterialEvaluator& materials = world_.materials;
    const scene::CasterId caster = world_.scene.casters.of(point.instance, point.shape);
    const float presence = materials.presence(point, cone_.width);
    const Rgb passed =
        Rgb(1.0f - presence) +
        pass_dielectrics(world_, d, cone_.width, point, interior_, nullptr) * presence;
    pass(Rgb(1.0f) - strength() * (Rgb(1.0f) - passed), caster);
    is_blocked_ = is_black(passed);
}

Rgb CustomShadow::visibility(ShadowSegment segment, RayCounts& counts) {
    if (casters_ && casters_->is_empty()) return Rgb(1.0f);
    const shading::MaterialEvaluator& materials = world_.materials;
    const accel::Accelerator& accelerator = *world_.accelerator;
    const bool is_plain = !materials.has_presence() && !materials.is_see_through() &&
                          !materials.has_absorption() && !world_.volumes && !shares_ &&
                          !(links_.shadow_falloff > 0.0f);
    ++counts.shadow;
    if (is_plain) {
        segment.end_at(links_.shadow_distance);
        const bool is_occluded = casters_ ? accelerator.is_occluded_by_some(segment.ray, *casters_)
                                          : accelerator.is_occluded(segment.ray);
        return is_occluded ? links_.shadow_color : Rgb(1.0f);
    }
    for (uint32_t i = 0; i < pass_through_limit; ++i) {
        segment.end_at(links_.shadow_distance - traveled_);
        const geometry::Hit hit = casters_ ? accelerator.intersect_some(segment.ray, *casters_)
                                           : accelerator.intersect(segment.ray);
        go(segment.ray, segment.wi, segment.length(hit.is_valid() ? hit.t : segment.ray.t_max),
           counts);
        if (!hit.is_valid()) return visible();
        geometry::SurfacePoint point =
            geometry::make_surface_point(world_.scene, world_.geometry, segment.ray, hit);
        cross_surface(point, segment.wi);
        if (is_blocked_ || !segment.continue_from(point)) return visible();
    }
    return links_.shadow_color;
}

}  // namespace velatura::integrator
