// SPDX-License-Identifier: Apache-2.0
// The estimator from the camera ray to the end of the path. What its steps do stands in the headers
// below.
#include "integrator/path_tracer.h"

#include "integrator/caustic_light.h"
#include "integrator/first_hit.h"
#include "integrator/mirrored_lamp.h"
#include "integrator/pass_through.h"
#include "integrator/roulette.h"
#include "integrator/seen_through.h"
#include "integrator/specular_chain.h"
#include "integrator/subsurface_exit.h"
#include "integrator/wavelength.h"
#include "scene/effect_calls.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace velatura::integrator {

using sampling::Purpose;
using scene::count_call;
using scene::Effect;

PathTracer::PathTracer(const World& world,
                       const film::LayerSet& layers,
                       const PathTracerOptions& options)
    : context_(world, layers, options),
      world_(world),
      hits_(context_),
      direct_(context_),
      attribution_(context_, hits_),
      volume_(context_, hits_, direct_, attribution_) {
    if (!world.plate || !layers.has_catcher_data()) return;
    film::LayerSet groups;
    groups.groups = layers.groups;
    groups.bounce_layers = groups.data_layers = false;
    // What was learned of the scene is not true of its plate
    PathTracerOptions of_plate = options;
    of_plate.guide = nullptr;
    of_plate.branches = nullptr;
    of_plate.roulette = nullptr;
    of_plate.mattes = nullptr;
    of_plate.caustic_paths = nullptr;
    of_plate.caustics = nullptr;
    of_plate.deep = false;
    of_plate.is_plate = true;
    plate_ = std::make_unique<const PathTracer>(*world.plate, groups, of_plate);
}

void PathTracer::trace(int x,
                       int y,
                       uint64_t sample,
                       film::SampleRadiance& out,
                       RayCounts& counts,
                       PathObserver* observer) const {
    Path path(sampling::PixelSampler(context_.options.seed, x, y, sample, context_.options.sampler),
              counts, observer);
    if (context_.options.branches) path.branches = context_.options.branches->at(x, y);

    // Start at the camera, inside the pixel's filter
    const float u_part =
        context_.filter.has_negative_lobes() ? path.sampler.get_1d(0, Purpose::FilterSign) : 0.0f;
    const sampling::FilterSample filtered =
        context_.filter.sample(path.sampler.get_2d(0, Purpose::PixelFilter), u_part);
    out.weight = filtered.weight;
    const Vec2 film_point(float(x) + 0.5f + filtered.offset.x, float(y) + 0.5f + filtered.offset.y);
    const bool uses_lens = world_.uses_lens && !context_.options.disable_lens;
    if (uses_lens) count_call(Effect::DepthOfField);
    const Vec2 u_lens = uses_lens ? path.sampler.get_2d(0, Purpose::Lens) : Vec2(0.5f);
    const float time =
        world_.has_motion ? world_.camera.shutter_time(path.sampler.get_1d(0, Purpose::ShutterTime))
                          : 0.0f;
    if (world_.camera.has_motion()) count_call(Effect::CameraBlur);
    const camera::CameraRay first = world_.camera.generate_ray(film_point, u_lens, time);
    path.ray = {first.o, first.d, first.t_max, time};
    if (observer) observer->on_camera(path.ray);
    path.cone_width = first.cone_width;
    path.cone_spread = first.cone_spread;
    path.receiver.p = path.straight_o = first.o;
    path.beta = Rgb(world_.camera.exposure_scale());
    if (keeps_interior(world_))
        path.interior =
            world_.interior_changes ? world_.interior_at(first.o, time) : world_.camera_interior;
    ++counts.paths;
    ++counts.camera;
    follow(path, out);
    if (out.meets_catcher()) context_.data.record_catcher(out);
    if (context_.data.has_background() && !out.has_hit)
        context_.data.record_background(first.d, out);
}

void PathTracer::follow(Path& path, film::SampleRadiance& out) const {
    const bool has_insides = world_.nested || world_.subsurface || world_.interior_media ||
                             world_.tells_rays_apart || world_.materials.has_dispersion() ||
                             context_.options.is_plate;
    if (has_insides)
        follow_through<true>(path, out);
    else
        follow_through<false>(path, out);
}

