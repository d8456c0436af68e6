// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/ray_counts.h"
#include "integrator/world.h"
#include "shading/bsdf.h"

#include <array>
#include <cstdint>
#include <optional>

namespace velatura::integrator {

/// Longest chain of perfect mirrors and smooth interfaces that is solved for.
inline constexpr int longest_specular_chain = 8;

/// What happens at one vertex of a specular chain.
struct SpecularEvent {
    shading::ScatterKind kind = shading::ScatterKind::Reflect;
    scene::MaterialId material = scene::none;
    bool is_behind = false;  ///< met from the side against the geometric normal
    float eta = 1;           ///< as in BsdfSample

    friend bool operator==(const SpecularEvent&, const SpecularEvent&) = default;
};

/// The events of a chain, from the receiver to the light: what distinguishes one family of
/// solutions from another.
struct SpecularEvents {
    int count = 0;
    std::array<SpecularEvent, longest_specular_chain> events = {};

    const SpecularEvent* begin() const { return events.data(); }

    const SpecularEvent* end() const { return events.data() + count; }

    friend bool operator==(const SpecularEvents& a, const SpecularEvents& b);
};

/// A ray in double with its derivatives by two parameters.
/// Ref: Igehy 1999, "Tracing Ray Differentials".
struct RayDifferential {
    Vec3d o, d;  ///< d unit
    std::array<Vec3d, 2> o_by, d_by;
};

/// Where a chain that was followed leaves its last surface.
struct SpecularChain {
    RayDifferential ray;  ///< by the two components of the first direction across itself
    std::array<geometry::SurfacePoint, longest_specular_chain> points;
    std::array<Vec3d, longest_specular_chain + 1> directions;  ///< of the segments, unit
    std::array<double, longest_specular_chain> lengths;        ///< of those up to each point
};

/// Where rays leave a surface: near the smooth one that coarse facets stand for, unless something
/// lies between. Nothing: from the point itself.
std::optional<geometry::SurfacePoint> leaving_point(const World& world,
                                                    const geometry::SurfacePoint& point,
                                                    const Vec3& wo,
                                                    uint64_t& ray_count);

/// Whether a delta scattering at the vertex is the one that follow_chain() computes: by the
/// interpolated normal itself, neither mapped nor bent. point: where the ray leaves.
bool is_plain_vertex(const World& world,
                     const geometry::SurfacePoint& point,
                     const shading::Bsdf& bsdf);

/// Two unit vectors across the unit vector d.
std::array<Vec3d, 2> directions_across(const Vec3d& d);

/// Follows the events from a point along the unit direction d through the scene, as the path tracer
/// scatters at plain vertices, but in double and with derivatives by d along `across`.
/// Returns: nothing when some surface has no such event.
bool follow_chain(const World& world,
                  const geometry::SurfacePoint& from,
                  const Vec3d& d,
                  const std::array<Vec3d, 2>& across,
                  const SpecularEvents& events,
                  SpecularChain& out,
                  RayCounts& counts);

}  // namespace velatura::integrator
