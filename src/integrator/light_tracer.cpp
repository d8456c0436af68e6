// SPDX-License-Identifier: Apache-2.0
#include "integrator/light_tracer.h"

#include "base/check.h"
#include "base/hash.h"
#include "integrator/pass_through.h"
#include "integrator/path_events.h"
#include "integrator/specular_chain.h"
#include "sampling/mis.h"
#include "scene/effect_calls.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace velatura::integrator {

using sampling::Purpose;

namespace {

/// Keeps the random numbers of photons apart from those of camera paths.
constexpr uint64_t photon_seed_salt = 0x70686f746f6e7321ull;

/// Scatterings before roulette begins.
constexpr int roulette_start = 2;

/// A shading normal that turns light by more than this factor is not worth its noise: the photon
/// ends, as it would where the surface is black. Far above what interpolated normals do.
constexpr float max_correction = 1e4f;

/// Numbers of one photon. Those of all photons of even passes are points of one sequence, those of
/// odd ones of another.
sampling::PixelSampler sampler_of(const PathTracerOptions& options,
                                  uint64_t photons_per_pass,
                                  uint64_t pass,
                                  uint64_t photon) {
    const uint64_t index = (pass >> 1) * photons_per_pass + photon;
    const auto kind = options.sampler == sampling::SamplerKind::Independent
                          ? sampling::SamplerKind::Independent
                          : sampling::SamplerKind::Sobol;
    return {hash_combine(options.seed, photon_seed_salt), int(pass & 1), int(index >> 32),
            index & 0xffffffffu, kind};
}

float below_one(double u) {
    return std::min(float(u), 0x1.fffffep-1f);
}

}  // namespace

/// A light path on its way.
struct LightTracer::Photon {
    Photon(const sampling::PixelSampler& sampler, RayCounts& counts)
        : path(sampler, counts, nullptr) {}

    /// beta: flux; bounce: scatterings so far.
    Path path;
    scene::GroupId group = 0;
    float begun_with = 0;  ///< largest channel of the flux after the first scattering
    Rgb arriving = Rgb(0.0f);
    /// Radiance that a camera path brings here from the light, times what it weighs there: f cos
    /// over the density of each scattering. The first one competes with light sampling.
    Rgb path_radiance = Rgb(0.0f);
    float light_pdf = 0;
    Beginning beginning;
    const film::Window* window = nullptr;
    float reach = 0;
    Splats* out = nullptr;
    std::vector<CausticArrival>* arrivals = nullptr;  ///< in place of splats
    bool is_caustic = true;                           ///< by narrow lobes alone so far
    std::vector<film::EventShares> events;            ///< of the scatterings so far, light first
};

LightTracer::LightTracer(const World& world,
                         const film::LayerSet& layers,
                         const PathTracerOptions& options,
                         const LightEmission& emission)
    : context_(world, layers, options),
      world_(world),
      direct_(context_),
      has_path_layers_(!layers.path_layers.empty()),
      warp_(emission.warp) {
    VELATURA_CHECK(options.caustic_paths != nullptr, "light tracing finds paths of a class");
    const scene::RenderSettings& s = world.scene.settings;
    photons_per_pass_ = std::max<uint64_t>(
        1, uint64_t(std::ceil(emission.photons_per_pixel * double(s.width) * double(s.height))));
}

void LightTracer::trace(uint64_t pass,
                        uint64_t first,
                        uint64_t end,
                        const film::Window& window,
                        float reach,
                        Splats& out,
                        RayCounts& counts) const {
    for (uint64_t i = first; i < end; ++i) trace(pass, i, window, reach, out, counts);
}

LightTracer::Beginning LightTracer::trace(uint64_t pass,
                                          uint64_t i,
                                          const film::Window& window,
                                          float reach,
                                          Splats& out,
                                          RayCounts& counts) const {
    Photon photon(sampler_of(context_.options, photons_per_pass_, pass, i), counts);
    photon.window = &window;
    photon.reach = reach;
    photon.out = &out;
    scene::count_call(scene::Effect::CausticSearch);
    sample_beginning(photon);
    if (begin(photon)) follow(photon);
    return photon.beginning;
}