/// has_insides: solids displace each other, have a medium in them or no surface, are dispersive,
/// light scatters below surfaces, something is invisible to rays of a kind, a matte or a catcher,
/// or all of it is a plate.
template <bool has_insides>
void PathTracer::follow_through(Path& path, film::SampleRadiance& sample) const {
    RayCounts& counts = *path.counts;
    PathObserver* const observer = path.observer;
    const bool has_absorption = keeps_interior(world_);
    std::optional<NestedDielectrics::Crossing> storage;
    const char* end = "escaped";
    film::SampleRadiance* target = &sample;  // of a catcher another one
    bool is_of_catcher = false;
    while (true) {
        film::SampleRadiance& out = *target;
        const geometry::Hit hit = has_insides ? world_.intersect(path.ray, path.kind)
                                              : world_.accelerator->intersect(path.ray);

        // Add the lights that the segment crosses; beyond the last surface also those at infinity
        const float t_max = hit.is_valid() ? hit.t : std::numeric_limits<float>::infinity();
        const InteriorMedia::Medium* const medium =
            has_insides && world_.interior_media
                ? world_.interior_media->find(path.interior.filling())
                : nullptr;
        if (world_.volumes || medium) {
            const VolumeSegment::End segment = volume_.cross(path, medium, t_max, end, out);
            if (segment == VolumeSegment::End::Scattered) continue;
            if (segment == VolumeSegment::End::Ended) break;
        } else {
            hits_.add(path, t_max, out);
        }
        if (!hit.is_valid()) break;
        if (has_absorption && !medium)
            path.beta *= path.interior.transmittance(world_.materials, hit.t);

        const geometry::SurfacePoint point =
            geometry::make_surface_point(world_.scene, world_.geometry, path.ray, hit);
        path.cone_width += path.cone_spread * hit.t;
        path.segment_t = hit.t;
        if (observer) observer->on_hit(path.bounce, point, hit.t, path.beta);
        const NestedDielectrics::Crossing* crossing = nullptr;
        if ((world_.materials.has_presence() && pass_cutout(context_, path, point)) ||
            (has_insides && !intersect_dielectrics(context_, path, point, storage, crossing))) {
            if (path.pass_count < pass_through_limit) continue;
            end = "passed through too many surfaces";
            break;
        }
        if (has_insides && is_matte(path, point)) {
            end = "hit a matte object";
            break;
        }
        if (has_insides && !is_of_catcher && is_catcher(path, point)) {
            if (!context_.options.is_plate && !plate_) {
                end = "hit a catcher";
                break;
            }
            is_of_catcher = true;
            target = &begin_catcher(path, sample);
        }

        film::SampleRadiance& light = *target;
        const Vec3 wo = -path.ray.d;
        const std::optional<geometry::SurfacePoint> moved =
            leaving_point(world_, point, wo, counts.shadow);
        const geometry::SurfacePoint& start = moved ? *moved : crossing ? crossing->point : point;
        if (has_insides && path.bounce < context_.depth_limit)
            choose_wavelength(world_, path, start.material);
        shading::Bsdf bsdf = world_.materials.make_bsdf(
            start, wo, path.cone_width, crossing ? crossing->surrounding_index : 1.0f,
            has_insides ? path.spread : 0.0f);
        if (mirrors_lamp(context_, path, start, bsdf)) bsdf.raise_mirror(mirrored_lamp_probability);
        if (has_insides && !bsdf.has_index_of_passage_alone()) keep_channel(path);
        const bool is_first_hit = path.bounce == 0 && !light.has_hit;
        if (is_first_hit) record_first_hit(context_, point, bsdf, light);

        hits_.add_emission(path, point, wo, light);

        const Vertex met{start, bsdf, wo,
                         DirectionMixture(bsdf, wo, start.p, context_.options.guide), crossing};
        if (is_first_hit && context_.options.mattes && context_.options.matte_through.any())
            light.matte_ids = matte_ids_seen_through(context_, path, point, met);
        if (context_.credits_casters(path.bounce)) attribution_.credit_surface(path, met, light);
        if (path.bounce >= context_.depth_limit) {
            // What passes straight is not scattered
            if (pass_straight(context_, path, met)) continue;
            if (context_.depth_limit == hard_depth_limit) ++counts.depth_limited;
            end = "reached the depth limit";
            break;
        }
        std::optional<SubsurfaceExit> emerged;
        if (has_insides && world_.materials.has_subsurface(point.material) &&
            !scatter_below(context_, path, met, emerged)) {
            end = "absorbed in the subsurface";
            break;
        }
        const Vertex& vertex = has_insides && emerged ? emerged->vertex : met;
        direct_.add(path, vertex, light);
        if (context_.options.caustics) add_caustics(context_, path, vertex, light);
        if (path.branches > 1 && vertex.bsdf.has_non_delta()) {
            split_path(path, vertex, light);
            return;
        }
        if (const char* const why = continue_path(path, vertex, light)) {
            end = why;
            break;
        }
    }
    if (observer) observer->on_end(path.bounce, end);
}

