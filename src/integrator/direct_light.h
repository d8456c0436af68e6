// SPDX-License-Identifier: Apache-2.0
// Inlined into surfaces and volumes alike: it runs at every vertex.
#pragma once

#include "integrator/classic/directions.h"
#include "integrator/deposit.h"
#include "integrator/path.h"
#include "integrator/shadow_attribution.h"
#include "integrator/shadow_segment.h"
#include "integrator/tracer_context.h"
#include "sampling/mis.h"
#include "scene/effect_calls.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace velatura::integrator {

/// Next-event estimation: chooses a light and a point of it, weighs it against finding it by going
/// on, and deposits what arrives. Ref: Pharr, Jakob, Humphreys 2023, section 13.4.
class DirectLight {
  public:
    explicit DirectLight(const TracerContext& context) : context_(context), world_(context.world) {}

    /// A light that was sampled, and its links if it has any.
    struct ChosenLight {
        lights::LightChoice choice;
        lights::LightSample light;
        const scene::LightLinks* links = nullptr;
    };

    /// Of a surface.
    void add(Path& path, const Vertex& vertex, film::SampleRadiance& out) const;

    /// The number in [0, 1) that chooses the light at the path's vertex.
    double light_number(const Path& path) const;

    /// Chooses a light by its number and a direction towards it; false when none arrives there.
    bool choose(const Path& path,
                const lights::Receiver& receiver,
                double u_light,
                ChosenLight& chosen) const;

    /// Calls give(const ChosenLight&) for what the light sampling strategy samples from a point.
    template <class Give>
    void for_each_sample(const Path& path,
                         const geometry::SurfacePoint& from,
                         const lights::Receiver& receiver,
                         const Give& give) const;

    /// Deposits Ld of the light, as far as it arrives.
    void deposit_visible(Path& path,
                         const geometry::SurfacePoint& from,
                         const Vec3& wo,
                         const ChosenLight& chosen,
                         const Rgb& Ld,
                         film::SampleRadiance& out,
                         const NestedDielectrics::Crossing* crossing = nullptr) const;

    /// How much of a sampled light arrives at a surface, by cut-outs, clear interfaces and
    /// interiors. inside: the interior where it arrives. shares: null, or who takes the rest.
    Rgb visibility(const Path& path,
                   const geometry::SurfacePoint& from,
                   const Interior& inside,
                   const lights::LightSample& light,
                   ShadowShares* shares) const;

  private:
    void deposit_sampled(Path& path,
                         const Vertex& vertex,
                         const ChosenLight& chosen,
                         film::SampleRadiance& out) const;
    /// Calls give(const ChosenLight&) for every light along a direction of the vertex's own (see
    /// LightSampling::Hemisphere), delta lights skipped, as if each had been sampled there alone:
    /// what blocks it is for the taker to find.
    template <class Give>
    void for_each_light_along(const Path& path,
                              const geometry::SurfacePoint& from,
                              const lights::Receiver& receiver,
                              const classic::LightDirection& along,
                              const Give& give) const;
    Rgb own_visibility(const Path& path,
                       const geometry::SurfacePoint& from,
                       const Interior& inside,
                       const lights::LightSample& light,
                       const scene::LightLinks& links,
                       ShadowShares* shares) const;
    Rgb volume_transmittance(const Path& path,
                             const Vec3& p,
                             const lights::LightSample& light) const;

    const TracerContext& context_;
    const World& world_;
};

inline double DirectLight::light_number(const Path& path) const {
    double u_light = 0.0;
    if (world_.chooses_lights) {
        scene::count_call(scene::Effect::LightSelection);
        u_light =
            path.sampler.get_1d_fine(path.bounce, sampling::Purpose::LightSelect, path.pass_count);
    }
    if (world_.has_very_many_lights)
        u_light += 0x1p-32 * path.sampler.get_1d_fine(
                                 path.bounce, sampling::Purpose::LightSelectFine, path.pass_count);
    return u_light;
}

