// SPDX-License-Identifier: Apache-2.0
#include "geometry/fiber.h"

#include "geometry/geometry_set.h"
#include "geometry/triangle_mesh.h"
#include "scene/scene.h"

#include <algorithm>
#include <cmath>

namespace velatura::geometry {

namespace {

/// In render space, `along` unit.
std::optional<PrimitiveFiber> placed_fiber(const scene::Scene& scene, const SurfacePoint& point) {
    const PrimitiveSet* set = point.mesh->primitives();
    PrimitiveFiber fiber;
    if (!set || !set->fiber(point.triangle, {0.0, point.b1, point.b2}, fiber)) return std::nullopt;
    if (point.instance != scene::none) {
        const Mat4d forward(render_from_prototype(scene.instances[point.instance], point.time));
        fiber.middle = transform_point(fiber.middle, forward);
        fiber.along = transform_direction(fiber.along, forward);
        fiber.side = transform_direction(fiber.side, forward);
    }
    const double length = fiber.along.length();
    if (!(length > 0.0)) return std::nullopt;
    fiber.along /= length;
    return fiber;
}

/// The part of v across a unit vector, made unit; zero where there is none.
Vec3d unit_across(const Vec3d& v, const Vec3d& along) {
    const Vec3d across = v - along * along.dot(v);
    const double length = across.length();
    return length > 1e-9 ? across / length : Vec3d(0.0);
}

}  // namespace

std::optional<Fiber> fiber_at(const scene::Scene& scene,
                              const SurfacePoint& point,
                              const Vec3& wo) {
    const std::optional<PrimitiveFiber> place = placed_fiber(scene, point);
    if (!place) return std::nullopt;
    const Vec3d& along = place->along;
    const Vec3d view = unit_across(Vec3d(wo), along);
    Fiber fiber{to_float(along), point.ng, 0.0f};
    if (place->side != Vec3d(0.0)) {
        const double turn = along.dot(place->side.cross(view));
        const float across = 2.0f * point.b2 - 1.0f;
        fiber.h = turn < 0.0 ? -across : across;
        return fiber;
    }
    Vec3d n = unit_across(Vec3d(point.ng), along);
    // The very end of a strand
    if (n == Vec3d(0.0)) return fiber;
    fiber.ng = to_float(n);
    if (n.dot(view) < 0.0) n = -n;
    fiber.h = float(std::clamp(along.dot(n.cross(view)), -1.0, 1.0));
    return fiber;
}

std::optional<SurfacePoint> across_fiber(const scene::Scene& scene, const SurfacePoint& point) {
    // Pieces may be cones that stray from their curve
    constexpr double widening = 1.0 + 0x1p-9;
    const std::optional<PrimitiveFiber> place = placed_fiber(scene, point);
    if (!place || place->side != Vec3d(0.0)) return std::nullopt;
    const Vec3d from_middle = Vec3d(point.p) - place->middle;
    const Vec3d out = from_middle - place->along * place->along.dot(from_middle);
    const double radius = out.length();
    if (!(radius > 0.0)) return std::nullopt;
    SurfacePoint start = point;
    start.p = to_float(Vec3d(point.p) - out);
    start.ng = start.ns = to_float(out / radius);
    for (int k = 0; k < 3; ++k)
        start.p_error[k] += float(widening * radius) * std::abs(start.ng[k]);
    return start;
}

}  // namespace velatura::geometry
