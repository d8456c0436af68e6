// SPDX-License-Identifier: Apache-2.0
// What paths do in volumes and in what fills bodies (docs/reference/volumes.md).
#include "integrator/direct_light.h"
#include "integrator/light_walk.h"
#include "integrator/path.h"
#include "integrator/path_tracer.h"
#include "integrator/render_options.h"
#include "sampling/mis.h"
#include "scene/effect_calls.h"

#include <algorithm>
#include <limits>

namespace velatura::integrator {

using sampling::Purpose;
using scene::count_call;
using scene::Effect;

/// One of a volume, or of what fills a body.
struct PathTracer::Scatterer {
    const media::HenyeyGreenstein& phase;
    Rgb albedo;
    scene::ProvenanceId provenance;
    scene::LinkClass link;

    /// Every direction counts.
    lights::Receiver receiver_at(const Vec3& p) const {
        lights::Receiver receiver{p};
        receiver.link = link;
        return receiver;
    }

    /// Where light scatters, for what asks for surfaces: rays leave from p itself, and no body is
    /// entered or left.
    geometry::SurfacePoint point_at(const Vec3& p, float time) const {
        geometry::SurfacePoint point;
        point.p = p;
        point.p_error = point.ng = point.ns = Vec3(0.0f);
        point.time = time;
        point.provenance = provenance;
        return point;
    }
};

PathTracer::Crossing PathTracer::cross_matter(Path& path,
                                              const BodyMedia::Medium* body,
                                              float t_max,
                                              const char*& end,
                                              film::SampleRadiance& out) const {
    // Its list keeps its memory
    thread_local media::Flight flight;
    const bool is_in_body = world_.materials.has_absorption() && !path.interior.is_empty();
    media::FreeWay around;
    if (body) {
        count_call(Effect::InteriorMedia);
        around = body->matter.draw(
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
            path.counts->tracking);
        if (flight.is_capped) {
            end = "met too much in a volume";
            return Crossing::Ended;
        }
    } else {
        flight.clear();
        flight.around = around;
    }
    const bool ends_in_body = !flight.medium && around.end < reach;
    if (ends_in_body) flight.t = around.end;

    // Add what gives light on the way
    path.flight = &flight;
    add_light_hits(path, flight.collides() ? flight.t : t_max, out);
    path.flight = nullptr;
    deposit(path, path.bounce, world_.scene.emissive_group(), path.beta * flight.emitted,
            "volume emission", out);

    path.beta *= flight.weight;
    if (!flight.collides()) {
        if (body && t_max < std::numeric_limits<float>::infinity())
            path.beta *= around.weight_at(t_max);
        if (!is_black(path.beta)) return Crossing::Through;
        end = "absorbed";
        return Crossing::Ended;
    }
    const Vec3 p = path.ray.o + path.ray.d * flight.t;
    if (path.observer) path.observer->on_volume(path.bounce, p, flight.t, path.beta);
    // What bodies have inside is nobody's
    if (!ends_in_body && credits_casters(path.bounce))
        credit_caster(path, flight.t, world_.scene.casters.volumes, path.beta, {p, path.ray.d},
                      out);
    path.cone_width += path.cone_spread * flight.t;
    if (ends_in_body) {
        path.beta *= around.weight_of_collision();
        end = scatter_in_matter(
            path, {body->matter.phase(), body->matter.albedo(), body->provenance, body->link}, p,
            out);
        return end ? Crossing::Ended : Crossing::Scattered;
    }
    if (body)
        path.beta *= around.weight_at(flight.t);
    else if (is_in_body)
        path.beta *= path.interior.transmittance(world_.materials, flight.t);
    const scene::Volume& volume = world_.scene.volumes[flight.medium->volume()];
    end = scatter_in_matter(
        path, {flight.medium->phase(), flight.medium->albedo(p), volume.provenance, volume.link}, p,
        out);
    return end ? Crossing::Ended : Crossing::Scattered;
}

/// Returns: why the path ends there, or null.
const char* PathTracer::scatter_in_matter(Path& path,
                                          const Scatterer& matter,
                                          const Vec3& p,
                                          film::SampleRadiance& out) const {
    if (path.bounce == 0 && !out.has_hit) record_first_collision(matter, p, out);
    path.beta *= matter.albedo;
    if (is_black(path.beta)) return "absorbed";
    if (path.bounce >= depth_limit_) {
        if (depth_limit_ == hard_depth_limit) ++path.counts->depth_limited;
        return "reached the depth limit";
    }
    const geometry::SurfacePoint point = matter.point_at(p, path.ray.time);
    film::PathLabels* const labels = labels_of(out);
    if (labels) labels->look(film::EventShares::only(film::PathEvent::Volume));
    add_direct_light_in_matter(path, matter, point, out);
    if (options_.estimator.specular_chains_only) return "absorbed";

    // Go on where the phase function leads
    if (labels) labels->go();
    const Vec3 d = path.ray.d;
    const Vec3 wi = matter.phase.sample(
        d, path.sampler.get_2d(path.bounce, Purpose::VolumeDirection, path.pass_count));
    const float time = path.ray.time;
    path.ray = {p, wi};
    path.ray.time = time;
    path.straight_o = p;
    path.travelled = 0;
    path.line_hit_count = Path::unknown_hits;
    path.is_certain = false;
    path.onlooker = lights::Onlooker::Scattering;
    path.receiver = matter.receiver_at(p);
    path.scatter_pdf = matter.phase.pdf(d, wi);
    // Lobes of the light's multipliers: what scatters everywhere is the diffuse one
    path.diffuse_share = Rgb(1.0f);
    path.importance = 0;
    path.history = {};
    path.branches = 1;
    const bool is_first = path.bounce == 0;
    ++path.bounce;
    path.pass_count = 0;
    if (is_first && has_unoccluded_) add_unoccluded_hits(path, out);
    if (world_.has_own_shadows) add_lights_beyond(path, point, out);
    if (!survives_roulette(path)) return "ended by roulette";
    ++path.counts->indirect;
    return nullptr;
}

void PathTracer::add_direct_light_in_matter(Path& path,
                                            const Scatterer& matter,
                                            const geometry::SurfacePoint& point,
                                            film::SampleRadiance& out) const {
    if (world_.selector->is_empty()) return;
    const lights::Receiver receiver = matter.receiver_at(point.p);
    const LightSampling strategy = options_.estimator.light_sampling;
    if (looks_around(strategy)) {
        const Vec2 u = path.sampler.get_2d(path.bounce, Purpose::LightDirection, path.pass_count);
        for_each_light_along(path, point, receiver, look_around(receiver, strategy, u),
                             [&](const ChosenLight& chosen) {
                                 deposit_sampled_in_matter(path, matter, point, chosen, out);
                             });
    }
    ChosenLight chosen;
    if (!choose_light(path, receiver, chosen)) return;
    if (is_left_to_directions(strategy) && !chosen.light.is_delta) return;
    deposit_sampled_in_matter(path, matter, point, chosen, out);
}

void PathTracer::deposit_sampled_in_matter(Path& path,
                                           const Scatterer& matter,
                                           const geometry::SurfacePoint& point,
                                           const ChosenLight& chosen,
                                           film::SampleRadiance& out) const {
    const lights::LightSample& light = chosen.light;
    // Weigh it against finding the same light by going on
    const float phase_pdf = matter.phase.pdf(path.ray.d, light.wi);
    float f = phase_pdf;
    if (world_.has_lobe_multipliers) {
        count_call(Effect::LobeMultipliers);
        f *= world_.lights.lobe_multipliers(chosen.choice.light).diffuse;
    }
    const float light_pdf = chosen.choice.pmf * light.pdf;
    const bool has_rival =
        options_.estimator.light_sampling == LightSampling::Mis && !light.is_delta;
    const float weight = has_rival ? sampling::balance_heuristic(light_pdf, phase_pdf) : 1.0f;
    const Rgb Ld = path.beta * light.Le * (f * weight / light_pdf);
    if (!is_black(Ld)) deposit_direct(path, point, -path.ray.d, chosen, Ld, out);
}

Rgb PathTracer::volume_transmittance(const Path& path,
                                     const Vec3& p,
                                     const lights::LightSample& light) const {
    const float distance = light.is_surface ? (light.target - p).length() : light.distance;
    sampling::RandomStream numbers =
        path.sampler.stream(path.bounce, Purpose::VolumeShadow, path.pass_count);
    return world_.volumes->transmittance(p, light.wi, distance, nullptr, numbers,
                                         path.counts->tracking);
}

void PathTracer::record_first_collision(const Scatterer& matter,
                                        const Vec3& p,
                                        film::SampleRadiance& out) const {
    out.has_hit = true;
    out.alpha = 1.0f;
    out.albedo = matter.albedo;
    const Vec3d world = Vec3d(p) + world_.scene.camera.world_position;
    out.P = to_float(world);
    out.Z = world_.camera.depth(p);
    out.prim_id = matter.provenance;
    if (options_.deep) {
        count_call(Effect::DeepSamples);
        out.cover(film::SampleRadiance::DepthKind::Volume, out.Z);
    }
}

}  // namespace velatura::integrator