inline bool DirectLight::choose(const Path& path,
                                const lights::Receiver& receiver,
                                double u_light,
                                ChosenLight& chosen) const {
    const std::optional<lights::LightChoice> choice = world_.selector->select(receiver, u_light);
    if (!choice) return false;
    chosen.choice = *choice;
    chosen.links = world_.has_links() ? world_.lights.links(choice->light) : nullptr;
    if (!world_.lights.illuminates(chosen.links, receiver.link)) return false;
    const Vec2 u =
        path.sampler.get_2d(path.bounce, sampling::Purpose::LightSurface, path.pass_count);
    const std::optional<lights::LightSample> light = world_.lights.sample(
        choice->light, receiver.p, u, {path.cone_width, path.cone_spread}, receiver.time);
    if (!light || is_black(light->Le)) return false;
    chosen.light = *light;
    return true;
}

inline void DirectLight::deposit_visible(Path& path,
                                         const geometry::SurfacePoint& from,
                                         const Vec3& wo,
                                         const ChosenLight& chosen,
                                         const Rgb& Ld,
                                         film::SampleRadiance& out,
                                         const NestedDielectrics::Crossing* crossing) const {
    // Deposit it where it is seen, and in the unoccluded layer in any case
    const auto& [choice, light, links] = chosen;
    const scene::GroupId group = world_.lights.group(choice.light);
    if (context_.has_unoccluded && path.bounce == 0) {
        scene::count_call(scene::Effect::ShadowLayers);
        out.add_unoccluded(int(group), Ld);
    }
    std::optional<Interior> crossed;
    if (keeps_interior(world_))
        cross(world_, crossing, from, wo, light.wi, crossed.emplace(path.interior));
    const Interior& interior = crossed ? *crossed : path.interior;
    ShadowShares* shares = nullptr;
    if (context_.credits_casters(path.bounce + 1)) {
        scene::count_call(scene::Effect::CasterLayers);
        thread_local ShadowShares scratch;
        scratch.clear();
        shares = &scratch;
    }
    const bool has_custom_shadows = links && links->has_custom_shadows();
    Rgb visible = has_custom_shadows ? own_visibility(path, from, interior, light, *links, shares)
                                     : visibility(path, from, interior, light, shares);
    if (world_.volumes && !has_custom_shadows && !is_black(visible)) {
        const Rgb passed = volume_transmittance(path, from.p, light);
        if (shares) shares->add(world_.scene.casters.volumes, visible * (Rgb(1.0f) - passed));
        visible *= passed;
    }
    if (shares) deposit_occluded(*shares, group, Ld, out);
    deposit(path, path.bounce + 1, group, Ld * visible, "light sampled", out);
}

// As a call of its own it costs 0.3 % of a plain render
[[gnu::always_inline]] inline void DirectLight::deposit_sampled(Path& path,
                                                                const Vertex& vertex,
                                                                const ChosenLight& chosen,
                                                                film::SampleRadiance& out) const {
    const auto& [point, bsdf, wo, directions, crossing, is_exit] = vertex;
    const auto& [choice, light, links] = chosen;

    // Weigh it against finding the same light by going on
    shading::BsdfValue value = bsdf.evaluate(wo, light.wi);
    const CausticPaths* const traced = context_.options.caustic_paths;
    if (traced && path.is_caustic_receiver && !is_exit && traced->takes_light(choice.light) &&
        traced->casts(point))
        value = bsdf.wide_part(value);
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
        context_.options.estimator.light_sampling == LightSampling::Mis && !light.is_delta;
    const float rival_pdf = has_rival ? directions.pdf(light.wi, value.pdf) : 0.0f;
    const float weight = has_rival ? sampling::power_heuristic(light_pdf, rival_pdf) : 1.0f;
    const Rgb Ld = path.beta * f * light.Le * (bsdf.cosine(light.wi) * weight / light_pdf);
    if (is_black(Ld)) return;

    film::PathLabels* const labels = out.labels();
    if (labels) labels->look(vertex.events(value, multipliers));
    if (path.observer)
        path.observer->on_light(
            {choice.light, point.p, light.wi, light.distance, light_pdf, rival_pdf, weight, Ld});
    deposit_visible(path, point, wo, chosen, Ld, out, crossing);
    if (labels) labels->stay();
}

