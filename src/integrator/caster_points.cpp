// SPDX-License-Identifier: Apache-2.0
#include "integrator/caster_points.h"

#include <cmath>
#include <limits>

namespace velatura::integrator {

std::optional<CasterPoint> CasterPoints::sample(uint32_t index_of_caster,
                                                const CasterNumbers& numbers,
                                                float time) const {
    const CasterShapes::Caster& caster = shapes_.casters()[index_of_caster];
    const sampling::Distribution1D::Sample piece =
        shapes_.choice_in(caster).sample(numbers.u_piece);
    if (!(piece.pmf > 0.0)) return std::nullopt;
    Mat4d render_from_shape;
    if (caster.instance != scene::none)
        render_from_shape =
            Mat4d(geometry::render_from_prototype(world_.scene.instances[caster.instance], time));

    const geometry::TriangleMesh& mesh = shapes_.mesh(caster);
    const auto index = uint32_t(piece.index);
    std::optional<CasterPoint> out =
        mesh.primitives()
            ? primitive_point(caster, *mesh.primitives(), index, render_from_shape, numbers, time)
            : triangle_point(caster, mesh, index, render_from_shape, numbers, time);
    if (!out || !holds(out->point)) return std::nullopt;
    out->pdf *= piece.pmf;
    return out;
}

std::optional<CasterPoint> CasterPoints::triangle_point(const CasterShapes::Caster& caster,
                                                        const geometry::TriangleMesh& mesh,
                                                        uint32_t triangle,
                                                        const Mat4d& render_from_shape,
                                                        const CasterNumbers& numbers,
                                                        float time) const {
    const auto corner = [&](int k) {
        return transform_point(Vec3d(mesh.corner(triangle, k, time)), render_from_shape);
    };
    const Vec3d c0 = corner(0), e1 = corner(1) - c0, e2 = corner(2) - c0;
    const Vec3d across = e1.cross(e2);
    const double area = 0.5 * across.length();
    if (!(area > 0.0)) return std::nullopt;
    const float root = std::sqrt(numbers.u_point.x);
    geometry::Hit hit;
    hit.b1 = root * (1.0f - numbers.u_point.y);
    hit.b2 = root * numbers.u_point.y;
    hit.instance = caster.instance;
    hit.shape = caster.shape;
    hit.triangle = triangle;
    // Large triangles are met anew along the ray: it goes through the point
    const double height = std::sqrt(area);
    const Vec3d up = normalize(across);
    const Vec3d p = c0 + e1 * double(hit.b1) + e2 * double(hit.b2);
    geometry::Ray ray{to_float(p + up * height), to_float(-up)};
    ray.time = time;
    hit.t = float(height);
    return CasterPoint{geometry::make_surface_point(world_.scene, world_.geometry, ray, hit),
                       1.0 / area};
}

std::optional<CasterPoint> CasterPoints::primitive_point(const CasterShapes::Caster& caster,
                                                         const geometry::PrimitiveSet& primitives,
                                                         uint32_t primitive,
                                                         const Mat4d& render_from_shape,
                                                         const CasterNumbers& numbers,
                                                         float time) const {
    if (!primitives.is_convex()) return std::nullopt;
    const Box3d box = primitives.bounds(primitive).box;
    if (box.isEmpty()) return std::nullopt;
    const BoundingSphere ball = sphere_around(box);
    const double radius = std::sqrt(ball.radius2);

    // A uniform direction, and a uniform point of the disk across the ball
    const double z = 1.0 - 2.0 * double(numbers.u_direction.x), r = safe_sqrt(1.0 - z * z),
                 turn = 2.0 * pi_d * double(numbers.u_direction.y);
    const Vec3d d(r * std::cos(turn), r * std::sin(turn), z);
    const Vec3d side = normalize(std::abs(d.x) < 0.6 ? d.cross(Vec3d(1.0, 0.0, 0.0))
                                                     : d.cross(Vec3d(0.0, 1.0, 0.0)));
    const double s = radius * std::sqrt(double(numbers.u_point.x)),
                 at = 2.0 * pi_d * double(numbers.u_point.y);
    const Vec3d o =
        ball.center + (side * std::cos(at) + d.cross(side) * std::sin(at)) * s - d * (2.0 * radius);
    const std::optional<geometry::PrimitiveHit> met =
        primitives.intersect(primitive, o, d, std::numeric_limits<float>::infinity());
    if (!met) return std::nullopt;
    const geometry::PrimitiveSurface surface = primitives.surface(primitive, o, d, *met);

    // Density over the area in the shape's space, then over that in render space
    const Vec3d n = normalize(surface.facet_n != Vec3d(0.0) ? surface.facet_n : surface.n);
    const double enlarged = (n * cofactor_matrix(render_from_shape)).length();
    if (!(enlarged > 0.0)) return std::nullopt;
    geometry::Hit hit;
    hit.t = float(met->t);
    hit.b1 = met->u;
    hit.b2 = met->v;
    hit.instance = caster.instance;
    hit.shape = caster.shape;
    hit.triangle = primitive;
    geometry::Ray ray{to_float(transform_point(o, render_from_shape)),
                      to_float(transform_direction(d, render_from_shape))};
    ray.time = time;
    return CasterPoint{geometry::make_surface_point(world_.scene, world_.geometry, ray, hit),
                       1.0 / (4.0 * pi_d * ball.radius2 * enlarged)};
}

}  // namespace velatura::integrator
