// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/caustic_paths.h"
#include "integrator/caustics.h"
#include "integrator/direction_mixture.h"
#include "integrator/path_events.h"
#include "integrator/path_observer.h"
#include "integrator/ray_counts.h"
#include "integrator/world.h"
#include "media/flight.h"
#include "scene/effect_calls.h"

#include <array>
#include <cstdint>

namespace velatura::integrator {

inline bool keeps_interior(const World& world) {
    return world.materials.has_absorption();
}

/// Light selection at a vertex, for both samplers alike.
inline lights::Receiver receiver_at(const World& world,
                                    const geometry::SurfacePoint& point,
                                    const shading::Bsdf& bsdf) {
    const bool is_hair = bsdf.is_hair();
    lights::Receiver receiver{point.p, is_hair ? Vec3(0.0f) : bsdf.ns(), bsdf.has_transmission()};
    receiver.time = point.time;
    if (!world.has_light_links) return receiver;
    scene::count_call(scene::Effect::LightLinking);
    receiver.link = scene::link_class(world.scene, point.instance, point.shape);
    return receiver;
}

/// A path while it is traced.
struct Path {
    static constexpr int unknown_hits = -1;

    Path(const sampling::PixelSampler& s, RayCounts& c, PathObserver* o)
        : sampler(s), counts(&c), observer(o) {}

    sampling::PixelSampler sampler;
    geometry::Ray ray;
    Rgb beta = Rgb(1.0f);
    int bounce = 0;  ///< scatterings so far; pass-throughs do not count
    uint32_t pass_count =
        0;  ///< pass-throughs since the last scattering; keeps their random numbers apart
    lights::EmissionReceiver emission_receiver =
        lights::EmissionReceiver::Camera;  ///< at the last vertex
    bool is_certain = true;  ///< no light sampling competed for the present direction: MIS weight 1
    bool is_sharp = true;    ///< no scattering so far but by delta lobes
    lights::Receiver receiver = {};  ///< where the present direction was sampled
    float scatter_pdf = 0;           ///< [1/sr]
    Vec3 straight_o =
        Vec3(0.0f);       ///< where the present straight line began; pass-throughs do not end it
    float traveled = 0;   ///< along that line up to the present segment
    float segment_t = 0;  ///< length of the present segment
    /// The lights that the whole of that line crosses, where somebody asked before and they are
    /// few.
    std::array<lights::LightHit, 4> line_hits;
    int line_hit_count = unknown_hits;
    Rgb diffuse_share =
        Rgb(0.0f);  ///< of f at the last scattering; only kept when lights have lobe multipliers
    float eta_scale = 1;  ///< undoes the η² of refractions for roulette
    /// What the path may expect to bring by its present direction, over what it could at its first
    /// guided vertex, as learned; 0 = not known.
    float importance = 0;
    float first_expected = 0;  ///< luminance
    float cone_width = 0, cone_spread = 0;
    float spread = 0;  ///< of the path's wavelength, see dispersion.h; 0 = it has none
    /// The only channel of light that passes the present vertex, and how much stronger: 1 over the
    /// probability that it was drawn. -1: light passes as it is.
    int channel_beyond = -1;
    float channel_scale = 1;
    SpecularHistory history;  ///< only kept when caustics are solved for
    Interior interior;        ///< of the present segment; only kept where something absorbs
    /// Only kept when light tracing finds some of the light, see CausticPaths: whether the first
    /// scattering was by a wide lobe and those since by surfaces of its kind; whether the last one
    /// was by a narrow lobe of a caster.
    bool is_caustic_receiver = false, is_from_caster = false;
    scene::RayKind kind = scene::RayKind::Camera;  ///< of the present ray; only kept where
                                                   ///< World::has_ray_visibility or mattes
    uint32_t branches = 1;                         ///< that it is yet to divide into
    float share = 1;                               ///< of the sample, for a branch
    float carried =
        1;  ///< of what it began with, at its last chance to end; not kept by the default roulette
    const media::Flight* flight =
        nullptr;  ///< through volumes on the present segment, while its lights are met
    RayCounts* counts;
    PathObserver* observer;
};

/// Whether the light that the path meets now is found by light tracing.
inline bool is_light_traced(const CausticPaths* paths, const Path& path, lights::LightId light) {
    return paths && path.is_caustic_receiver && path.is_from_caster && paths->takes_light(light);
}

/// Where a path scatters.
struct Vertex {
    const geometry::SurfacePoint& point;
    const shading::Bsdf& bsdf;
    Vec3 wo;
    DirectionMixture directions;
    const NestedDielectrics::Crossing* crossing =
        nullptr;           ///< of a boundary between solids with priorities
    bool is_exit = false;  ///< where light comes out that scattered below the surface

    /// What f does, of a light that counts by the multipliers.
    film::EventShares events(const shading::BsdfValue& value,
                             const lights::LobeMultipliers& multipliers = {}) const {
        return is_exit ? film::EventShares::only(film::PathEvent::Subsurface)
                       : events_of(value, multipliers);
    }
};

/// What scatters a path that is at no surface, wherever in it: of a volume, or of what fills a
/// solid.
struct Scatterer {
    const media::HenyeyGreenstein& phase;
    Rgb albedo;
    scene::ProvenanceId provenance;
    scene::LinkClass link;

    /// Every direction counts.
    lights::Receiver receiver_at(const Vec3& p, float time) const {
        lights::Receiver receiver{p};
        receiver.link = link;
        receiver.time = time;
        return receiver;
    }

    /// Where light scatters, for what asks for surfaces: rays leave from p itself, and no solid is
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

/// Light goes through the vertex from wo to wi, or stays on its side.
inline void cross(const World& world,
                  const NestedDielectrics::Crossing* crossing,
                  const geometry::SurfacePoint& point,
                  const Vec3& wo,
                  const Vec3& wi,
                  Interior& interior) {
    if (!crossing)
        interior.cross(world.materials, point, wo, wi);
    else if ((point.ng.dot(wo) > 0.0f) != (point.ng.dot(wi) > 0.0f))
        interior = crossing->beyond;
}

/// Goes on behind the surface in the same direction, which is no scattering.
inline void continue_straight(Path& path, const geometry::SurfacePoint& point) {
    // The rest of the segment keeps its end: the camera's far plane also counts behind a cut-out
    const float rest = path.ray.t_max - path.segment_t;
    path.ray = geometry::spawn_ray(point, path.ray.d);
    path.ray.t_max = rest;
    path.traveled += path.segment_t;
    ++path.pass_count;
}

}  // namespace velatura::integrator
