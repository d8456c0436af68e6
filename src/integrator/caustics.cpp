// SPDX-License-Identifier: Apache-2.0
#include "integrator/caustics.h"

#include "base/check.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

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

/// Shapes that a seed chooses among by distance; each is drawn by area.
constexpr int caster_candidates = 4;

/// How often the events of a seed end before its ray leaves the specular surfaces, where the light
/// stands before the next one.
constexpr float end_at_light = 0.5f;

/// Share of seeds that reflect where both is possible, and that refract, at least: events that
/// bring little must not take forever to find again.
constexpr float least_event_share = 0.1f;

/// Seeds whose last direction is further off the light are not pursued: few would lead there, and
/// near a solution there are always others.
constexpr double widest_seed_cosine = 0.85;

/// As for the paths' own light hits: lights flush with a surface are neither shadowed nor missed.
constexpr double flush_light_margin = 0x1p-14;

double square(double x) { return x * x; }

/// The part of a number in [0, 1).
float fraction(float x) {
    const float f = x - std::floor(x);
    return f < 1.0f ? f : 0.0f;
}

struct Ball {
    Vec3d center = Vec3d(0.0);
    double radius2 = 0;
};

Ball ball_around(const Box3d& box) {
    const Vec3d half = (box.max - box.min) * 0.5;
    return {box.min + half, half.dot(half)};
}

}  // namespace

std::optional<Caustics> caustics_mode(std::string_view name) {
    if (name == "path") return Caustics::Path;
    if (name == "auto") return Caustics::Auto;
    if (name == "manifold") return Caustics::Manifold;
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
        return sampler.get_2d(bounce, purpose, (repeat * trial_cap + trial) * uint32_t(longest_specular_chain) + step);
    }
};

CausticSampler::CausticSampler(const World& world, double largest_light) : world_(world) {
    add_casters();
    if (!casters_.empty()) add_lights(largest_light);
}

double CausticSampler::caster_weight(scene::MaterialId id) const {
    if (id >= world_.scene.materials.size()) return 0.0;
    const scene::Material& m = world_.scene.materials[id];
    const auto is_constant = [](const scene::Input& i) { return i.source == scene::Input::Source::Constant; };
    if (!is_constant(m.normal) || !is_constant(m.ior)) return 0.0;
    const auto may_be_smooth = [&](const scene::Input& roughness) {
        return !is_constant(roughness) || square(double(roughness.value.x)) < double(shading::specular_switch_alpha);
    };
    // What passes is worth more than what a dielectric reflects
    constexpr double dielectric_reflection = 0.04;
    double weight = 0.0;
    if (world_.materials.material_has_transmission(id)) {
        const double ior = double(m.ior.value.x);
        const double turn = square(double(m.roughness.value.x)) * std::abs(1.0 - ior) / std::max(ior, 1.0);
        if (!m.rough_transmission || !is_constant(m.roughness) || turn < double(shading::specular_switch_alpha)) weight = 1.0;
    }
    if (m.has_specular && may_be_smooth(m.roughness)) {
        const double metallic = is_constant(m.metallic) ? double(m.metallic.value.x) : 1.0;
        const double specular = !m.use_specular_workflow ? 0.0 : is_constant(m.specular_color) ? double(max_component(m.specular_color.value)) : 1.0;
        weight = std::max({weight, dielectric_reflection, metallic, specular});
    }
    const bool has_coat = !is_constant(m.clearcoat) || m.clearcoat.value.x > 0.0f;
    if (has_coat && may_be_smooth(m.clearcoat_roughness)) weight = std::max(weight, dielectric_reflection);
    return std::min(weight, 1.0);
}

uint32_t CausticSampler::add_caster(const geometry::TriangleMesh& mesh, scene::MaterialId override) {
    std::vector<double> weights(mesh.triangle_count());
    for (uint32_t t = 0; t < weights.size(); ++t) {
        const double weight = caster_weight(override != scene::none ? override : mesh.material(t));
        if (!(weight > 0.0)) continue;
        const Vec3d c0(mesh.corner(t, 0)), c1(mesh.corner(t, 1)), c2(mesh.corner(t, 2));
        weights[t] = weight * 0.5 * (c1 - c0).cross(c2 - c0).length();
    }
    triangles_.emplace_back(std::span<const double>(weights));
    return uint32_t(triangles_.size() - 1);
}