/// Whether the camera sees a matte object there: neither light nor alpha is of it.
bool PathTracer::is_matte(const Path& path, const geometry::SurfacePoint& point) const {
    if (!world_.mattes || path.kind != scene::RayKind::Camera) return false;
    if (!world_.mattes->holds(scene::link_class(world_.scene, point.instance, point.shape)))
        return false;
    count_call(Effect::Mattes);
    return true;
}

/// Whether the camera sees a catcher there, which begins the light of a sample of its own.
bool PathTracer::is_catcher(const Path& path, const geometry::SurfacePoint& point) const {
    if (context_.options.is_plate) return path.bounce == 0;
    if (!world_.catchers || path.kind != scene::RayKind::Camera) return false;
    if (!world_.catchers->holds(scene::link_class(world_.scene, point.instance, point.shape)))
        return false;
    count_call(Effect::Catchers);
    return true;
}

/// Returns: where the light goes from here on.
film::SampleRadiance& PathTracer::begin_catcher(const Path& path, film::SampleRadiance& out) const {
    if (context_.options.is_plate) {
        // What lies before the surface is seen by the camera, plate or not
        out.clear();
        out.has_hit = true;
        return out;
    }
    out.begin_catcher();
    plate_->trace_plate(path, out.plate());
    return out.catcher();
}

/// The light of the plate where the camera's path meets a catcher, with the random numbers and the
/// weight of that path. path: of the whole scene, at its first surface.
void PathTracer::trace_plate(const Path& path, film::SampleRadiance& out) const {
    Path camera(path.sampler, *path.counts, nullptr);
    const float before = path.traveled + path.segment_t;
    camera.ray = {path.straight_o, path.ray.d, path.traveled + path.ray.t_max, path.ray.time};
    camera.beta = path.beta;
    camera.cone_spread = path.cone_spread;
    camera.cone_width = path.cone_width - path.cone_spread * before;
    camera.receiver.p = camera.straight_o = path.straight_o;
    follow(camera, out);
    if (!out.has_hit) out.clear();
}

/// What came by the path so far is shared by all branches; each goes on with its share and with
/// random numbers of its own.
void PathTracer::split_path(const Path& prefix,
                            const Vertex& vertex,
                            film::SampleRadiance& out) const {
    count_call(Effect::Splitting);
    out.begin_branches();
    if (prefix.observer) prefix.observer->on_split();
    const uint64_t rays_before = prefix.counts->total();
    film::PathLabels* const labels = out.labels();
    const film::PathLabels::PathPrefix trunk_labels =
        labels ? labels->prefix() : film::PathLabels::PathPrefix();
    for (uint32_t i = 0; i < prefix.branches; ++i) {
        Path branch = prefix;
        branch.branches = 1;
        branch.share = 1.0f / float(prefix.branches);
        branch.beta *= branch.share;
        branch.sampler = prefix.sampler.branch(i, prefix.branches);
        if (labels) labels->restore(trunk_labels);
        if (const char* const why = continue_path(branch, vertex, out)) {
            if (branch.observer) branch.observer->on_end(branch.bounce, why);
        } else {
            follow(branch, out);
        }
    }
    prefix.counts->in_branches += prefix.counts->total() - rays_before;
}

