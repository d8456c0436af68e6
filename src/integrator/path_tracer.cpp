// SPDX-License-Identifier: Apache-2.0
#include "integrator/path_tracer.h"

#include "integrator/direct_light.h"
#include "integrator/labelling.h"
#include "integrator/path.h"
#include "integrator/render_options.h"
#include "integrator/shadow_segment.h"
#include "sampling/mis.h"
#include "scene/effect_calls.h"

#include <algorithm>

namespace velatura::integrator {

using sampling::Purpose;
using scene::count_call;
using scene::Effect;

namespace {

/// A path that may bring half of what it set out with, or more, does not end by roulette.
constexpr float importance_scale = 2.0f;

}  // namespace

PathTracer::PathTracer(const World& world,
                       const film::LayerSet& layers,
                       const PathTracerOptions& options)
    : world_(world),
      options_(options),
      filter_(options.filter),
      has_unoccluded_(layers.wants_unoccluded()),
      has_caster_layers_(layers.shadow_layers && layers.caster_layers),
      has_data_layers_(layers.data_layers),
      has_emission_(world.lights.has_surface_emission()),
      depth_limit_(options.max_depth > 0 ? std::min(options.max_depth, hard_depth_limit)
                                         : hard_depth_limit) {}

void PathTracer::trace(int x,
                       int y,
                       uint64_t sample,
                       film::SampleRadiance& out,
                       RayCounts& counts,
                       PathObserver* observer) const {
    Path path(sampling::PixelSampler(options_.seed, x, y, sample, options_.sampler), counts,
              observer);
    if (options_.branches) path.branches = options_.branches->at(x, y);

    // Start at the camera, inside the pixel's filter
    const float u_part =
        filter_.has_negative_lobes() ? path.sampler.get_1d(0, Purpose::FilterSign) : 0.0f;
    const sampling::FilterSample filtered =
        filter_.sample(path.sampler.get_2d(0, Purpose::PixelFilter), u_part);
    out.weight = filtered.weight;
    const Vec2 film_point(float(x) + 0.5f + filtered.offset.x, float(y) + 0.5f + filtered.offset.y);
    const bool uses_lens = world_.uses_lens && !options_.disable_lens;
    if (uses_lens) count_call(Effect::DepthOfField);
    const Vec2 u_lens = uses_lens ? path.sampler.get_2d(0, Purpose::Lens) : Vec2(0.5f);
    const float time =
        world_.has_motion ? world_.camera.shutter_time(path.sampler.get_1d(0, Purpose::ShutterTime))
                          : 0.0f;
    if (world_.camera.has_motion()) count_call(Effect::CameraBlur);
    const camera::CameraRay first = world_.camera.generate_ray(film_point, u_lens, time);
    path.ray = {first.o, first.d, first.t_max, time};
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
}

void PathTracer::follow(Path& path, film::SampleRadiance& out) const {
    const bool has_insides = world_.nested || world_.subsurface || world_.body_media;
    if (has_insides)
        follow_through<true>(path, out);
    else
        follow_through<false>(path, out);
}

/// has_insides: bodies displace each other, have matter in them or no surface, or light scatters
/// below surfaces.
template <bool has_insides>
void PathTracer::follow_through(Path& path, film::SampleRadiance& out) const {
    RayCounts& counts = *path.counts;
    PathObserver* const observer = path.observer;
    const bool has_absorption = keeps_interior(world_);
    std::optional<NestedBodies::Crossing> room;
    const char* end = "escaped";
    while (true) {
        const geometry::Hit hit = world_.accelerator->intersect(path.ray);

        // Add the lights that the segment crosses; beyond the last surface also those at infinity
        const float t_max = hit.is_valid() ? hit.t : std::numeric_limits<float>::infinity();
        const BodyMedia::Medium* const medium =
            has_insides && world_.body_media ? world_.body_media->find(path.interior.filling())
                                             : nullptr;
        if (world_.volumes || medium) {
            const Crossing crossing = cross_matter(path, medium, t_max, end, out);
            if (crossing == Crossing::Scattered) continue;
            if (crossing == Crossing::Ended) break;
        } else {
            add_light_hits(path, t_max, out);
        }
        if (!hit.is_valid()) break;
        if (has_absorption && !medium)
            path.beta *= path.interior.transmittance(world_.materials, hit.t);

        const geometry::SurfacePoint point =
            geometry::make_surface_point(world_.scene, world_.geometry, path.ray, hit);
        path.cone_width += path.cone_spread * hit.t;
        path.segment_t = hit.t;
        if (observer) observer->on_hit(path.bounce, point, hit.t, path.beta);
        const NestedBodies::Crossing* crossing = nullptr;
        if ((world_.materials.has_presence() && pass_through(path, point)) ||
            (has_insides && !meet_bodies(path, point, room, crossing))) {
            if (path.pass_count < pass_through_limit) continue;
            end = "passed through too many surfaces";
            break;
        }

        const Vec3 wo = -path.ray.d;
        const std::optional<geometry::SurfacePoint> moved =
            leaving_point(world_, point, wo, counts.shadow);
        const geometry::SurfacePoint& start = moved ? *moved : crossing ? crossing->point : point;
        const shading::Bsdf bsdf = world_.materials.make_bsdf(
            start, wo, path.cone_width, crossing ? crossing->surrounding_index : 1.0f);
        if (path.bounce == 0 && !out.has_hit) record_first_hit(point, bsdf, out);

        // Add the surface's own emission
        if (has_emission_ && world_.lights.may_emit(point)) {
            const lights::SurfaceRadiance emitted =
                surface_emission(path, point, wo, path.cone_width);
            if (!is_found_beyond(path, emitted.links))
                deposit_met(path, emitted.group,
                            path.beta * emitted.Le * surface_hit_weight(path, point),
                            emitted.multipliers, "surface emission", out);
        }

        const Vertex met{start, bsdf, wo, DirectionMixture(bsdf, wo, start.p, options_.guide),
                         crossing};
        if (credits_casters(path.bounce)) credit_surface(path, met, out);
        if (path.bounce >= depth_limit_) {
            // What passes straight is not scattered
            if (pass_straight(path, met)) continue;
            if (depth_limit_ == hard_depth_limit) ++counts.depth_limited;
            end = "reached the depth limit";
            break;
        }
        std::optional<Emergence> emerged;
        if (has_insides && world_.materials.has_subsurface(point.material) &&
            !go_below(path, met, emerged)) {
            end = "absorbed below the surface";
            break;
        }
        const Vertex& vertex = has_insides && emerged ? emerged->vertex : met;
        add_direct_light(path, vertex, out);
        if (options_.caustics) add_caustics(path, vertex, out);
        if (path.branches > 1 && vertex.bsdf.has_non_delta()) {
            branch_out(path, vertex, out);
            return;
        }
        if (const char* const why = go_on(path, vertex, out)) {
            end = why;
            break;
        }
    }
    if (observer) observer->on_end(path.bounce, end);
}

/// What came by the path so far is shared by all branches; each goes on with its share and with
/// random numbers of its own.
void PathTracer::branch_out(const Path& trunk,
                            const Vertex& vertex,
                            film::SampleRadiance& out) const {
    count_call(Effect::Splitting);
    out.begin_branches();
    const uint64_t rays_before = trunk.counts->total();
    film::PathLabels* const labels = labels_of(out);
    const film::PathLabels::Trunk trunk_labels =
        labels ? labels->trunk() : film::PathLabels::Trunk();
    for (uint32_t i = 0; i < trunk.branches; ++i) {
        Path branch = trunk;
        branch.branches = 1;
        branch.share = 1.0f / float(trunk.branches);
        branch.beta *= branch.share;
        branch.sampler = trunk.sampler.branch(i, trunk.branches);
        if (labels) labels->go_back_to(trunk_labels);
        if (const char* const why = go_on(branch, vertex, out)) {
            if (branch.observer) branch.observer->on_end(branch.bounce, why);
        } else {
            follow(branch, out);
        }
    }
    trunk.counts->in_branches += trunk.counts->total() - rays_before;
}

/// Chooses where the path goes from the vertex. Returns: why it ends instead, or null.
const char* PathTracer::go_on(Path& path, const Vertex& vertex, film::SampleRadiance& out) const {
    if (!scatter(path, vertex, out)) return "absorbed";
    if (path.pass_count == 0 && !survives_roulette(path)) return "ended by roulette";
    if (path.pass_count >= pass_through_limit) return "passed through too many surfaces";
    ++path.counts->indirect;
    return nullptr;
}

void PathTracer::add_direct_light(Path& path,
                                  const Vertex& vertex,
                                  film::SampleRadiance& out) const {
    const auto& [point, bsdf, wo, directions, crossing, is_exit] = vertex;
    if (world_.selector->is_empty() || !bsdf.has_non_delta()) return;

    const lights::Receiver receiver = receiver_at(world_, point, bsdf);
    const LightSampling strategy = options_.estimator.light_sampling;
    if (looks_around(strategy)) add_light_around(path, vertex, receiver, out);
    ChosenLight chosen;
    if (!choose_light(path, receiver, chosen)) return;
    if (is_left_to_directions(strategy) && !chosen.light.is_delta) return;
    deposit_sampled(path, vertex, chosen, out);
}

void PathTracer::add_caustics(Path& path, const Vertex& vertex, film::SampleRadiance& out) const {
    count_call(Effect::CausticSearch);
    const CausticSampler::Receiver receiver{
        vertex.point, vertex.bsdf, vertex.wo, {path.cone_width, path.cone_spread}, path.interior};
    const auto found = options_.caustics->sample(receiver, path.sampler, path.bounce,
                                                 path.pass_count, *path.counts);
    if (!found) return;
    const int bounce = path.bounce + 1 + found->events.count;
    if (bounce > depth_limit_) return;
    film::PathLabels* const labels = labels_of(out);
    if (labels) {
        labels->look(vertex.events(vertex.bsdf.evaluate(vertex.wo, found->wi)));
        for (size_t i = 0; i < size_t(found->events.count); ++i)
            labels->look_on(events_of(found->events.events[i].kind, found->coats[i]));
    }
    deposit(path, bounce, world_.lights.group(found->light), path.beta * found->radiance,
            "caustic solved for", out);
    if (labels) labels->stay();
}

bool PathTracer::pass_through(Path& path, const geometry::SurfacePoint& point) const {
    if (!world_.materials.material_has_presence(point.material)) return false;
    const float presence = world_.materials.presence(point, path.cone_width);
    if (presence >= 1.0f) return false;
    if (path.sampler.get_1d(path.bounce, Purpose::Opacity, path.pass_count) < presence)
        return false;
    go_straight_on(path, point);
    return true;
}

bool PathTracer::go_below(Path& path, const Vertex& vertex, std::optional<Emergence>& out) const {
    const shading::Subsurface below = world_.materials.subsurface(vertex.point, path.cone_width);
    const Rgb entering = vertex.bsdf.entering() * below.weight;
    const float share = luminance(entering * below.color);
    if (!(share > 0.0f)) return true;
    const float probability = share / (share + luminance(vertex.bsdf.albedo()));
    if (path.sampler.get_1d(path.bounce, Purpose::SubsurfaceSelect, path.pass_count) >=
        probability) {
        path.beta /= 1.0f - probability;
        return true;
    }
    const auto exit =
        world_.subsurface->walk(vertex.point, vertex.bsdf.ns(), vertex.wo, below, path.sampler,
                                path.bounce, path.pass_count, *path.counts);
    if (!exit) return false;
    path.beta *= entering * exit->throughput / probability;
    const std::optional<geometry::SurfacePoint> moved =
        leaving_point(world_, exit->point, exit->wo, path.counts->shadow);
    out.emplace(moved ? *moved : exit->point, exit->wo, options_.guide);
    return true;
}

bool PathTracer::meet_bodies(Path& path,
                             const geometry::SurfacePoint& point,
                             std::optional<NestedBodies::Crossing>& room,
                             const NestedBodies::Crossing*& crossing) const {
    const shading::MaterialEvaluator& materials = world_.materials;
    if (!materials.bounds_body(point.material)) return true;
    if (!world_.nested) {
        if (!materials.is_bare(point.material)) return true;
        path.interior.cross(materials, point, -path.ray.d, path.ray.d);
        go_straight_on(path, point);
        return false;
    }
    crossing = &room.emplace(world_.nested->cross(path.interior, point, -path.ray.d, path.counts));
    if (crossing->is_boundary && !materials.is_bare(crossing->point.material)) return true;
    path.interior = crossing->beyond;
    go_straight_on(path, crossing->point);
    return false;
}

void PathTracer::go_straight_on(Path& path, const geometry::SurfacePoint& point) {
    // The rest of the segment keeps its end: the camera's far plane also counts behind a cut-out
    const float rest = path.ray.t_max - path.segment_t;
    path.ray = geometry::spawn_ray(point, path.ray.d);
    path.ray.t_max = rest;
    path.travelled += path.segment_t;
    ++path.pass_count;
}

/// Goes on with all the light that passes the vertex straight, and with nothing else.
bool PathTracer::pass_straight(Path& path, const Vertex& vertex) const {
    if (path.pass_count >= pass_through_limit) return false;
    const float surrounding_index = vertex.crossing ? vertex.crossing->surrounding_index : 1.0f;
    const Rgb passed = straight_through(world_.materials, vertex.point, -vertex.wo, path.cone_width,
                                        surrounding_index);
    if (is_black(passed)) return false;
    path.beta *= passed;
    if (keeps_interior(world_))
        cross(world_, vertex.crossing, vertex.point, vertex.wo, -vertex.wo, path.interior);
    go_straight_on(path, vertex.point);
    return true;
}

bool PathTracer::scatter(Path& path, const Vertex& vertex, film::SampleRadiance& out) const {
    const auto& [point, bsdf, wo, directions, crossing, is_exit] = vertex;
    if (path.observer && bsdf.has_non_delta())
        path.observer->on_vertex({point.p, bsdf.ns()}, path.beta);
    const std::optional<ScatterSample> scattered =
        directions.sample(path.sampler, path.bounce, path.pass_count);
    if (!scattered) return false;
    const shading::BsdfSample* sample = &scattered->bsdf;
    if (options_.estimator.specular_chains_only && !sample->is_delta) return false;
    const Rgb beta = path.beta;
    path.beta *= sample->f * (bsdf.cosine(sample->wi) / sample->pdf);
    if (is_black(path.beta)) return false;
    path.eta_scale *= sample->eta * sample->eta;

    if (keeps_interior(world_) && sample->kind == shading::ScatterKind::Transmit)
        cross(world_, crossing, point, wo, sample->wi, path.interior);

    // Going straight through a thin wall or an interface between equal media is no scattering
    // event. Light sampling looks through it as well, unless nobody knew that it is one: then what
    // lies behind has no rival sampler
    if (sample->is_delta && sample->kind == shading::ScatterKind::Transmit && sample->eta == 1.0f) {
        go_straight_on(path, point);
        if (!world_.materials.material_is_see_through(point.material)) path.is_certain = true;
        return true;
    }
    if (film::PathLabels* const labels = labels_of(out)) {
        // Each of two mirrors in one direction brings its own weight and no more
        labels->look(sample->is_delta ? events_of(*sample)
                                      : vertex.events(bsdf.evaluate(wo, sample->wi)));
        labels->go();
    }
    path.ray = geometry::spawn_ray(point, sample->wi);
    path.straight_o = path.ray.o;
    path.travelled = 0;
    path.line_hit_count = Path::unknown_hits;
    path.is_certain = sample->is_delta;
    path.onlooker = sample->is_delta ? lights::Onlooker::Eye : lights::Onlooker::Scattering;
    path.receiver = receiver_at(world_, point, bsdf);
    path.scatter_pdf = sample->pdf;
    if (path.observer && !sample->is_delta) path.observer->on_scatter(sample->wi);
    if (options_.guide) {
        if (!(path.first_expected > 0.0f))
            path.first_expected = luminance(beta) * directions.expected();
        path.importance = scattered->expected > 0.0f
                              ? luminance(beta) * scattered->expected / path.first_expected
                              : 0.0f;
    }
    if (world_.has_lobe_multipliers) {
        path.diffuse_share = Rgb(0.0f);
        if (!sample->is_delta) {
            const Rgb diffuse = bsdf.evaluate(wo, sample->wi).diffuse;
            for (int c = 0; c < 3; ++c)
                path.diffuse_share[c] =
                    sample->f[c] > 0.0f ? std::min(1.0f, diffuse[c] / sample->f[c]) : 0.0f;
        }
    }
    if (options_.caustics)
        path.history =
            options_.caustics->after(path.history, point, bsdf, sample->is_delta, path.pass_count);
    const bool is_first = path.bounce == 0;
    ++path.bounce;
    path.pass_count = 0;
    if (is_first && has_unoccluded_) add_unoccluded_hits(path, out);
    if (world_.has_own_shadows) add_lights_beyond(path, point, out);
    return true;
}

bool PathTracer::survives_roulette(Path& path) const {
    const EstimatorOptions& estimator = options_.estimator;
    if (estimator.roulette != Roulette::Throughput) return survives_otherwise(path);
    if (path.bounce < estimator.roulette_start) return true;
    const float whole = world_.camera.exposure_scale() * path.share;
    float survival = usual_gain * max_component(path.beta) * path.eta_scale / whole;
    // A dim path on its way to where much light is must not end: keep it by what it may bring
    // (Vorba & Křivánek 2016, without splitting). What was learned never makes a path end earlier.
    if (std::isfinite(path.importance))
        survival = std::max(survival, importance_scale * path.importance);
    if (path.bounce >= trapped_path_start)
        survival = std::min(survival, 1.0f - 1.0f / trapped_path_share);
    if (survival >= 1.0f) return true;
    count_call(Effect::Roulette);
    if (path.sampler.get_1d(path.bounce, Purpose::Roulette) >= survival) return false;
    path.beta /= survival;
    return true;
}

void PathTracer::record_first_hit(const geometry::SurfacePoint& point,
                                  const shading::Bsdf& bsdf,
                                  film::SampleRadiance& out) const {
    out.has_hit = true;
    out.alpha = 1.0f;
    out.prim_id = point.provenance;
    out.instance_id = point.instance;
    if (options_.mattes) {
        count_call(Effect::IdMattes);
        out.matte_ids = {options_.mattes->object(point), options_.mattes->material(point)};
    }
    if (options_.deep) {
        count_call(Effect::DeepSamples);
        out.cover(film::SampleRadiance::DepthKind::Surface, world_.camera.depth(point.p));
    }
    if (!has_data_layers_) return;
    out.albedo = bsdf.albedo();
    if (world_.subsurface && world_.materials.has_subsurface(point.material)) {
        const shading::Subsurface below = world_.materials.subsurface(point, 0.0f);
        out.albedo += bsdf.entering() * below.color * below.weight;
    }
    out.N = bsdf.ns();
    const Vec3d world = Vec3d(point.p) + world_.scene.camera.world_position;
    out.P = Vec3(float(world.x), float(world.y), float(world.z));
    out.Z = world_.camera.depth(point.p);
    float st[4] = {0, 0, 0, 0};
    if (point.mesh->primvar(point.mesh->texture_coordinates(), point.triangle, point.b1, point.b2,
                            st))
        out.st = Vec2(st[0], st[1]);
}

}  // namespace velatura::integrator