void CausticSampler::add_casters() {
    std::vector<double> weights;
    const auto add = [&](uint32_t instance, uint32_t shape, const geometry::TriangleMesh& mesh, uint32_t triangles, const Mat4d& forward) {
        // Weight over the mesh's own area, times how much the transform enlarges areas about
        const double area = triangles_[triangles].integral() * double(triangles_[triangles].size());
        if (!(area > 0.0)) return;
        const Box3 local = mesh.bounds();
        Box3d box;
        for (int i = 0; i < 8; ++i) {
            const Vec3 corner(i & 1 ? local.max.x : local.min.x, i & 2 ? local.max.y : local.min.y, i & 4 ? local.max.z : local.min.z);
            box.extendBy(transform_point(Vec3d(corner), forward));
        }
        const Ball ball = ball_around(box);
        casters_.push_back({instance, shape, triangles, ball.center, ball.radius2});
        weights.push_back(area * square(std::cbrt(std::abs(determinant3(forward)))));
    };
    const geometry::GeometrySet& geometry = world_.geometry;
    for (uint32_t s = 0; s < geometry.shapes().size(); ++s) {
        const geometry::TriangleMesh& mesh = geometry.shapes()[s];
        add(scene::none, s, mesh, add_caster(mesh, scene::none), Mat4d());
    }
    // Placements of one shape with one material share its triangles
    std::map<std::pair<std::pair<uint32_t, uint32_t>, scene::MaterialId>, uint32_t> known;
    for (uint32_t i = 0; i < geometry.instances().size(); ++i) {
        const geometry::InstanceTransform& instance = geometry.instances()[i];
        if (!instance.is_invertible) continue;
        const auto& shapes = geometry.prototypes()[instance.prototype];
        const scene::MaterialId override = world_.scene.instances[i].material_override;
        for (uint32_t s = 0; s < shapes.size(); ++s) {
            const auto key = std::make_pair(std::make_pair(instance.prototype, s), override);
            auto found = known.find(key);
            if (found == known.end()) found = known.emplace(key, add_caster(shapes[s], override)).first;
            add(i, s, shapes[s], found->second, Mat4d(instance.render_from_prototype));
        }
    }
    caster_choice_ = sampling::Distribution1D(std::span<const double>(weights));
}

void CausticSampler::add_lights(double largest_light) {
    Box3d casters;
    for (const Caster& c : casters_) {
        const Vec3d reach(std::sqrt(c.radius2));
        casters.extendBy(c.center - reach);
        casters.extendBy(c.center + reach);
    }
    const Ball target = ball_around(casters);
    const Box3 bounds = world_.accelerator->bounds();
    const double scene_radius = 0.5 * (Vec3d(bounds.max) - Vec3d(bounds.min)).length();
    const lights::LightSet& lights = world_.lights;
    is_handled_.assign(lights.size(), 0);
    std::vector<double> powers;
    for (uint32_t i = 0; i < lights.size(); ++i) {
        if (!lights.has_points(i)) continue;
        const double power = lights.power(i, scene_radius);
        if (!(power > 0.0) || !std::isfinite(power)) continue;
        std::optional<Vec3d> facing;
        double half_angle = 0.0;
        if (lights.is_infinite(i)) {
            half_angle = lights.is_delta(i) ? 0.0 : 0.5 * double(lights.light(i).angle_deg) * (pi_d / 180.0);
        } else {
            const Ball ball = ball_around(lights.bounds(i).box);
            const Vec3d away = target.center - ball.center;
            const double distance2 = away.dot(away);
            if (distance2 > target.radius2) facing = away / std::sqrt(distance2);
            half_angle = std::sqrt(ball.radius2 / std::max(distance2, target.radius2));
        }
        if (!(half_angle <= largest_light)) continue;
        is_handled_[i] = 1;
        lights_.push_back(i);
        powers.push_back(power);
        facing_.push_back(facing);
    }
    light_choice_ = sampling::Distribution1D(std::span<const double>(powers));
}

SpecularHistory CausticSampler::after(const SpecularHistory& before,
                                      const geometry::SurfacePoint& point,
                                      const shading::Bsdf& bsdf,
                                      bool is_delta,
                                      uint32_t passed) const {
    if (!is_delta) return {0, true};
    const bool is_handled = before.is_handled && passed == 0 && before.length < longest_specular_chain && is_plain_vertex(world_, point, bsdf);
    return {before.length + 1, is_handled};
}