void LightTracer::record(uint64_t first,
                         uint64_t end,
                         std::vector<CausticArrival>& out,
                         RayCounts& counts) const {
    for (uint64_t i = first; i < end; ++i) {
        Photon photon(sampler_of(context_.options, photons_per_pass_, 0, i), counts);
        photon.arrivals = &out;
        sample_beginning(photon);
        if (begin(photon) && photon.light_pdf > 0.0f) follow(photon);
    }
}

void LightTracer::sample_beginning(Photon& photon) const {
    const sampling::PixelSampler& sampler = photon.path.sampler;
    const Vec2 point = sampler.get_2d(0, Purpose::ManifoldPoint),
               direction = sampler.get_2d(0, Purpose::ManifoldSeed);
    photon.beginning.u = {sampler.get_1d(0, Purpose::ManifoldCaster),
                          sampler.get_1d(0, Purpose::ManifoldTriangle),
                          point.x,
                          point.y,
                          direction.x,
                          direction.y,
                          direct_.light_number(photon.path),
                          sampler.get_1d(0, Purpose::BsdfLobe)};
    photon.beginning.density = warp_.warp(photon.beginning.u);
}

std::optional<CasterPoint> LightTracer::sample_caster(Photon& photon) const {
    const float time =
        world_.has_motion
            ? world_.camera.shutter_time(photon.path.sampler.get_1d(0, Purpose::ShutterTime))
            : 0.0f;
    const CasterPoints& points = context_.options.caustic_paths->casters();
    const auto u = [&](size_t i) { return below_one(photon.beginning.u[i]); };
    const sampling::Distribution1D::Sample chosen = points.shapes().choice().sample(u(0));
    if (!(chosen.pmf > 0.0)) return std::nullopt;
    std::optional<CasterPoint> out =
        points.sample(uint32_t(chosen.index), {u(1), {u(2), u(3)}, {u(4), u(5)}}, time);
    if (out) out->pdf *= chosen.pmf * photon.beginning.density;
    return out;
}

/// Samples a point of a caster and light there, and scatters it. False: the photon brings nothing.
bool LightTracer::begin(Photon& photon) const {
    Path& path = photon.path;
    const std::optional<CasterPoint> start = sample_caster(photon);
    if (!start) return false;
    const geometry::SurfacePoint& point = start->point;
    path.cone_width = world_.camera.footprint(point.p);
    const float presence = world_.materials.presence(point, path.cone_width);
    if (!(presence > 0.0f)) return false;

    lights::Receiver receiver{point.p};
    receiver.time = point.time;
    if (world_.has_light_links)
        receiver.link = scene::link_class(world_.scene, point.instance, point.shape);
    DirectLight::ChosenLight chosen;
    if (!direct_.choose(path, receiver, photon.beginning.u[6], chosen) ||
        !context_.options.caustic_paths->takes_light(chosen.choice.light))
        return false;
    const auto& [choice, light, links] = chosen;

    if (keeps_interior(world_))
        path.interior =
            world_.interior_at(geometry::offset_ray_origin(point, light.wi), point.time);
    const Interior outside = path.interior;
    photon.group = world_.lights.group(choice.light);
    photon.path.beta = light.Le * float(double(presence) * double(world_.camera.exposure_scale()) /
                                        (double(choice.pmf) * double(light.pdf) * start->pdf));
    photon.path_radiance = light.Le;
    photon.light_pdf = light.is_delta ? 0.0f : choice.pmf * light.pdf;
    // What arrives is counted per area across the light; see scatter()
    photon.arriving = photon.path.beta * std::abs(point.ng.dot(light.wi));
    if (!scatter(photon, point, nullptr, light.wi, true)) return false;

    // Light leaves from where a camera path would
    const std::optional<geometry::SurfacePoint> moved =
        leaving_point(world_, point, path.ray.d, path.counts->shadow);
    const Rgb visible = direct_.visibility(path, moved ? *moved : point, outside, light, nullptr);
    path.beta *= visible;
    if (is_black(path.beta)) return false;
    photon.begun_with = max_component(path.beta);
    return true;
}

