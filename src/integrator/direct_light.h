// SPDX-License-Identifier: Apache-2.0
// What surfaces and volumes share of direct light, to be inlined into both: it runs at every
// vertex.
#pragma once

#include "integrator/labelling.h"
#include "integrator/path.h"
#include "integrator/path_tracer.h"
#include "sampling/mis.h"
#include "scene/effect_calls.h"

#include <optional>

namespace velatura::integrator {

inline void PathTracer::deposit(const Path& path,
                                int bounce,
                                scene::GroupId group,
                                const Rgb& radiance,
                                const char* what,
                                film::SampleRadiance& out) const {
    if (is_black(radiance)) return;
    out.add(bounce, int(group), radiance, path.share);
    if (path.observer) path.observer->on_deposit(bounce, group, radiance, what);
}

/// The last scattering's parts count by the multipliers, each kind by its own.
template <class Give>
void give_met(film::PathLabels* labels,
              bool is_weighed,
              const lights::LobeMultipliers& multipliers,
              const Give& give) {
    if (labels && is_weighed) labels->weigh(multipliers.diffuse, multipliers.specular);
    give();
    if (labels && is_weighed) labels->stay();
}

inline void PathTracer::deposit_met(const Path& path,
                                    scene::GroupId group,
                                    const Rgb& radiance,
                                    const lights::LobeMultipliers& multipliers,
                                    const char* what,
                                    film::SampleRadiance& out) const {
    give_met(labels_of(out), world_.has_lobe_multipliers && path.bounce > 0, multipliers,
             [&] { deposit(path, path.bounce, group, radiance, what, out); });
}

inline void PathTracer::add_unoccluded_met(scene::GroupId group,
                                           const Rgb& radiance,
                                           const lights::LobeMultipliers& multipliers,
                                           film::SampleRadiance& out) const {
    if (is_black(radiance)) return;
    give_met(labels_of(out), world_.has_lobe_multipliers, multipliers,
             [&] { out.add_unoccluded(int(group), radiance); });
}

inline bool PathTracer::choose_light(const Path& path,
                                     const lights::Receiver& receiver,
                                     ChosenLight& chosen) const {
    using scene::Effect;
    double u_light = 0.0;
    if (world_.chooses_lights) {
        scene::count_call(Effect::LightSelection);
        u_light =
            path.sampler.get_1d_fine(path.bounce, sampling::Purpose::LightSelect, path.pass_count);
    }
    if (world_.has_very_many_lights)
        u_light += 0x1p-32 * path.sampler.get_1d_fine(
                                 path.bounce, sampling::Purpose::LightSelectFine, path.pass_count);
    const std::optional<lights::LightChoice> choice = world_.selector->select(receiver, u_light);
    if (!choice) return false;
    chosen.choice = *choice;
    chosen.links = world_.has_links() ? world_.lights.links(choice->light) : nullptr;
    if (!world_.lights.shines_on(chosen.links, receiver.link)) return false;
    const Vec2 u =
        path.sampler.get_2d(path.bounce, sampling::Purpose::LightSurface, path.pass_count);
    const std::optional<lights::LightSample> light =
        world_.lights.sample(choice->light, receiver.p, u, {path.cone_width, path.cone_spread});
    if (!light || is_black(light->Le)) return false;
    chosen.light = *light;
    return true;
}

inline void PathTracer::deposit_direct(Path& path,
                                       const geometry::SurfacePoint& from,
                                       const Vec3& wo,
                                       const ChosenLight& chosen,
                                       const Rgb& Ld,
                                       film::SampleRadiance& out,
                                       const NestedBodies::Crossing* crossing) const {
    // Deposit it where it is seen, and in the unoccluded layer in any case
    using scene::Effect;
    const auto& [choice, light, links] = chosen;
    const scene::GroupId group = world_.lights.group(choice.light);
    if (has_unoccluded_ && path.bounce == 0) {
        scene::count_call(Effect::ShadowLayers);
        out.add_unoccluded(int(group), Ld);
    }
    std::optional<Interior> crossed;
    if (keeps_interior(world_))
        cross(world_, crossing, from, wo, light.wi, crossed.emplace(path.interior));
    const Interior& interior = crossed ? *crossed : path.interior;
    ShadowShares* shares = nullptr;
    if (credits_casters(path.bounce + 1)) {
        scene::count_call(Effect::CasterLayers);
        thread_local ShadowShares room;
        room.clear();
        shares = &room;
    }
    const bool has_own_shadows = links && links->has_own_shadows();
    Rgb visible = has_own_shadows ? own_visibility(path, from, interior, light, *links, shares)
                                  : visibility(path, from, interior, light, shares);
    if (world_.volumes && !has_own_shadows && !is_black(visible)) {
        const Rgb passed = volume_transmittance(path, from.p, light);
        if (shares) shares->add(world_.scene.casters.volumes, visible * (Rgb(1.0f) - passed));
        visible *= passed;
    }
    if (shares) deposit_taken(*shares, group, Ld, out);
    deposit(path, path.bounce + 1, group, Ld * visible, "light sampled", out);
}

// Into every vertex, like all of this: as a call of its own it costs 0.3 % of a plain render
[[gnu::always_inline]] inline void PathTracer::deposit_sampled(Path& path,
                                                               const Vertex& vertex,
                                                               const ChosenLight& chosen,
                                                               film::SampleRadiance& out) const {
    const auto& [point, bsdf, wo, directions, crossing, is_exit] = vertex;
    const auto& [choice, light, links] = chosen;

    // Weigh it against finding the same light by going on
    const shading::BsdfValue value = bsdf.evaluate(wo, light.wi);
    Rgb f = value.f();
    lights::LobeMultipliers multipliers;
    if (world_.has_lobe_multipliers) {
        scene::count_call(scene::Effect::LobeMultipliers);
        multipliers = world_.lights.lobe_multipliers(choice.light);
        f = value.diffuse * multipliers.diffuse + value.specular * multipliers.specular;
    }
    if (is_black(f)) return;
    const float light_pdf = choice.pmf * light.pdf;
    const bool has_rival =
        options_.estimator.light_sampling == LightSampling::Mis && !light.is_delta;
    const float weight =
        has_rival ? sampling::balance_heuristic(light_pdf, directions.pdf(light.wi, value.pdf))
                  : 1.0f;
    const Rgb Ld = path.beta * f * light.Le * (bsdf.cosine(light.wi) * weight / light_pdf);
    if (is_black(Ld)) return;

    film::PathLabels* const labels = labels_of(out);
    if (labels) labels->look(vertex.events(value, multipliers));
    deposit_direct(path, point, wo, chosen, Ld, out, crossing);
    if (labels) labels->stay();
}

}  // namespace velatura::integrator
