// SPDX-License-Identifier: Apache-2.0
#include "integrator/caustics.h"

#include "integrator/custom_shadow.h"
#include "integrator/shadow_segment.h"

#include <algorithm>
#include <cmath>

namespace velatura::integrator {

using sampling::Purpose;
using shading::ScatterKind;

namespace {

constexpr int newton_steps = 20;
constexpr double smallest_damping = 1.0 / 64.0;
/// Directions are found when Newton's step is below this (radians): the next one would be below the
/// roundoff.
constexpr double converged_step = 1e-9;
/// Solutions closer than this are one.
constexpr double same_direction = 1e-6;
/// A step turns the direction by no more than about this: beyond, the linear model says nothing.
constexpr double longest_step = 0.3;
/// Nor does it try to turn the last direction by more.
constexpr double longest_turn = 0.5;

/// Share of seeds that go straight to the light, and how far about they are turned aside (radians):
/// where interfaces bend light little, these are the best.
constexpr float straight_share = 0.4f;
constexpr double straight_spread = 0.1;

/// How often the events of a seed end before its ray leaves the specular surfaces, where the light
/// stands before the next one.
constexpr float end_at_light = 0.5f;

/// Share of seeds that reflect where both is possible, and that refract, at least: events that
/// bring little must not take forever to find again.
constexpr float min_event_share = 0.1f;

/// Seeds whose last direction is further off the light are not pursued: few would lead there, and
/// near a solution there are always others.
constexpr double widest_seed_cosine = 0.85;

/// How to turn the first direction.
struct NewtonStep {
    double by[2] = {0, 0};   ///< along the two directions across it
    double length = 0;       ///< radians; not finite where the derivative is singular
    double determinant = 0;  ///< of the last direction, as it is seen from the light, by the first
};

/// The step that turns the last direction along the great circle to the light, as far as its
/// derivative is to be trusted. closeness: 1 / distance of the light.
NewtonStep newton_step(const RayDifferential& ray, const Vec3d& towards, double closeness) {
    const std::array<Vec3d, 2> plane = directions_across(ray.d);
    const double sine = std::hypot(plane[0].dot(towards), plane[1].dot(towards));
    const double angle = std::atan2(sine, ray.d.dot(towards));
    const double stretch = sine > 0.0 ? std::min(angle, longest_turn) / sine : 1.0;
    double j[2][2], wanted[2];
    for (size_t row = 0; row < 2; ++row) {
        wanted[row] = stretch * plane[row].dot(towards);
        for (size_t column = 0; column < 2; ++column)
            j[row][column] = plane[row].dot(ray.d_by[column] + ray.o_by[column] * closeness);
    }
    NewtonStep step;
    step.determinant = j[0][0] * j[1][1] - j[0][1] * j[1][0];
    step.by[0] = (j[1][1] * wanted[0] - j[0][1] * wanted[1]) / step.determinant;
    step.by[1] = (j[0][0] * wanted[1] - j[1][0] * wanted[0]) / step.determinant;
    step.length = std::hypot(step.by[0], step.by[1]);
    return step;
}

}  // namespace

std::optional<Caustics> caustics_mode(std::string_view name) {
    if (name == "path") return Caustics::Path;
    if (name == "auto") return Caustics::Auto;
    if (name == "manifold") return Caustics::Manifold;
    if (name == "small-lights") return Caustics::SmallLights;
    if (name == "light") return Caustics::Light;
    return std::nullopt;
}

/// One search for light at one vertex.
struct CausticSampler::Search {
    const Receiver& receiver;
    const sampling::PixelSampler& sampler;
    int bounce;
    uint32_t repeat;
    RayCounts& counts;
    Target target = {};

    Vec2 numbers(Purpose purpose, uint32_t trial, uint32_t step = 0) const {
        return sampler.get_2d(bounce, purpose, key(trial, step));
    }

    float number(Purpose purpose, uint32_t trial) const {
        return sampler.get_1d(bounce, purpose, key(trial, 0));
    }

    /// For volumes on a segment of the chain.
    sampling::RandomStream volume_numbers(int segment) const {
        return sampler.stream(bounce, Purpose::VolumeChain,
                              repeat * uint32_t(longest_specular_chain + 1) + uint32_t(segment));
    }