void LightTracer::follow(Photon& photon) const {
    Path& path = photon.path;
    std::optional<NestedDielectrics::Crossing> storage;
    while (true) {
        const geometry::Hit hit = world_.accelerator->intersect(path.ray);
        ++path.counts->caustic;
        if (!hit.is_valid()) return;
        if (keeps_interior(world_))
            path.beta *= path.interior.transmittance(world_.materials, hit.t);
        const geometry::SurfacePoint met =
            geometry::make_surface_point(world_.scene, world_.geometry, path.ray, hit);
        path.segment_t = hit.t;
        path.cone_width = world_.camera.footprint(met.p);
        const NestedDielectrics::Crossing* crossing = nullptr;
        if ((world_.materials.has_presence() && pass_cutout(context_, path, met)) ||
            (world_.nested && !intersect_dielectrics(context_, path, met, storage, crossing))) {
            if (path.pass_count < pass_through_limit) continue;
            return;
        }
        const geometry::SurfacePoint& point = crossing ? crossing->point : met;
        const Vec3 wi = -path.ray.d;
        photon.arriving = path.beta;
        if (photon.arrivals)
            arrive(photon, point, crossing, wi);
        else
            connect(photon, point, crossing, wi);
        if (path.bounce + 1 >= context_.depth_limit) return;
        if (!scatter(photon, point, crossing, wi, false)) return;
        if (photon.arrivals && !photon.is_caustic) return;
        if (path.pass_count >= pass_through_limit) return;
    }
}

void LightTracer::arrive(Photon& photon,
                         const geometry::SurfacePoint& point,
                         const NestedDielectrics::Crossing* crossing,
                         const Vec3& wi) const {
    const shading::Bsdf bsdf = world_.materials.make_bsdf(
        point, wi, photon.path.cone_width, crossing ? crossing->surrounding_index : 1.0f);
    if (bsdf.is_hair() || !bsdf.has_non_delta()) return;
    // Camera paths have the exposure already
    const float exposure = world_.camera.exposure_scale();
    photon.arrivals->push_back(
        {point.p, bsdf.ns(), wi, photon.arriving / exposure, photon.path_radiance});
}

/// Adds what the point scatters toward the camera by its wide lobes.
void LightTracer::connect(Photon& photon,
                          const geometry::SurfacePoint& point,
                          const NestedDielectrics::Crossing* crossing,
                          const Vec3& wi) const {
    Path& path = photon.path;
    if (path.bounce + 1 > context_.depth_limit) return;
    const bool uses_lens = world_.uses_lens && !context_.options.disable_lens;
    const Vec2 u_lens =
        uses_lens ? path.sampler.get_2d(path.bounce, Purpose::Lens, path.pass_count) : Vec2(0.5f);
    const std::optional<camera::CameraConnection> to_camera =
        world_.camera.connect(point.p, u_lens, point.time);
    if (!to_camera) return;
    const Vec2& at = to_camera->film_point;
    const film::Window& w = *photon.window;
    if (!(at.x > float(w.x0) - photon.reach && at.x < float(w.x1) + photon.reach &&
          at.y > float(w.y0) - photon.reach && at.y < float(w.y1) + photon.reach))
        return;
    const Vec3& wo = to_camera->wi;
    const shading::Bsdf bsdf = world_.materials.make_bsdf(
        point, wo, to_camera->cone_width, crossing ? crossing->surrounding_index : 1.0f);
    if (bsdf.is_hair()) return;
    const shading::BsdfValue value = bsdf.wide_part(bsdf.evaluate(wo, wi));
    const float across = std::abs(point.ng.dot(wi));
    if (is_black(value.f()) || !(across * max_correction > bsdf.cosine(wi))) return;
    Rgb radiance =
        photon.arriving * value.f() *
        (bsdf.cosine(wi) / across * std::abs(point.ng.dot(wo)) * to_camera->film_per_area);
    if (is_black(radiance)) return;

    // What lies between is passed as the rays of the camera pass it
    Interior interior = path.interior;
    if (keeps_interior(world_)) cross(world_, crossing, point, wi, wo, interior);
    lights::LightSample target;
    target.wi = wo;
    target.distance = to_camera->distance;
    radiance *= direct_.visibility(path, point, interior, target, nullptr);
    if (is_black(radiance)) return;
    if (has_path_layers_) photon.events.push_back(events_of(value));
    const Rgb path_value =
        photon.path_radiance * value.f() * (bsdf.cosine(wi) / std::max(value.pdf, 1e-12f));
    splat(photon, at, radiance, luminance(path_value));
    if (has_path_layers_) photon.events.pop_back();
}

