// SPDX-License-Identifier: Apache-2.0
#include "integrator/volume_segment.h"

#include "integrator/first_hit.h"
#include "integrator/roulette.h"

#include <algorithm>
#include <limits>

namespace velatura::integrator {

using sampling::Purpose;

VolumeSegment::End VolumeSegment::cross(Path& path,
                                        const InteriorMedia::Medium* solid,
                                        float t_max,
                                        const char*& why,
                                        film::SampleRadiance& out) const {
    // Its list keeps its memory
    thread_local media::Flight flight;
    const bool is_in_body = world_.materials.has_absorption() && !path.interior.is_empty();
    media::FreePath around;
    if (solid) {
        scene::count_call(scene::Effect::InteriorMedia);
        around = solid->medium.draw(
            path.beta,
            path.sampler.stream(path.bounce, Purpose::InteriorDistance, path.pass_count));
    } else if (is_in_body) {
        around.extinction = path.interior.extinction(world_.materials);
    }
    const float reach = std::min(t_max, path.ray.t_max);
    if (world_.volumes) {
        world_.volumes->fly(
            path.ray.o, path.ray.d, reach, path.beta, around,
            path.sampler.stream(path.bounce, Purpose::VolumeDistance, path.pass_count), flight,
            path.counts->tracking, world_.visible_to(path.kind), path.ray.time);
        if (flight.is_capped) {
            why = "reached the collision limit of a volume";
            return End::Ended;
        }
    } else {
        flight.clear();
        flight.around = around;
    }
    const bool ends_in_body = !flight.medium && around.end < reach;
    if (ends_in_body) flight.t = around.end;

    // Add what gives light on the way
    path.flight = &flight;
    hits_.add(path, flight.collides() ? flight.t : t_max, out);
    path.flight = nullptr;
    deposit(path, path.bounce, world_.scene.emissive_group(), path.beta * flight.emitted,
            "volume emission", out, path.is_sharp);

    path.beta *= flight.weight;
    if (!flight.collides()) {
        if (solid && t_max < std::numeric_limits<float>::infinity())
            path.beta *= around.weight_at(t_max);
        if (!is_black(path.beta)) return End::Through;
        why = "absorbed";
        return End::Ended;
    }
    const Vec3 p = path.ray.o + path.ray.d * flight.t;
    if (path.observer) path.observer->on_volume(path.bounce, p, flight.t, path.beta);
    // What solids have inside is nobody's
    if (!ends_in_body && context_.credits_casters(path.bounce))
        attribution_.credit_caster(path, flight.t, world_.scene.casters.volumes, path.beta,
                                   {p, path.ray.d}, out);
    path.cone_width += path.cone_spread * flight.t;
    if (ends_in_body) {
        path.beta *= around.weight_of_collision();
        why = scatter(
            path, {solid->medium.phase(), solid->medium.albedo(), solid->provenance, solid->link},
            p, out);
        return why ? End::Ended : End::Scattered;
    }
    if (solid)
        path.beta *= around.weight_at(flight.t);
    else if (is_in_body)
        path.beta *= path.interior.transmittance(world_.materials, flight.t);
    const scene::Volume& volume = world_.scene.volumes[flight.medium->volume()];
    if (world_.mattes && path.kind == scene::RayKind::Camera && world_.mattes->holds(volume.link)) {
        scene::count_call(scene::Effect::Mattes);
        why = "hit a matte object";
        return End::Ended;
    }
    why = scatter(path,
                  {flight.medium->phase(), flight.medium->albedo(flight.place), volume.provenance,
                   volume.link},
                  p, out);
    return why ? End::Ended : End::Scattered;
}

const char* VolumeSegment::scatter(Path& path,
                                   const Scatterer& scatterer,
                                   const Vec3& p,
                                   film::SampleRadiance& out) const {
    if (path.bounce == 0 && !out.has_hit) record_first_collision(context_, scatterer, p, out);
    path.beta *= scatterer.albedo;
    if (is_black(path.beta)) return "absorbed";
    if (path.bounce >= context_.depth_limit) {
        if (context_.depth_limit == hard_depth_limit) ++path.counts->depth_limited;
        return "reached the depth limit";
    }
    const geometry::SurfacePoint point = scatterer.point_at(p, path.ray.time);
    film::PathLabels* const labels = out.labels();
    if (labels) labels->look(film::EventShares::only(film::PathEvent::Volume));
    add_direct_light(path, scatterer, point, out);
    if (context_.options.estimator.specular_chains_only) return "absorbed";

    // Go on where the phase function leads
    if (labels) labels->go();
    const Vec3 d = path.ray.d;
    const Vec3 wi = scatterer.phase.sample(
        d, path.sampler.get_2d(path.bounce, Purpose::VolumeDirection, path.pass_count));
    if (path.observer)
        path.observer->on_turn(path.bounce, {wi, film::EventShares::only(film::PathEvent::Volume),
                                             scatterer.phase.pdf(d, wi), false});
    const float time = path.ray.time;
    path.ray = {p, wi};
    path.ray.time = time;
    path.straight_o = p;
    path.traveled = 0;
    path.line_hit_count = Path::unknown_hits;
    path.is_certain = path.is_sharp = false;
    path.emission_receiver = lights::EmissionReceiver::Scattering;
    path.receiver = scatterer.receiver_at(p, time);
    path.scatter_pdf = scatterer.phase.pdf(d, wi);
    path.kind = scene::RayKind::Volume;
    // Lobes of the light's multipliers: what scatters everywhere is the diffuse one
    path.diffuse_share = Rgb(1.0f);
    path.importance = 0;
    path.history = {};
    path.branches = 1;
    const bool is_first = path.bounce == 0;
    ++path.bounce;
    path.pass_count = 0;
    if (is_first && context_.has_unoccluded) hits_.add_unoccluded(path, out);
    if (world_.has_custom_shadows) hits_.add_beyond(path, point, out);
    if (!survives_roulette(context_, path)) return "ended by roulette";
    ++path.counts->indirect;
    return nullptr;
}

void VolumeSegment::add_direct_light(Path& path,
                                     const Scatterer& scatterer,
                                     const geometry::SurfacePoint& point,
                                     film::SampleRadiance& out) const {
    if (world_.selector->is_empty()) return;
    direct_.for_each_sample(
        path, point, scatterer.receiver_at(point.p, point.time),
        [&](const DirectLight::ChosenLight& chosen) {
            const lights::LightSample& light = chosen.light;
            // Weigh it against finding the same light by going on
            const float phase_pdf = scatterer.phase.pdf(path.ray.d, light.wi);
            float f = phase_pdf;
            if (world_.has_lobe_multipliers) {
                scene::count_call(scene::Effect::LobeMultipliers);
                f *= world_.lights.lobe_multipliers(chosen.choice.light).diffuse;
            }
            const float light_pdf = chosen.choice.pmf * light.pdf;
            const bool has_rival =
                context_.options.estimator.light_sampling == LightSampling::Mis && !light.is_delta;
            const float weight = has_rival ? sampling::power_heuristic(light_pdf, phase_pdf) : 1.0f;
            const Rgb Ld = path.beta * light.Le * (f * weight / light_pdf);
            if (is_black(Ld)) return;
            if (path.observer)
                path.observer->on_light({chosen.choice.light, point.p, light.wi, light.distance,
                                         light_pdf, has_rival ? phase_pdf : 0.0f, weight, Ld});
            direct_.deposit_visible(path, point, -path.ray.d, chosen, Ld, out);
        });
}

}  // namespace velatura::integrator