/// Chooses where the path goes from the vertex. Returns: why it ends instead, or null.
const char* PathTracer::continue_path(Path& path,
                                      const Vertex& vertex,
                                      film::SampleRadiance& out) const {
    if (!scatter(path, vertex, out)) return "absorbed";
    if (path.pass_count == 0 && !survives_roulette(context_, path)) return "ended by roulette";
    if (path.pass_count >= pass_through_limit) return "passed through too many surfaces";
    ++path.counts->indirect;
    return nullptr;
}

/// Keeps whether light tracing finds what the path meets from here on. Of a scattering with wide
/// and narrow lobes one kind is drawn, by what it brings; `value` becomes that kind's.
void PathTracer::note_caustic_class(Path& path,
                                    const Vertex& vertex,
                                    const shading::BsdfSample& sample,
                                    shading::BsdfValue& value) const {
    const bool is_first = path.bounce == 0;
    path.is_from_caster = false;
    if (!is_first && !path.is_caustic_receiver) return;
    if (vertex.is_exit || vertex.bsdf.is_hair()) {
        path.is_caustic_receiver = false;
        return;
    }
    bool is_narrow = sample.is_delta;
    if (!sample.is_delta) {
        const shading::BsdfValue narrow = vertex.bsdf.narrow_part(value);
        const float all = luminance(value.f()), part = luminance(narrow.f());
        if (part > 0.0f && all > 0.0f) {
            const float share = std::min(part / all, 1.0f);
            is_narrow =
                path.sampler.get_1d(path.bounce, Purpose::LobeWidth, path.pass_count) < share;
            const shading::BsdfValue kept = is_narrow ? narrow : vertex.bsdf.wide_part(value);
            const Rgb kept_f = kept.f(), f = value.f();
            const float chance = is_narrow ? share : 1.0f - share;
            for (int c = 0; c < 3; ++c)
                path.beta[c] *= f[c] > 0.0f ? kept_f[c] / (f[c] * chance) : 0.0f;
            value = kept;
        }
    }
    if (is_first)
        path.is_caustic_receiver = !is_narrow;
    else
        path.is_from_caster = is_narrow && context_.options.caustic_paths->casts(vertex.point);
}

/// Keeps of what kind the ray of a sample is. Where diffuse and specular rays meet different
/// geometry, one of the two lobes is drawn, by what it brings, and `value` becomes that lobe's.
/// Returns: whether it was drawn.
bool PathTracer::note_ray_kind(Path& path,
                               const Vertex& vertex,
                               const shading::BsdfSample& sample,
                               shading::BsdfValue& value) const {
    using scene::RayKind;
    const bool transmits = sample.kind == shading::ScatterKind::Transmit;
    const RayKind diffuse = transmits ? RayKind::DiffuseTransmission : RayKind::Diffuse;
    path.kind = transmits ? RayKind::Refraction : RayKind::Reflection;
    if (sample.is_delta || world_.visible_to(path.kind) == world_.visible_to(diffuse)) return false;
    if (is_black(value.f())) value = vertex.bsdf.evaluate(vertex.wo, sample.wi);
    const Rgb f = value.f();
    const float all = luminance(f), part = luminance(value.diffuse);
    const float share = all > 0.0f ? std::min(part / all, 1.0f) : 0.0f;
    // Light tracing, which has the other use of this number, does not run then
    const bool is_diffuse =
        path.sampler.get_1d(path.bounce, Purpose::LobeWidth, path.pass_count) < share;
    if (is_diffuse) path.kind = diffuse;
    (is_diffuse ? value.specular : value.diffuse) = Rgb(0.0f);
    const Rgb kept = value.f();
    const float chance = is_diffuse ? share : 1.0f - share;
    for (int c = 0; c < 3; ++c) path.beta[c] *= f[c] > 0.0f ? kept[c] / (f[c] * chance) : 0.0f;
    return true;
}