void LightTracer::splat(Photon& photon,
                        const Vec2& film_point,
                        const Rgb& radiance,
                        float path_value) const {
    Splats& out = *photon.out;
    Splat s;
    s.film_point = film_point;
    s.radiance = radiance;
    s.path_value = path_value * world_.camera.exposure_scale();
    s.group = uint16_t(photon.group);
    s.bounce = uint16_t(photon.path.bounce + 1);
    s.events = uint32_t(out.events.size());
    out.splats.push_back(s);
    if (has_path_layers_)
        out.events.insert(out.events.end(), photon.events.rbegin(), photon.events.rend());
}

/// Goes on from the point, where photon.arriving came from wi. is_first: by a narrow lobe. False:
/// the photon ends.
bool LightTracer::scatter(Photon& photon,
                          const geometry::SurfacePoint& point,
                          const NestedDielectrics::Crossing* crossing,
                          const Vec3& wi,
                          bool is_first) const {
    Path& path = photon.path;
    const float surrounding_index = crossing ? crossing->surrounding_index : 1.0f;
    const shading::Bsdf from_light =
        world_.materials.make_bsdf(point, wi, path.cone_width, surrounding_index);
    const std::optional<shading::BsdfSample> sample = from_light.sample_f(
        wi,
        is_first ? below_one(photon.beginning.u[7])
                 : path.sampler.get_1d(path.bounce, Purpose::BsdfLobe, path.pass_count),
        path.sampler.get_2d(path.bounce, Purpose::BsdfDirection, path.pass_count));
    if (!sample || !(sample->pdf > 0.0f) || from_light.is_hair()) return false;
    const Vec3& wo = sample->wi;
    const bool is_straight =
        sample->is_delta && sample->kind == shading::ScatterKind::Transmit && sample->eta == 1.0f;
    const float across_wi = std::abs(point.ng.dot(wi)), across_wo = std::abs(point.ng.dot(wo));

    // Flux that goes on. What a camera path weighs by the cosines of shading normals, light does
    // not: Veach 1997, section 5.3. Of delta lobes without the factor η² of radiance.
    Rgb weight;
    film::EventShares events;
    if (sample->is_delta) {
        weight = sample->f * (from_light.cosine(wo) / sample->pdf * sample->eta * sample->eta);
        photon.path_radiance *= weight;
        if (is_straight) {
            if (is_first) return false;
            path.beta = photon.arriving * weight;
            if (is_black(path.beta)) return false;
            if (keeps_interior(world_)) cross(world_, crossing, point, wi, wo, path.interior);
            continue_straight(path, point);
            return true;
        }
        const float ns_wi = from_light.cosine(wi), ns_wo = from_light.cosine(wo);
        if (!(across_wi * ns_wo * max_correction > ns_wi * across_wo)) return false;
        weight *= ns_wi * across_wo / (across_wi * ns_wo);
        events = events_of(*sample);
    } else {
        const shading::Bsdf from_camera =
            world_.materials.make_bsdf(point, wo, path.cone_width, surrounding_index);
        shading::BsdfValue value = from_camera.evaluate(wo, wi);
        if (is_first) value = from_camera.narrow_part(value);
        if (!(across_wi * max_correction > from_camera.cosine(wi))) return false;
        weight = value.f() * (from_camera.cosine(wi) / across_wi * across_wo / sample->pdf);
        const float path_pdf =
            sampling::power_heuristic_density(value.pdf, is_first ? photon.light_pdf : 0.0f);
        photon.path_radiance *= value.f() * (from_camera.cosine(wi) / std::max(path_pdf, 1e-12f));
        const Rgb narrow = from_camera.narrow_part(value).f();
        photon.is_caustic =
            photon.is_caustic && (is_first || 2.0f * luminance(narrow) >= luminance(value.f()));
        events = events_of(value);
    }
    path.beta = photon.arriving * weight;
    if (is_black(path.beta)) return false;
    if (keeps_interior(world_)) cross(world_, crossing, point, wi, wo, path.interior);
    if (has_path_layers_) photon.events.push_back(events);
    ++path.bounce;
    path.pass_count = 0;
    path.ray = geometry::spawn_ray(point, wo);
    path.traveled = 0;

    // Roulette by what is left of the flux
    if (path.bounce > roulette_start) {
        const float survival = max_component(path.beta) / photon.begun_with;
        if (survival < 1.0f) {
            if (path.sampler.get_1d(path.bounce, Purpose::Roulette) >= survival) return false;
            path.beta /= survival;
        }
    }
    return true;
}

}  // namespace velatura::integrator
