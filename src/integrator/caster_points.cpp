// SPDX-License-Identifier: Apache-2.0
#include "integrator/caster_points.h"

#include "sampling/warp.h"

#include <cmath>
#include <limits>

namespace velatura::integrator {

std::optional<CasterPoint> CasterPoints::sample(uint32_t index_of_caster,
                                                const CasterNumbers& numbers,
                                                float time) const {
    const CasterShapes::Caster& caster = shapes_.casters()[index_of_caster];
    const sampling::Distribution1D::Sample chosen =
        shapes_.choice_in(caster).sample(numbers.u_piece);
    if (!(chosen.pmf > 0.0)) return std::nullopt;
    Piece piece{shapes_.mesh(caster), {}, {}, time};
    piece.hit.instance = caster.instance;
    piece.hit.shape = caster.shape;
    piece.hit.triangle = uint32_t(chosen.index);
    if (caster.instance != scene::none)
        piece.render_from_shape =
            Mat4d(geometry::render_from_prototype(world_.scene.instances[caster.instance], time));

    std::optional<CasterPoint> out =
        piece.mesh.primitives() ? primitive_point(piece, numbers) : triangle_point(piece, numbers);
    if (!out || !holds(out->point)) return std::nullopt;
    out->pdf *= chosen.pmf;
    return out;
}

/// Where the ray o + t·d (render space) meets the piece, as piece.hit says.
geometry::SurfacePoint CasterPoints::point_at(const Piece& piece,
                                              const Vec3d& o,
                                              const Vec3d& d) const {
    geometry::Ray ray{to_float(o), to_float(d)};
    ray.time = piece.time;
    return geometry::make_surface_point(world_.scene, world_.geometry, ray, piece.hit);
}

std::optional<CasterPoint> CasterPoints::triangle_point(Piece piece,
                                                        const CasterNumbers& numbers) const {
    const auto corner = [&](int k) {
        return transform_point(Vec3d(piece.mesh.corner(piece.hit.triangle, k, piece.time)),
                               piece.render_from_shape);
    };
    const Vec3d c0 = corner(0), e1 = corner(1) - c0, e2 = corner(2) - c0;
    const Vec3d across = e1.cross(e2);
    const double area = 0.5 * across.length();
    if (!(area > 0.0)) return std::nullopt;
    const float root = std::sqrt(numbers.u_point.x);
    piece.hit.b1 = root * (1.0f - numbers.u_point.y);
    piece.hit.b2 = root * numbers.u_point.y;
    // Large triangles are met anew along the ray: it goes through the point
    const double height = std::sqrt(area);
    const Vec3d up = normalize(across);
    const Vec3d p = c0 + e1 * double(piece.hit.b1) + e2 * double(piece.hit.b2);
    piece.hit.t = float(height);
    return CasterPoint{point_at(piece, p + up * height, -up), 1.0 / area};
}

std::optional<CasterPoint> CasterPoints::primitive_point(Piece piece,
                                                         const CasterNumbers& numbers) const {
    const geometry::PrimitiveSet& primitives = *piece.mesh.primitives();
    const uint32_t primitive = piece.hit.triangle;
    if (!primitives.is_convex()) return std::nullopt;
    const Box3d box = primitives.bounds(primitive).box;
    if (box.isEmpty()) return std::nullopt;
    const BoundingSphere ball = sphere_around(box);
    const double radius = std::sqrt(ball.radius2);

    // A uniform direction, and a uniform point of the disk across the ball
    const Vec3 toward = sampling::uniform_sphere(numbers.u_direction);
    const Frame frame = Frame::from_z(toward);
    const Vec2d disk = sampling::concentric_disk(Vec2d(numbers.u_point)) * radius;
    const Vec3d d = normalize(Vec3d(toward));
    const Vec3d o =
        ball.center + Vec3d(frame.x) * disk.x + Vec3d(frame.y) * disk.y - d * (2.0 * radius);
    const std::optional<geometry::PrimitiveHit> met =
        primitives.intersect(primitive, o, d, std::numeric_limits<float>::infinity());
    if (!met) return std::nullopt;
    const geometry::PrimitiveSurface surface = primitives.surface(primitive, o, d, *met);

    // Density over the area in the shape's space, then over that in render space
    const Vec3d n = normalize(surface.facet_n != Vec3d(0.0) ? surface.facet_n : surface.n);
    const double enlarged = (n * cofactor_matrix(piece.render_from_shape)).length();
    if (!(enlarged > 0.0)) return std::nullopt;
    piece.hit.t = float(met->t);
    piece.hit.b1 = met->u;
    piece.hit.b2 = met->v;
    return CasterPoint{point_at(piece, transform_point(o, piece.render_from_shape),
                                transform_direction(d, piece.render_from_shape)),
                       1.0 / (4.0 * pi_d * ball.radius2 * enlarged)};
}

}  // namespace velatura::integrator
