// SPDX-License-Identifier: Apache-2.0
#include "integrator/subsurface_walk.h"

#include "media/henyey_greenstein.h"
#include "sampling/warp.h"
#include "scene/effect_calls.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace velatura::integrator {

using sampling::Purpose;

namespace {

/// Faces that a straight way meets from their wrong side before it counts as lost.
constexpr int max_wrong_sides = 16;

/// Walks end by roulette from this many scatterings on.
constexpr uint32_t roulette_start = 16;

/// Keeps the random numbers of the steps of one walk apart from those of another at the same
/// bounce.
constexpr uint32_t walks_per_bounce = 2048;

float sum(const Rgb& c) {
    return c.x + c.y + c.z;
}

Rgb exponential(const Rgb& sigma, float distance) {
    return {std::exp(-sigma.x * distance), std::exp(-sigma.y * distance),
            std::exp(-sigma.z * distance)};
}

}  // namespace

SubsurfaceWalk::SubsurfaceWalk(const scene::Scene& scene,
                               const geometry::GeometrySet& geometry,
                               const shading::MaterialEvaluator& materials)
    : scene_(scene), geometry_(geometry) {
    const auto scatters = [&](scene::MaterialId m) { return materials.has_subsurface(m); };
    const auto add = [&](const scene::Shape& shape, scene::MaterialId override_material,
                         const geometry::TriangleMesh& mesh) {
        if (has_material(shape, override_material, scatters)) trees_.add(mesh);
    };
    for (size_t s = 0; s < scene.shapes.size(); ++s)
        add(scene.shapes[s], scene::none, geometry.shapes()[s]);
    for (const scene::Instance& instance : scene.instances) {
        const std::vector<scene::Shape>& shapes = scene.prototypes[instance.prototype].shapes;
        for (size_t s = 0; s < shapes.size(); ++s)
            add(shapes[s], instance.material_override,
                geometry.prototypes()[instance.prototype][s]);
    }
}

std::optional<geometry::SurfacePoint> SubsurfaceWalk::find_exit(const Solid& solid,
                                                                const geometry::Ray& ray,
                                                                float& t) const {
    geometry::Ray rest = ray;
    t = 0;
    for (int i = 0; i < max_wrong_sides; ++i) {
        const std::optional<PlacedMeshHit> hit =
            intersect_placed_mesh(scene_, geometry_, solid.placed, solid.backward, rest);
        if (!hit) return std::nullopt;
        t += hit->t;
        if (hit->point.ng.dot(ray.d) * solid.outside > 0.0f) return hit->point;
        // Met from outside: by rounding, or where the mesh overlaps itself
        const float left = rest.t_max - hit->t;
        rest = geometry::spawn_ray(hit->point, ray.d);
        rest.t_max = left;
    }
    return std::nullopt;
}

std::optional<SubsurfaceWalk::Exit> SubsurfaceWalk::walk(const geometry::SurfacePoint& from,
                                                         const Vec3& n,
                                                         const Vec3& wo,
                                                         const shading::Subsurface& below,
                                                         const sampling::PixelSampler& sampler,
                                                         int bounce,
                                                         uint32_t repeat,
                                                         RayCounts& counts) const {
    scene::count_call(scene::Effect::Subsurface);
    const accel::Accelerator* const tree = trees_.find(*from.mesh);
    if (!tree) return std::nullopt;
    Solid solid{
        {from.instance, from.shape, tree}, from.ng.dot(wo) < 0.0f ? -1.0f : 1.0f, {}, nullptr};
    if (from.instance != scene::none)
        solid.backward =
            &geometry_.instance(from.instance, from.time, solid.storage).prototype_from_render;

    // Enter as evenly as light leaves a matt surface
    const Vec3 entry =
        sampling::cosine_hemisphere(sampler.get_2d(bounce, Purpose::SubsurfaceEntry, repeat));
    Vec3 d = renormalize(Frame::from_z(-n).from_local(entry));
    if (d.dot(from.ng) * solid.outside > 0.0f) return std::nullopt;
    geometry::SurfacePoint inside = from;
    inside.side = 0;
    geometry::Ray ray = geometry::spawn_ray(inside, d);
    const media::HenyeyGreenstein phase(below.anisotropy);
    Rgb throughput(1.0f);
    for (uint32_t step = 0; step < max_steps; ++step) {
        const uint32_t number = step * walks_per_bounce + repeat;
        // Draw how far it goes by one channel, and weigh it by all
        const Rgb channels = throughput * below.albedo;
        const float all = sum(channels);
        if (!(all > 0.0f)) return std::nullopt;
        const float u = sampler.get_1d(bounce, Purpose::SubsurfaceChannel, number) * all;
        const int channel = u < channels.x ? 0 : u < channels.x + channels.y ? 1 : 2;
        const float v = sampler.get_1d(bounce, Purpose::SubsurfaceDistance, number);
        ray.t_max = -std::log1p(-v) / below.sigma_t[channel];
        if (!(ray.t_max > 0.0f)) ray.t_max = std::numeric_limits<float>::min();
        float t = 0;
        ++counts.indirect;
        if (const auto exit = find_exit(solid, ray, t)) {
            const Rgb passed = exponential(below.sigma_t, t);
            throughput *= passed * (all / sum(channels * passed));
            return Exit{*exit, exit->ng * solid.outside, throughput};
        }
        const Rgb scattered = exponential(below.sigma_t, ray.t_max) * below.sigma_t;
        throughput *= scattered * below.albedo * (all / sum(channels * scattered));

        if (step >= roulette_start) {
            const float survival = std::min(max_component(throughput), 1.0f);
            if (sampler.get_1d(bounce, Purpose::SubsurfaceRoulette, number) >= survival)
                return std::nullopt;
            throughput /= survival;
        }
        ray.o += ray.d * ray.t_max;
        ray.d = renormalize(
            phase.sample(ray.d, sampler.get_2d(bounce, Purpose::SubsurfaceDirection, number)));
    }
    ++counts.walks_abandoned;
    return std::nullopt;
}

size_t SubsurfaceWalk::bytes() const {
    return trees_.bytes();
}

}  // namespace velatura::integrator
