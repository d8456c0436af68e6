// SPDX-License-Identifier: Apache-2.0
#include "integrator/seen_through.h"

#include "integrator/pass_through.h"
#include "integrator/shadow_segment.h"
#include "integrator/specular_chain.h"

#include <optional>

namespace velatura::integrator {

namespace {

/// Surfaces in a row that mattes pass.
constexpr int max_surfaces = 64;
/// What reflects less in that direction is polish, and no mirror.
constexpr float min_mirror_reflectance = 0.5f;

struct Passage {
    shading::ScatterKind kind;
    Vec3 wi;
};

/// Where the matte goes from a surface; nothing: it is the surface's own.
std::optional<Passage> passage_of(const MatteThrough& through, const shading::Bsdf& bsdf) {
    using shading::ScatterKind;
    if (bsdf.has_non_delta()) return std::nullopt;
    if (bsdf.has_transmission()) {
        if (!through.refraction) return std::nullopt;
        if (const auto refracted = bsdf.delta(ScatterKind::Transmit))
            return Passage{ScatterKind::Transmit, refracted->wi};
        // Total reflection, on the way through a solid
        if (const auto reflected = bsdf.delta(ScatterKind::Reflect))
            return Passage{ScatterKind::Reflect, reflected->wi};
        return std::nullopt;
    }
    if (!through.reflection) return std::nullopt;
    const auto reflected = bsdf.delta(ScatterKind::Reflect);
    if (!reflected || !(luminance(reflected->weight) >= min_mirror_reflectance))
        return std::nullopt;
    return Passage{ScatterKind::Reflect, reflected->wi};
}

/// The next surface along the path's ray that is one to the camera; nothing: there is none.
std::optional<geometry::SurfacePoint> next_surface(
    const TracerContext& context,
    Path& path,
    std::optional<NestedDielectrics::Crossing>& storage,
    const NestedDielectrics::Crossing*& crossing) {
    const World& world = context.world;
    while (path.pass_count < pass_through_limit) {
        ++path.counts->indirect;
        const geometry::Hit hit = world.intersect(path.ray, path.kind);
        if (!hit.is_valid()) return std::nullopt;
        const geometry::SurfacePoint point =
            geometry::make_surface_point(world.scene, world.geometry, path.ray, hit);
        path.cone_width += path.cone_spread * hit.t;
        path.segment_t = hit.t;
        crossing = nullptr;
        if (world.materials.has_presence() && pass_cutout(context, path, point)) continue;
        if (!intersect_dielectrics(context, path, point, storage, crossing)) continue;
        return point;
    }
    return std::nullopt;
}

}  // namespace

std::array<uint32_t, accumulate::matte_kinds.size()> matte_ids_seen_through(
    const TracerContext& context,
    const Path& seen,
    const geometry::SurfacePoint& point,
    const Vertex& vertex) {
    const World& world = context.world;
    const MatteThrough& through = context.options.matte_through;
    std::optional<Passage> passage = passage_of(through, vertex.bsdf);
    if (!passage) return context.options.mattes->ids(point);
    Path path = seen;
    geometry::SurfacePoint start = vertex.point;
    std::optional<NestedDielectrics::Crossing> storage;
    const NestedDielectrics::Crossing* crossing = vertex.crossing;
    for (int i = 0; i < max_surfaces; ++i) {
        const bool transmits = passage->kind == shading::ScatterKind::Transmit;
        if (transmits && keeps_interior(world))
            cross(world, crossing, start, -path.ray.d, passage->wi, path.interior);
        path.kind = transmits ? scene::RayKind::Refraction : scene::RayKind::Reflection;
        path.ray = geometry::spawn_ray(start, passage->wi);
        path.ray.time = start.time;
        path.pass_count = 0;
        ++path.bounce;
        const auto next = next_surface(context, path, storage, crossing);
        if (!next) return {};
        const Vec3 wo = -path.ray.d;
        const auto moved = leaving_point(world, *next, wo, path.counts->shadow);
        start = moved ? *moved : crossing ? crossing->point : *next;
        const shading::Bsdf bsdf = world.materials.make_bsdf(
            start, wo, path.cone_width, crossing ? crossing->surrounding_index : 1.0f, path.spread);
        passage = passage_of(through, bsdf);
        if (!passage) return context.options.mattes->ids(*next);
    }
    return context.options.mattes->ids(start);
}

}  // namespace velatura::integrator