CausticSampler::Target CausticSampler::choose_target(const Search& search) const {
    const float u = search.sampler.get_1d(search.bounce, Purpose::ManifoldLight, search.repeat);
    const sampling::Distribution1D::Sample choice = light_choice_.sample(u);
    Target target;
    target.light = lights_[choice.index];
    target.pmf = choice.pmf;
    target.is_infinite = world_.lights.is_infinite(target.light);
    target.point = world_.lights.sample_point(target.light, search.sampler.get_2d(search.bounce, Purpose::ManifoldPoint, search.repeat), facing_[choice.index]);
    return target;
}

/// A direction that may begin a chain; any density does, as long as every direction towards a caster
/// can come. Zero: none.
Vec3d CausticSampler::seed_direction(const Search& search, uint32_t trial) const {
    const Vec2 u = search.numbers(Purpose::ManifoldCaster, trial);
    const Vec2 v = search.numbers(Purpose::ManifoldSeed, trial);
    const Vec3d x(search.receiver.point.p);
    const Target& target = search.target;
    if (u.y < straight_share) {
        const Vec3d to_light = target.is_infinite ? target.point.n : target.point.p - x;
        const double length = to_light.length();
        if (!(length > 0.0)) return Vec3d(0.0);
        const double angle = straight_spread * square(double(v.x)), turn = 2.0 * pi_d * double(v.y);
        const Vec3d axis = to_light / length;
        const std::array<Vec3d, 2> across = directions_across(axis);
        return axis * std::cos(angle) + (across[0] * std::cos(turn) + across[1] * std::sin(turn)) * std::sin(angle);
    }
    const float u_choice = (u.y - straight_share) / (1.0f - straight_share);
    size_t candidates[caster_candidates];
    float inside[caster_candidates];
    double sums[caster_candidates], sum = 0;
    for (int i = 0; i < caster_candidates; ++i) {
        const auto draw = caster_choice_.sample(fraction(u.x + float(i) / float(caster_candidates)));
        candidates[i] = draw.index;
        inside[i] = draw.u_remapped;
        const Caster& c = casters_[draw.index];
        const Vec3d away = c.center - x;
        sum += 1.0 / (away.dot(away) + c.radius2);
        sums[i] = sum;
    }
    int chosen = 0;
    while (chosen + 1 < caster_candidates && double(u_choice) * sum >= sums[chosen]) ++chosen;

    // Of a caster all around most of the area is far aside
    const Caster& caster = casters_[candidates[chosen]];
    float u_triangle = inside[chosen];
    const Vec3d away = caster.center - x;
    if (away.dot(away) < square(2.0) * caster.radius2) {
        if (u_triangle < 0.5f) {
            const double z = 1.0 - 2.0 * double(v.x), r = safe_sqrt(1.0 - z * z), turn = 2.0 * pi_d * double(v.y);
            return Vec3d(r * std::cos(turn), r * std::sin(turn), z);
        }
        u_triangle = 2.0f * u_triangle - 1.0f;
    }
    const Vec3d to_point = point_on(caster, u_triangle, v) - x;
    const double length = to_point.length();
    return length > 0.0 ? to_point / length : Vec3d(0.0);
}

/// A point of a caster, by area.
Vec3d CausticSampler::point_on(const Caster& caster, float u_triangle, const Vec2& u) const {
    const bool is_instanced = caster.instance != scene::none;
    const geometry::GeometrySet& geometry = world_.geometry;
    const geometry::TriangleMesh& mesh = is_instanced ? geometry.prototypes()[geometry.instances()[caster.instance].prototype][caster.shape] : geometry.shapes()[caster.shape];
    const auto t = uint32_t(triangles_[caster.triangles].sample(u_triangle).index);
    const double root = std::sqrt(double(u.x));
    const double b1 = root * (1.0 - double(u.y)), b2 = root * double(u.y);
    const Vec3d p = Vec3d(mesh.corner(t, 0)) * (1.0 - b1 - b2) + Vec3d(mesh.corner(t, 1)) * b1 + Vec3d(mesh.corner(t, 2)) * b2;
    return is_instanced ? transform_point(p, Mat4d(geometry.instances()[caster.instance].render_from_prototype)) : p;
}