bool PathTracer::scatter(Path& path, const Vertex& vertex, film::SampleRadiance& out) const {
    const auto& [point, bsdf, wo, directions, crossing, is_exit] = vertex;
    if (path.observer && bsdf.has_non_delta()) {
        path.observer->on_vertex({point.p, bsdf.ns()}, path.beta);
        if (context_.options.caustic_paths && path.bounce > 0 && !path.is_caustic_receiver &&
            !bsdf.is_hair())
            path.observer->on_hidden_receiver(point, wo, path.beta);
    }
    const std::optional<ScatterSample> scattered =
        directions.sample(path.sampler, path.bounce, path.pass_count);
    if (!scattered) return false;
    const shading::BsdfSample* sample = &scattered->bsdf;
    if (context_.options.estimator.specular_chains_only && !sample->is_delta) return false;
    const Rgb beta = path.beta;
    path.beta *= sample->f * (bsdf.cosine(sample->wi) / sample->pdf);
    if (is_black(path.beta)) return false;
    path.eta_scale *= sample->eta * sample->eta;
    settle_channel(path, sample->kind);
    if (is_black(path.beta)) return false;

    if (keeps_interior(world_) && sample->kind == shading::ScatterKind::Transmit)
        cross(world_, crossing, point, wo, sample->wi, path.interior);

    // Going straight through a thin wall or an interface between equal media is no scattering
    // event. Light sampling looks through it as well, unless nobody knew that it is one: then what
    // lies behind has no rival sampler
    if (sample->is_delta && sample->kind == shading::ScatterKind::Transmit && sample->eta == 1.0f) {
        if (path.observer) path.observer->on_turn(path.bounce, {sample->wi, {}, 1.0f, true});
        continue_straight(path, point);
        if (!world_.materials.material_is_see_through(point.material)) path.is_certain = true;
        path.kind = scene::RayKind::Refraction;
        return true;
    }
    shading::BsdfValue value;
    const bool needs_value = context_.options.caustic_paths || out.labels();
    if (needs_value && !sample->is_delta) value = bsdf.evaluate(wo, sample->wi);
    if (context_.options.caustic_paths) note_caustic_class(path, vertex, *sample, value);
    bool is_lobe_drawn = false;
    if (world_.tells_rays_apart) {
        is_lobe_drawn = note_ray_kind(path, vertex, *sample, value);
        if (is_black(path.beta)) return false;
    }
    if (film::PathLabels* const labels = out.labels()) {
        // Each of two mirrors in one direction brings its own weight and no more
        labels->look(sample->is_delta ? events_of(*sample) : vertex.events(value));
        labels->go();
    }
    if (path.observer)
        path.observer->on_turn(
            path.bounce,
            {sample->wi,
             sample->is_delta ? events_of(*sample) : vertex.events(bsdf.evaluate(wo, sample->wi)),
             sample->pdf, sample->is_delta});
    path.ray = geometry::spawn_ray(point, sample->wi);
    path.straight_o = path.ray.o;
    path.traveled = 0;
    path.line_hit_count = Path::unknown_hits;
    path.is_certain = sample->is_delta;
    path.is_sharp = path.is_sharp && sample->is_delta;
    path.emission_receiver =
        sample->is_delta ? lights::EmissionReceiver::Camera : lights::EmissionReceiver::Scattering;
    path.receiver = receiver_at(world_, point, bsdf);
    path.scatter_pdf = sample->pdf;
    if (path.observer && !sample->is_delta) path.observer->on_scatter(sample->wi);
    if (context_.options.guide) {
        if (!(path.first_expected > 0.0f))
            path.first_expected = luminance(beta) * directions.expected();
        path.importance = scattered->expected > 0.0f
                              ? luminance(beta) * scattered->expected / path.first_expected
                              : 0.0f;
    }
    if (world_.has_lobe_multipliers) {
        path.diffuse_share = Rgb(0.0f);
        if (!sample->is_delta) {
            const Rgb diffuse =
                is_lobe_drawn ? value.diffuse : bsdf.evaluate(wo, sample->wi).diffuse;
            const Rgb f = is_lobe_drawn ? value.f() : sample->f;
            for (int c = 0; c < 3; ++c)
                path.diffuse_share[c] = f[c] > 0.0f ? std::min(1.0f, diffuse[c] / f[c]) : 0.0f;
        }
    }
    if (context_.options.caustics)
        path.history = context_.options.caustics->after(path.history, point, bsdf, sample->is_delta,
                                                        path.pass_count);
    const bool is_first = path.bounce == 0;
    ++path.bounce;
    path.pass_count = 0;
    if (is_first && context_.has_unoccluded) hits_.add_unoccluded(path, out);
    if (world_.has_custom_shadows) hits_.add_beyond(path, point, out);
    return true;
}

}  // namespace velatura::integrator
