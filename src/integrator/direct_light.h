// SPDX-License-Identifier: Apache-2.0
// What surfaces and volumes share of direct light, to be inlined into both: it runs at every vertex.
#pragma once

#include <optional>

#include "integrator/path.h"
#include "integrator/path_tracer.h"
#include "scene/effect_calls.h"

namespace velatura::integrator {

inline void PathTracer::deposit(const Path& path, int bounce, scene::GroupId group, const Rgb& radiance, const char* what, film::SampleRadiance& out) const {
    if (is_black(radiance)) return;
    out.add(bounce, int(group), radiance);
    if (path.observer) path.observer->on_deposit(bounce, group, radiance, what);
}

inline bool PathTracer::choose_light(const Path& path, const lights::Receiver& receiver, ChosenLight& chosen) const {
    double u_light = 0.0;
    if (world_.chooses_lights) {
        scene::count_call(scene::Effect::LightSelection);
        u_light = path.sampler.get_1d_fine(path.bounce, sampling::Purpose::LightSelect, path.pass_count);
    }
    if (world_.has_very_many_lights) u_light += 0x1p-32 * path.sampler.get_1d_fine(path.bounce, sampling::Purpose::LightSelectFine, path.pass_count);
    const std::optional<lights::LightChoice> choice = world_.selector->select(receiver, u_light);
    if (!choice) return false;
    chosen.choice = *choice;
    chosen.links = world_.has_links() ? world_.lights.links(choice->light) : nullptr;
    if (!world_.lights.shines_on(chosen.links, receiver.link)) return false;
    const Vec2 u = path.sampler.get_2d(path.bounce, sampling::Purpose::LightSurface, path.pass_count);
    const std::optional<lights::LightSample> light = world_.lights.sample(choice->light, receiver.p, u, {path.cone_width, path.cone_spread});
    if (!light || is_black(light->Le)) return false;
    chosen.light = *light;
    return true;
}

inline void PathTracer::deposit_direct(Path& path, const geometry::SurfacePoint& from, const Vec3& wo, const ChosenLight& chosen, const Rgb& Ld, film::SampleRadiance& out, const NestedBodies::Crossing* crossing) const {
    // Deposit it where it is seen, and in the unoccluded layer in any case
    const auto& [choice, light, links] = chosen;
    const scene::GroupId group = world_.lights.group(choice.light);
    if (has_shadow_layers_ && path.bounce == 0) {
        scene::count_call(scene::Effect::ShadowLayers);
        out.add_unoccluded(int(group), Ld);
    }
    std::optional<Interior> crossed;
    if (world_.materials.has_absorption()) cross(world_, crossing, from, wo, light.wi, crossed.emplace(path.interior));
    const Interior& interior = crossed ? *crossed : path.interior;
    const bool has_own_shadows = links && links->has_own_shadows();
    Rgb visible = has_own_shadows ? own_visibility(path, from, interior, light, *links) : visibility(path, from, interior, light);
    if (world_.volumes && !has_own_shadows && !is_black(visible)) visible *= volume_transmittance(path, from.p, light);
    deposit(path, path.bounce + 1, group, Ld * visible, "light sampled", out);
}

}  // namespace velatura::integrator