/// Lets a ray choose its events like a path, until it leaves the specular surfaces or may end at
/// the light.
bool CausticSampler::find_events(const Search& search, uint32_t trial, const Vec3& d, SpecularEvents& events) const {
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
            const double passes_at = target.is_infinite ? 0.0 : (target.point.p - Vec3d(ray.o)).dot(Vec3d(ray.d));
            const bool meets_light = passes_at > 0.0 && passes_at < double(hit.t);
            if (meets_light && u.y < end_at_light) break;
        }
        const geometry::SurfacePoint point = geometry::make_surface_point(world_.scene, world_.geometry, ray, hit);
        if (!(caster_weight(point.material) > 0.0)) break;
        cone_width += search.receiver.cone.spread * hit.t;
        const Vec3 wo = -ray.d;
        const geometry::SurfacePoint start = leaving_point(world_, point, wo, search.counts.caustic);
        const shading::Bsdf bsdf = world_.materials.make_bsdf(start, wo, cone_width);
        const auto reflected = bsdf.delta(ScatterKind::Reflect), transmitted = bsdf.delta(ScatterKind::Transmit);
        const float r = reflected ? max_component(reflected->weight) : 0.0f;
        const float t = transmitted && transmitted->eta != 1.0f ? max_component(transmitted->weight) * transmitted->eta * transmitted->eta : 0.0f;
        if (!(r + t > 0.0f)) break;
        const bool has_both = r > 0.0f && t > 0.0f;
        const float share = has_both ? std::clamp(r / (r + t), least_event_share, 1.0f - least_event_share) : float(r > 0.0f);
        const bool reflects = u.x < share;
        const shading::DeltaScattering& chosen = reflects ? *reflected : *transmitted;
        events.events[size_t(events.count++)] = {reflects ? ScatterKind::Reflect : ScatterKind::Transmit, point.material, point.ng.dot(wo) < 0.0f, chosen.eta};
        ray = geometry::spawn_ray(start, chosen.wi);
    }
    // Look whether the chain ends anywhere near the light
    const Vec3d to_light = target.is_infinite ? target.point.n : target.point.p - Vec3d(ray.o);
    return events.count > 0 && to_light.dot(Vec3d(ray.d)) > widest_seed_cosine * to_light.length();
}

/// Newton's method with damping, from a direction whose chain has the events. The residual is the
/// last direction minus that towards the target.
bool CausticSampler::solve(const Search& search, const Vec3d& seed, Solution& out) const {
    const Target& target = search.target;
    struct State {
        Vec3d towards;
        double distance, error;
    };
    const auto follow = [&](const Vec3d& d, const std::array<Vec3d, 2>& across, State& state) {
        if (!follow_chain(world_, search.receiver.point, d, across, out.events, out.chain, search.counts)) return false;
        const Vec3d to_light = target.is_infinite ? target.point.n : target.point.p - out.chain.ray.o;
        state.distance = to_light.length();
        if (!(state.distance > 0.0)) return false;
        state.towards = to_light / state.distance;
        state.error = (out.chain.ray.d - state.towards).length();
        return true;
    };

    Vec3d d = seed;
    std::array<Vec3d, 2> across = directions_across(d);
    State state;
    if (!follow(d, across, state)) return false;
    double damping = 1.0;
    for (int step = 0; step < newton_steps; ++step) {
        const RayDifferential& ray = out.chain.ray;
        // Turn along the great circle to the target, in the tangent plane of the last direction
        const std::array<Vec3d, 2> plane = directions_across(ray.d);
        const double closeness = target.is_infinite ? 0.0 : 1.0 / state.distance;
        const double sine = std::hypot(plane[0].dot(state.towards), plane[1].dot(state.towards));
        const double angle = std::atan2(sine, ray.d.dot(state.towards));
        const double stretch = sine > 0.0 ? std::min(angle, longest_turn) / sine : 1.0;
        double j[2][2], r[2];
        for (size_t row = 0; row < 2; ++row) {
            r[row] = -stretch * plane[row].dot(state.towards);
            for (size_t column = 0; column < 2; ++column) j[row][column] = plane[row].dot(ray.d_by[column] + ray.o_by[column] * closeness);
        }
        const double det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        if (!std::isfinite(det) || det == 0.0) return false;
        double a = -(j[1][1] * r[0] - j[0][1] * r[1]) / det, b = -(j[0][0] * r[1] - j[1][0] * r[0]) / det;
        const double length = std::hypot(a, b);
        if (!std::isfinite(length)) return false;
        if (length < converged_step && state.error < 1.0) {
            out.d = d;
            out.distance = state.distance;
            out.density = target.is_infinite ? 1.0 / std::abs(det) : 1.0 / (std::abs(det) * state.distance * state.distance);
            return true;
        }
        const double shortened = length > longest_step ? longest_step / length : 1.0;
        while (true) {
            const Vec3d moved = d + (across[0] * a + across[1] * b) * (damping * shortened);
            const Vec3d next = moved / moved.length();
            const std::array<Vec3d, 2> next_across = directions_across(next);
            State next_state;
            if (follow(next, next_across, next_state) && (next_state.error < state.error || length < 1e3 * converged_step)) {
                d = next;
                across = next_across;
                state = next_state;
                damping = std::min(1.0, 2.0 * damping);
                break;
            }
            damping *= 0.5;
            if (damping < smallest_damping) return false;
        }
    }
    return false;
}

