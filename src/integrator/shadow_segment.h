// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/surface_point.h"
#include "integrator/interior.h"
#include "integrator/ray_counts.h"
#include "lights/light_sample.h"
#include "shading/material_evaluator.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace velatura::integrator {

/// Surfaces that one straight segment may pass through (cut-outs, IOR 1) before it counts as
/// blocked.
inline constexpr uint32_t pass_through_limit = 1024;

/// How far short of a light at distance t from o a shadow ray ends, and how far beyond a surface
/// there a segment collects lights: one flush with a surface is neither shadowed nor missed through
/// rounding, by both samplers alike, but for light that leaves it within half a degree of its
/// plane. Some dozens of what the coordinates there may have been rounded by, hence independent of
/// scale.
inline float flush_light_margin(const Vec3& o, float t) {
    const float reach = std::max(std::abs(o.x), std::max(std::abs(o.y), std::abs(o.z))) + t;
    return 0x1p-18f * reach;
}

/// The way from a surface to a sampled light, layer by layer of cut-outs. It is aimed anew from
/// each: a rest carried along would creep beyond the light by the offsets of the rays, and emissive
/// triangles are there to be hit.
struct ShadowSegment {
    ShadowSegment(const geometry::SurfacePoint& from, const lights::LightSample& light)
        : wi(light.wi), is_surface(light.is_surface) {
        is_infinite = !is_surface && !std::isfinite(light.distance);
        if (is_surface) {
            target = light.target;
        } else if (!is_infinite) {
            target = from.p + light.wi * light.distance;
            margin = flush_light_margin(from.p, light.distance);
        }
        continue_from(from);
    }

    /// False: nothing is left before the light.
    bool continue_from(const geometry::SurfacePoint& point) {
        if (is_infinite) {
            ray = geometry::spawn_ray(point, wi);
            return true;
        }
        ray = geometry::spawn_ray_to(point, target);
        const float rest = std::sqrt(ray.d.dot(ray.d));
        if (!is_surface && rest > 0.0f) ray.t_max = 1.0f - margin / rest;
        return rest > 0.0f && ray.t_max > 0.0f;
    }

    /// Of the part of the ray up to t, in render-space units.
    float length(float t) const { return is_infinite ? t : t * std::sqrt(ray.d.dot(ray.d)); }

    /// Ends the ray no further than this away [render-space units], for this once.
    void end_at(float distance) { ray.t_max = std::min(ray.t_max, distance / length(1.0f)); }

    geometry::Ray ray;
    Vec3 wi, target = Vec3(0.0f);
    bool is_surface, is_infinite = false;
    float margin = 0;
};

struct World;

/// What a surface lets pass straight on of light that comes against d. surrounding_index: see
/// MaterialEvaluator::make_bsdf.
Rgb straight_through(const shading::MaterialEvaluator& materials,
                     const geometry::SurfacePoint& point,
                     const Vec3& d,
                     float cone_width,
                     float surrounding_index = 1.0f);

/// The same of light that is in `interior` before and after. point: where it goes on from. counts:
/// see NestedDielectrics::cross.
Rgb pass_dielectrics(const World& world,
                     const Vec3& d,
                     float cone_width,
                     geometry::SurfacePoint& point,
                     Interior& interior,
                     RayCounts* counts);

}  // namespace velatura::integrator