template <class Give>
void DirectLight::for_each_light_along(const Path& path,
                                       const geometry::SurfacePoint& from,
                                       const lights::Receiver& receiver,
                                       const classic::LightDirection& along,
                                       const Give& give) const {
    ChosenLight chosen;
    chosen.light.wi = along.wi;
    chosen.light.pdf = along.pdf;
    const auto offer = [&](lights::LightId id) {
        chosen.choice = {id, 1.0f};
        chosen.links = world_.has_links() ? world_.lights.links(id) : nullptr;
        if (world_.lights.illuminates(chosen.links, receiver.link) && !is_black(chosen.light.Le))
            give(chosen);
    };
    geometry::Ray ray = geometry::spawn_ray(from, along.wi);
    world_.lights.for_each_hit(ray.o, along.wi, std::numeric_limits<float>::infinity(), ray.time,
                               [&](const lights::LightHit& hit) {
                                   chosen.light.distance = hit.t;
                                   chosen.light.Le = hit.Le;
                                   offer(hit.light);
                               });
    if (!context_.has_emission) return;

    // Surfaces that emit, as far as somebody might see them
    const bool sees_all = context_.has_unoccluded || world_.has_custom_shadows || world_.nested;
    chosen.light.is_surface = true;
    chosen.light.distance = 0;
    for (uint32_t i = 0; i < pass_through_limit; ++i) {
        const geometry::Hit hit = world_.accelerator->intersect(ray);
        ++path.counts->shadow;
        if (!hit.is_valid()) return;
        geometry::SurfacePoint point =
            geometry::make_surface_point(world_.scene, world_.geometry, ray, hit);
        chosen.light.distance += hit.t;
        ray = geometry::spawn_ray(point, along.wi);
        const std::optional<lights::LightId> id =
            world_.lights.can_emit(point) ? world_.lights.find_surface(point) : std::nullopt;
        if (id) {
            const float footprint = path.cone_width + path.cone_spread * chosen.light.distance;
            chosen.light.Le = world_.lights
                                  .surface_radiance(point, -along.wi, footprint,
                                                    lights::EmissionReceiver::Scattering, &from.p)
                                  .Le *
                              world_.materials.presence(point, footprint);
            // As of emissive triangles that are sampled: beside the surface, seen from where the
            // vertex is
            for (int c = 0; c < 3; ++c)
                point.p_error[c] += 0x1p-23f * std::abs(from.p[c] - point.p[c]);
            chosen.light.target = geometry::offset_ray_origin(point, from.p - point.p);
            offer(*id);
        }
        const bool can_pass = world_.materials.material_has_presence(point.material) ||
                              world_.materials.material_is_see_through(point.material);
        if (!can_pass && !sees_all) return;
    }
}

template <class Give>
void DirectLight::for_each_sample(const Path& path,
                                  const geometry::SurfacePoint& from,
                                  const lights::Receiver& receiver,
                                  const Give& give) const {
    const LightSampling strategy = context_.options.estimator.light_sampling;
    if (looks_around(strategy)) {
        const Vec2 u =
            path.sampler.get_2d(path.bounce, sampling::Purpose::LightDirection, path.pass_count);
        const classic::LightDirection along = strategy == LightSampling::Cosine
                                                  ? classic::cosine_direction(receiver, u)
                                                  : classic::uniform_direction(receiver, u);
        if (along.pdf > 0.0f) for_each_light_along(path, from, receiver, along, give);
    }
    ChosenLight chosen;
    if (!choose(path, receiver, light_number(path), chosen)) return;
    if (is_left_to_bsdf_sampling(strategy) && !chosen.light.is_delta) return;
    give(chosen);
}

inline void DirectLight::add(Path& path, const Vertex& vertex, film::SampleRadiance& out) const {
    if (world_.selector->is_empty() || !vertex.bsdf.has_non_delta()) return;
    for_each_sample(path, vertex.point, receiver_at(world_, vertex.point, vertex.bsdf),
                    [&](const ChosenLight& chosen) { deposit_sampled(path, vertex, chosen, out); });
}

}  // namespace velatura::integrator