/// wanted: events without which the seed is none; null = any.
bool CausticSampler::try_seed(const Search& search, uint32_t trial, const SpecularEvents* wanted, Solution& out) const {
    const Receiver& at = search.receiver;
    const Vec3d seed = seed_direction(search, trial);
    if (seed == Vec3d(0.0)) return false;
    const Vec3 d = to_float(seed);
    // Nothing opaque takes light from behind
    if (!at.bsdf.has_transmission() && (d.dot(at.point.ng) > 0.0f) != (at.wo.dot(at.point.ng) > 0.0f)) return false;
    if (!find_events(search, trial, d, out.events)) return false;
    if (wanted && !(*wanted == out.events)) return false;
    return solve(search, seed, out);
}

bool CausticSampler::is_blocked(const Search& search, const Solution& solution, const geometry::SurfacePoint& last) const {
    geometry::Ray ray = geometry::spawn_ray(last, to_float(solution.chain.ray.d));
    if (!search.target.is_infinite) ray.t_max = float(solution.distance / (1.0 + flush_light_margin));
    ++search.counts.caustic;
    return world_.accelerator->is_occluded(ray);
}

/// What the solution brings over the probability to find it; black when it is none of the chains
/// that finds() means.
Rgb CausticSampler::contribution(const Search& search, const Solution& solution) const {
    const Receiver& at = search.receiver;
    const Target& target = search.target;
    const SpecularChain& chain = solution.chain;
    const Vec3 wi = to_float(solution.d);
    Rgb L = at.bsdf.f(at.wo, wi) * at.bsdf.cosine(wi);
    if (is_black(L)) return L;
    L *= world_.lights.radiance_at(target.light, target.point, chain.ray.o, chain.ray.d);
    if (is_black(L)) return L;
    L *= world_.lights.light(target.light).specular_multiplier;

    // Scatter as the path tracer does
    float cone_width = at.cone.width;
    geometry::SurfacePoint last;
    for (size_t i = 0; i < size_t(solution.events.count); ++i) {
        const geometry::SurfacePoint& point = chain.points[i];
        const Vec3 wo = -to_float(chain.directions[i]);
        cone_width += at.cone.spread * float(chain.lengths[i]);
        if (world_.materials.material_has_presence(point.material)) L *= world_.materials.presence(point, cone_width);
        last = leaving_point(world_, point, wo, search.counts.caustic);
        const shading::Bsdf bsdf = world_.materials.make_bsdf(last, wo, cone_width);
        if (!is_plain_vertex(world_, last, bsdf)) return Rgb(0.0f);
        const auto scattered = bsdf.delta(solution.events.events[i].kind);
        if (!scattered || (solution.events.events[i].kind == ScatterKind::Transmit && scattered->eta == 1.0f)) return Rgb(0.0f);
        L *= scattered->weight;
        if (is_black(L)) return L;
    }
    if (is_blocked(search, solution, last)) return Rgb(0.0f);
    double scale = solution.density / (target.point.pdf * target.pmf);
    if (!target.is_infinite) scale *= std::abs(target.point.n.dot(chain.ray.d));
    return L * float(scale);
}

std::optional<CausticSampler::Found> CausticSampler::sample(const Receiver& receiver,
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
        if (try_seed(search, trial, &first.events, other) && (other.d - first.d).length() < same_direction) break;
    }
    if (trial == trial_cap) ++counts.caustics_capped;
    return Found{L * float(trial), first.events.count, search.target.light};
}

std::unique_ptr<const CausticSampler> make_caustic_sampler(Caustics mode, const World& world) {
    switch (mode) {
        case Caustics::Path:
            break;
        case Caustics::Manifold:
            return std::make_unique<CausticSampler>(world);
        case Caustics::Auto:
            return std::make_unique<CausticSampler>(world, CausticSampler::auto_largest_light);
    }
    return nullptr;
}

}  // namespace velatura::integrator