    /// Tells all trials of a vertex apart, and vertices behind up to 2^13 pass-throughs.
    uint32_t key(uint32_t trial, uint32_t step) const {
        static_assert(uint64_t(trial_cap) * longest_specular_chain <= uint64_t(1) << 19);
        return (repeat * trial_cap + trial) * uint32_t(longest_specular_chain) + step;
    }
};

/// What a first direction comes to.
struct CausticSampler::Aim {
    Vec3d d = Vec3d(0.0);
    std::array<Vec3d, 2> across;
    Vec3d towards = Vec3d(0.0);  ///< from the last surface to the light, unit
    double distance = 0;
    double error = 0;  ///< of the last direction
};

CausticSampler::CausticSampler(const World& world, double largest_light)
    : world_(world), casters_(world), is_handled_(world.lights.size(), 0) {
    if (!casters_.is_empty()) add_lights(largest_light);
}

void CausticSampler::add_lights(double largest_light) {
    const BoundingSphere target = casters_.sphere();
    const Box3 bounds = world_.accelerator->bounds();
    const double scene_radius = 0.5 * (Vec3d(bounds.max) - Vec3d(bounds.min)).length();
    const lights::LightSet& lights = world_.lights;
    double sum = 0;
    for (uint32_t i = 0; i < lights.size(); ++i) {
        if (!lights.has_points(i)) continue;
        const double power = lights.power(i, scene_radius);
        if (!(power > 0.0) || !std::isfinite(power)) continue;
        std::optional<Vec3d> facing;
        double half_angle = 0.0;
        if (lights.is_infinite(i)) {
            half_angle =
                lights.is_delta(i) ? 0.0 : 0.5 * double(lights.light(i).angle_deg) * (pi_d / 180.0);
        } else {
            const BoundingSphere sphere = sphere_around(lights.bounds(i).box);
            const Vec3d away = target.center - sphere.center;
            const double distance2 = away.dot(away);
            if (distance2 > target.radius2) facing = away / std::sqrt(distance2);
            half_angle = casters_.half_angle_of(sphere);
        }
        if (!(half_angle <= largest_light)) continue;
        is_handled_[i] = 1;
        lights_.push_back(i);
        sum += power;
        light_cdf_.push_back(sum);
        facing_.push_back(facing);
    }
    for (double& c : light_cdf_) c /= sum;
}

SpecularHistory CausticSampler::after(const SpecularHistory& before,
                                      const geometry::SurfacePoint& point,
                                      const shading::Bsdf& bsdf,
                                      bool is_delta,
                                      uint32_t passed) const {
    if (!is_delta) return {0, true};
    const bool is_handled =
        before.is_handled && passed == 0 && before.length < longest_specular_chain &&
        casters_.weight(point.material) > 0.0 && is_plain_vertex(world_, point, bsdf);
    return {before.length + 1, is_handled};
}

CausticSampler::Target CausticSampler::choose_target(const Search& search) const {
    const double u =
        search.sampler.get_1d_fine(search.bounce, Purpose::ManifoldLight, search.repeat);
    const size_t choice = std::min(
        size_t(std::upper_bound(light_cdf_.begin(), light_cdf_.end(), u) - light_cdf_.begin()),
        lights_.size() - 1);
    Target target;
    target.light = lights_[choice];
    target.pmf = light_cdf_[choice] - (choice > 0 ? light_cdf_[choice - 1] : 0.0);
    target.is_infinite = world_.lights.is_infinite(target.light);
    target.point = world_.lights.sample_point(
        target.light, search.sampler.get_2d(search.bounce, Purpose::ManifoldPoint, search.repeat),
        facing_[choice], search.receiver.point.time);
    return target;
}

/// A first direction to try. Zero: none.
Vec3d CausticSampler::seed_direction(const Search& search, uint32_t trial) const {
    const Vec2 u = search.numbers(Purpose::ManifoldCaster, trial);
    const Vec2 v = search.numbers(Purpose::ManifoldSeed, trial);
    const Vec3d x(search.receiver.point.p);
    const Target& target = search.target;
    if (u.y >= straight_share)
        return casters_.direction_from(x, search.receiver.point.time,
                                       {u.x, (u.y - straight_share) / (1.0f - straight_share)},
                                       search.number(Purpose::ManifoldTriangle, trial), v);
    const Vec3d to_light = target.is_infinite ? target.point.n : target.point.p - x;
    const double length = to_light.length();
    if (!(length > 0.0)) return Vec3d(0.0);
    const double angle = straight_spread * double(v.x) * double(v.x),
                 turn = 2.0 * pi_d * double(v.y);
    const Vec3d axis = to_light / length;
    const std::array<Vec3d, 2> across = directions_across(axis);
    return axis * std::cos(angle) +
           (across[0] * std::cos(turn) + across[1] * std::sin(turn)) * std::sin(angle);
}

/// Lets a ray choose its events like a path, until it leaves the specular surfaces or may end at
/// the light. wanted: see try_seed.
bool CausticSampler::find_events(const Search& search,
                                 uint32_t trial,
                                 const Vec3& d,
                                 const SpecularEvents* wanted,
                                 SpecularEvents& events) const {
    events.count = 0;
    const Target& target = search.target;
    geometry::Ray ray = geometry::spawn_ray(search.receiver.point, d);
    float cone_width = search.receiver.cone.width;
    while (events.count < longest_specular_chain) {
        const Vec2 u = search.numbers(Purpose::ManifoldLobe, trial, uint32_t(events.count));
        const geometry::Hit hit = world_.accelerator->intersect(ray);
        ++search.counts.caustic;
        if (!hit.is_valid()) break;
        if (events.count > 0) {
            const double passes_at =
                target.is_infinite ? 0.0 : (target.point.p - Vec3d(ray.o)).dot(Vec3d(ray.d));
            const bool meets_light = passes_at > 0.0 && passes_at < double(hit.t);
            if (meets_light && u.y < end_at_light) break;
        }
        const geometry::SurfacePoint point =
            geometry::make_surface_point(world_.scene, world_.geometry, ray, hit);
        if (!(casters_.weight(point.material) > 0.0)) break;
        cone_width += search.receiver.cone.spread * hit.t;
        const Vec3 wo = -ray.d;
        const geometry::SurfacePoint start =
            leaving_point(world_, point, wo, search.counts.caustic).value_or(point);
        const shading::Bsdf bsdf = world_.materials.make_bsdf(start, wo, cone_width);
        const auto reflected = bsdf.delta(ScatterKind::Reflect),
                   transmitted = bsdf.delta(ScatterKind::Transmit);
        const float r = reflected ? max_component(reflected->weight) : 0.0f;
        const float t =
            transmitted && transmitted->eta != 1.0f
                ? max_component(transmitted->weight) * transmitted->eta * transmitted->eta
                : 0.0f;
        if (!(r + t > 0.0f)) break;
        const bool has_both = r > 0.0f && t > 0.0f;
        const float share = has_both
                                ? std::clamp(r / (r + t), min_event_share, 1.0f - min_event_share)
                                : float(r > 0.0f);
        const bool reflects = u.x < share;
        const shading::DeltaScattering& chosen = reflects ? *reflected : *transmitted;
        const SpecularEvent event = {reflects ? ScatterKind::Reflect : ScatterKind::Transmit,
                                     point.material, point.ng.dot(wo) < 0.0f, chosen.eta};
        const size_t index = size_t(events.count++);
        events.events[index] = event;
        if (wanted && !(events.count <= wanted->count && event == wanted->events[index]))
            return false;
        ray = geometry::spawn_ray(start, chosen.wi);
    }
    // Look whether the chain ends anywhere near the light
    const Vec3d to_light = target.is_infinite ? target.point.n : target.point.p - Vec3d(ray.o);
    return events.count > 0 && to_light.dot(Vec3d(ray.d)) > widest_seed_cosine * to_light.length();
}

/// Follows the events of the solution to where they lead; false when they lead nowhere.
bool CausticSampler::aim(const Search& search, const Vec3d& d, Solution& out, Aim& aim) const {
    const Target& target = search.target;
    aim.d = d;
    aim.across = directions_across(d);
    if (!follow_chain(world_, search.receiver.point, d, aim.across, out.events, out.chain,
                      search.counts))
        return false;
    const Vec3d to_light = target.is_infinite ? target.point.n : target.point.p - out.chain.ray.o;
    aim.distance = to_light.length();
    if (!(aim.distance > 0.0)) return false;
    aim.towards = to_light / aim.distance;
    aim.error = (out.chain.ray.d - aim.towards).length();
    return true;
}

/// Newton's method with damping, from a direction whose chain has the events.
bool CausticSampler::solve(const Search& search, const Vec3d& seed, Solution& out) const {
    const bool is_infinite = search.target.is_infinite;
    Aim now;
    if (!aim(search, seed, out, now)) return false;
    double damping = 1.0;
    for (int i = 0; i < newton_steps; ++i) {
        const NewtonStep step =
            newton_step(out.chain.ray, now.towards, is_infinite ? 0.0 : 1.0 / now.distance);
        if (!std::isfinite(step.length)) return false;
        if (step.length < converged_step && now.error < 1.0) {
            out.d = now.d;
            out.distance = now.distance;
            out.density = 1.0 / std::abs(step.determinant);
            if (!is_infinite) out.density /= now.distance * now.distance;
            return true;
        }
        const double shortened = step.length > longest_step ? longest_step / step.length : 1.0;
        // Close by, roundoff decides which error is the smaller one
        const bool is_close = step.length < 1e3 * converged_step;
        while (true) {
            const Vec3d moved = now.d + (now.across[0] * step.by[0] + now.across[1] * step.by[1]) *
                                            (damping * shortened);
            Aim next;
            if (aim(search, moved / moved.length(), out, next) &&
                (next.error < now.error || is_close)) {
                now = next;
                break;
            }
            damping *= 0.5;
            if (damping < smallest_damping) return false;
        }
        damping = std::min(1.0, 2.0 * damping);
    }
    return false;
}

/// wanted: events without which the seed is none; null = any.
bool CausticSampler::try_seed(const Search& search,
                              uint32_t trial,
                              const SpecularEvents* wanted,
                              Solution& out) const {
    const Receiver& at = search.receiver;
    const Vec3d seed = seed_direction(search, trial);
    if (seed == Vec3d(0.0)) return false;
    const Vec3 d = to_float(seed);
    // Nothing opaque takes light from behind
    if (!at.bsdf.has_transmission() &&
        (d.dot(at.point.ng) > 0.0f) != (at.wo.dot(at.point.ng) > 0.0f))
        return false;
    if (!find_events(search, trial, d, wanted, out.events)) return false;
    if (wanted && !(*wanted == out.events)) return false;
    return solve(search, seed, out);
}

/// What volumes leave of light on one segment of a chain.
Rgb CausticSampler::through_volumes(
    const Search& search, const Vec3& o, const Vec3& d, float distance, int segment) const {
    sampling::RandomStream numbers = search.volume_numbers(segment);
    return world_.volumes->transmittance(o, d, distance, nullptr, numbers, search.counts.tracking,
                                         search.receiver.point.time);
}

/// What of the light arrives at the last surface of the chain, which it must shine on. interior: on
/// the light's side.
Rgb CausticSampler::visibility(const Search& search,
                               const Solution& solution,
                               const geometry::SurfacePoint& last,
                               const Interior& interior,
                               const lights::RayCone& cone) const {
    const Vec3 wi = to_float(solution.chain.ray.d);
    const float distance = search.target.is_infinite ? std::numeric_limits<float>::infinity()
                                                     : float(solution.distance);
    const scene::LightLinks* links = world_.lights.links(search.target.light);
    if (links) {
        if (!world_.lights.illuminates(links,
                                       scene::link_class(world_.scene, last.instance, last.shape)))
            return Rgb(0.0f);
        if (links->has_custom_shadows()) {
            lights::LightSample light;
            light.wi = wi;
            light.distance = distance;
            return CustomShadow(world_, *links, interior, cone,
                                search.volume_numbers(longest_specular_chain))
                .visibility(ShadowSegment(last, light), search.counts);
        }
    }
    Rgb visible = interior.transmittance(world_.materials, distance);
    if (world_.volumes)
        visible *= through_volumes(search, last.p, wi, distance, longest_specular_chain);
    if (is_black(visible)) return visible;
    geometry::Ray ray = geometry::spawn_ray(last, wi);
    if (!search.target.is_infinite) ray.t_max = distance - flush_light_margin(last.p, distance);
    ++search.counts.caustic;
    return world_.accelerator->is_occluded(ray) ? Rgb(0.0f) : visible;
}

/// What the solution brings over the probability to find it; black when it is none of the chains
/// that finds() means.
Rgb CausticSampler::contribution(const Search& search, Solution& solution) const {
    const Receiver& at = search.receiver;
    const Target& target = search.target;
    const SpecularChain& chain = solution.chain;
    const Vec3 wi = to_float(solution.d);
    Rgb L = at.bsdf.f(at.wo, wi) * at.bsdf.cosine(wi);
    if (is_black(L)) return L;
    L *= world_.lights.radiance_at(target.light, target.point, chain.ray.o, chain.ray.d,
                                   at.point.time);
    if (is_black(L)) return L;
    L *= world_.lights.light(target.light).specular_multiplier;

    // Scatter and absorb as the path tracer does
    const bool absorbs = world_.materials.has_absorption();
    Interior interior = at.interior;
    if (absorbs) interior.cross(world_.materials, at.point, at.wo, wi);
    float cone_width = at.cone.width;
    geometry::SurfacePoint last;
    for (size_t i = 0; i < size_t(solution.events.count); ++i) {
        const geometry::SurfacePoint& point = chain.points[i];
        const Vec3 wo = -to_float(chain.directions[i]);
        cone_width += at.cone.spread * float(chain.lengths[i]);
        if (world_.materials.material_has_presence(point.material))
            L *= world_.materials.presence(point, cone_width);
        last = leaving_point(world_, point, wo, search.counts.caustic).value_or(point);
        const shading::Bsdf bsdf = world_.materials.make_bsdf(last, wo, cone_width);
        if (!is_plain_vertex(world_, last, bsdf)) return Rgb(0.0f);
        const auto scattered = bsdf.delta(solution.events.events[i].kind);
        if (!scattered ||
            (solution.events.events[i].kind == ScatterKind::Transmit && scattered->eta == 1.0f))
            return Rgb(0.0f);
        L *= scattered->weight;
        for (int c = 0; c < 3; ++c)
            solution.coats[i][c] = scattered->weight[c] > 0.0f
                                       ? std::min(scattered->coat[c] / scattered->weight[c], 1.0f)
                                       : 0.0f;
        if (absorbs) {
            L *= interior.transmittance(world_.materials, float(chain.lengths[i]));
            interior.cross(world_.materials, point, wo, scattered->wi);
        }
        if (world_.volumes)
            L *= through_volumes(search, i == 0 ? at.point.p : chain.points[i - 1].p,
                                 to_float(chain.directions[i]), float(chain.lengths[i]), int(i));
        if (is_black(L)) return L;
    }
    L *= visibility(search, solution, last, interior, {cone_width, at.cone.spread});
    if (is_black(L)) return L;
    double scale = solution.density / (target.point.pdf * target.pmf);
    if (!target.is_infinite) scale *= std::abs(target.point.n.dot(chain.ray.d));
    return L * float(scale);
}

std::optional<CausticSampler::Estimate> CausticSampler::sample(
    const Receiver& receiver,
    const sampling::PixelSampler& sampler,
    int bounce,
    uint32_t repeat,
    RayCounts& counts) const {
    if (is_empty() || !receiver.bsdf.has_non_delta()) return std::nullopt;
    Search search{receiver, sampler, bounce, repeat, counts};
    search.target = choose_target(search);
    Solution first;
    if (!try_seed(search, 0, nullptr, first)) return std::nullopt;
    const Rgb L = contribution(search, first);
    if (is_black(L)) return std::nullopt;
    ++counts.caustics_found;

    // The number of trials until it is found again has the mean 1 / probability
    Solution other;
    uint32_t trial = 1;
    for (; trial < trial_cap; ++trial) {
        if (try_seed(search, trial, &first.events, other) &&
            (other.d - first.d).length() < same_direction)
            break;
    }
    if (trial == trial_cap) ++counts.caustics_capped;
    return Estimate{L * float(trial), to_float(first.d), first.events, first.coats,
                    search.target.light};
}

std::unique_ptr<const CausticSampler> make_caustic_sampler(Caustics mode, const World& world) {
    if (world.has_ray_visibility) return nullptr;
    switch (mode) {
        case Caustics::Path:
        case Caustics::Light:
        case Caustics::Auto:
            break;
        case Caustics::Manifold:
            return std::make_unique<CausticSampler>(world);
        case Caustics::SmallLights:
            return std::make_unique<CausticSampler>(world, CausticSampler::auto_largest_light);
    }
    return nullptr;
}

}  // namespace velatura::integrator
