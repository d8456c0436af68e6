// SPDX-License-Identifier: Apache-2.0
#include "integrator/specular_chain.h"

#include "geometry/fiber.h"
#include "lights/emitter.h"

#include <algorithm>
#include <cmath>

namespace velatura::integrator {

using shading::ScatterKind;

namespace {

/// A scalar and a vector with their derivatives by the two parameters of a chain.
struct Number {
    double v = 0;
    double by[2] = {0, 0};
};

struct Vector {
    Vec3d v = Vec3d(0.0);
    Vec3d by[2] = {Vec3d(0.0), Vec3d(0.0)};
};

Number operator-(const Number& a, const Number& b) {
    return {a.v - b.v, {a.by[0] - b.by[0], a.by[1] - b.by[1]}};
}

Number operator*(const Number& a, double s) {
    return {a.v * s, {a.by[0] * s, a.by[1] * s}};
}

Number operator*(const Number& a, const Number& b) {
    return {a.v * b.v, {a.by[0] * b.v + a.v * b.by[0], a.by[1] * b.v + a.v * b.by[1]}};
}

Number operator/(const Number& a, const Number& b) {
    const double q = a.v / b.v;
    return {q, {(a.by[0] - q * b.by[0]) / b.v, (a.by[1] - q * b.by[1]) / b.v}};
}

Number square_root(const Number& a) {
    const double root = std::sqrt(a.v);
    return {root, {0.5 * a.by[0] / root, 0.5 * a.by[1] / root}};
}

Vector operator+(const Vector& a, const Vector& b) {
    return {a.v + b.v, {a.by[0] + b.by[0], a.by[1] + b.by[1]}};
}

Vector operator*(const Vector& a, double s) {
    return {a.v * s, {a.by[0] * s, a.by[1] * s}};
}

Vector operator*(const Vector& a, const Number& s) {
    return {a.v * s.v, {a.by[0] * s.v + a.v * s.by[0], a.by[1] * s.v + a.v * s.by[1]}};
}

Vector operator/(const Vector& a, const Number& s) {
    return a * (Number{1.0} / s);
}

Number dot(const Vector& a, const Vector& b) {
    return {a.v.dot(b.v),
            {a.by[0].dot(b.v) + a.v.dot(b.by[0]), a.by[1].dot(b.v) + a.v.dot(b.by[1])}};
}

Number dot(const Vector& a, const Vec3d& b) {
    return {a.v.dot(b), {a.by[0].dot(b), a.by[1].dot(b)}};
}

Vector constant(const Vec3d& v) {
    return {v};
}

Vector unit(const Vector& a) {
    return a / square_root(dot(a, a));
}

/// The triangle that was hit, in render space and double.
struct Facet {
    Vec3d corners[3];
    Vec3d normals[3];  ///< unit in shape space, carried over; only if is_smooth
    bool is_smooth = false;
};

/// False: its normals are not of the kind that is interpolated over the whole triangle.
bool make_facet(const World& world, const geometry::SurfacePoint& point, Facet& out) {
    const geometry::TriangleMesh& mesh = *point.mesh;
    for (int k = 0; k < 3; ++k) out.corners[k] = Vec3d(mesh.corner(point.triangle, k, point.time));
    out.is_smooth = mesh.corner_normals(point.triangle, out.normals, point.time);
    if (!out.is_smooth && mesh.has_normals()) return false;
    if (out.is_smooth) {
        for (Vec3d& n : out.normals) n /= n.length();
    }
    if (point.instance == scene::none) return true;
    const Mat4d forward(
        geometry::render_from_prototype(world.scene.instances[point.instance], point.time));
    for (Vec3d& c : out.corners) c = transform_point(c, forward);
    if (!out.is_smooth) return true;
    const Mat3d normal_matrix = cofactor_matrix(forward);
    for (Vec3d& n : out.normals) n = n * normal_matrix;
    return true;
}

/// Barycentric weights of a point of the facet's plane.
struct Weights {
    Number b[3];
};

Weights weights_of(const Facet& facet, const Vec3d& plane, const Vector& p) {
    const Vec3d e1 = facet.corners[1] - facet.corners[0];
    const Vec3d e2 = facet.corners[2] - facet.corners[0];
    const double area2 = plane.dot(plane);
    const Vector q = p + constant(-facet.corners[0]);
    Weights w;
    w.b[1] = dot(q, e2.cross(plane) * (1.0 / area2));
    w.b[2] = dot(q, plane.cross(e1) * (1.0 / area2));
    w.b[0] = Number{1.0} - w.b[1] - w.b[2];
    return w;
}

/// Normal of the smooth surface that a facet stands for at its point p; not unit.
Vector facet_normal(const Facet& facet, const Weights& w) {
    return constant(facet.normals[0]) * w.b[0] + constant(facet.normals[1]) * w.b[1] +
           constant(facet.normals[2]) * w.b[2];
}

/// The same of a curved surface, which is known at the point from which p leaves along it.
Vector curved_normal(const geometry::PrimitiveSurface& surface, const Vector& p) {
    return {surface.n, {p.by[0] * surface.normal_by_p, p.by[1] * surface.normal_by_p}};
}

/// Point above the facet that geometry::lifted() starts rays from; see there. n: normals on the
/// side of the ray, unit.
Vector lifted_point(const Facet& facet, const Vec3d normals[3], const Weights& w, const Vector& p) {
    Vector lift;
    for (int k = 0; k < 3; ++k) {
        const Number below = dot(constant(facet.corners[k]) + p * -1.0, normals[k]);
        if (below.v > 0.0) lift = lift + constant(normals[k]) * (w.b[k] * below);
    }
    return p + lift;
}

/// One event at the surface that the ray has met: turns the ray into the one that leaves.
/// start: where the path tracer starts it.
bool scatter(const World& world,
             const geometry::Hit& hit,
             const geometry::SurfacePoint& point,
             const geometry::SurfacePoint& start,
             const SpecularEvent& event,
             RayDifferential& ray) {
    // A facet, or the plane that touches a curved surface where the ray meets it
    const bool is_curved = point.mesh->primitives() != nullptr;
    Facet facet;
    geometry::PrimitiveSurface curved;
    if (is_curved)
        curved = geometry::primitive_surface(world.geometry, hit, ray.o, ray.d, point.time);
    else if (!make_facet(world, point, facet))
        return false;
    const Vec3d plane =
        is_curved
            ? curved.n
            : (facet.corners[1] - facet.corners[0]).cross(facet.corners[2] - facet.corners[0]);
    const Vec3d of_plane = is_curved ? curved.p : facet.corners[0];
    const Vector o{ray.o, {ray.o_by[0], ray.o_by[1]}};
    const Vector d{ray.d, {ray.d_by[0], ray.d_by[1]}};
    const Number across = dot(d, plane);
    if (!(std::abs(across.v) > 0.0)) return false;
    const Number t = dot(constant(of_plane) + o * -1.0, plane) / across;
    Vector p = o + d * t;

    // The normal on the side that the ray comes from
    const double facing = across.v < 0.0 ? 1.0 : -1.0;
    Weights w;
    if (!is_curved) w = weights_of(facet, plane, p);
    Vector n = constant(plane / plane.length());
    if (is_curved || facet.is_smooth) {
        n = is_curved ? curved_normal(curved, p) : facet_normal(facet, w);
        if (!(n.v.dot(n.v) > 0.0)) return false;
        n = unit(n);
    }
    const double sign = n.v.dot(plane) * facing > 0.0 ? 1.0 : -1.0;
    n = n * sign;
    const Number mu = dot(n, d) * -1.0;
    if (!(mu.v > 0.0)) return false;

    Vector out;
    if (event.kind == ScatterKind::Reflect) {
        out = d + n * (mu * 2.0);
        if (start.side != 0) {
            Vec3d normals[3];
            for (int k = 0; k < 3; ++k)
                normals[k] = facet.normals[k] * (sign / facet.normals[k].length());
            p = lifted_point(facet, normals, w, p);
        }
    } else {
        const double eta = double(event.eta);
        const Number square = Number{1.0} - (Number{1.0} - mu * mu) * (1.0 / (eta * eta));
        if (!(square.v > 0.0)) return false;
        out = (d + n * mu) * (1.0 / eta) + n * (square_root(square) * -1.0);
        if (!(out.v.dot(plane) * facing < 0.0)) return false;
    }
    out = unit(out);
    ray = {p.v, out.v, {p.by[0], p.by[1]}, {out.by[0], out.by[1]}};
    return true;
}

}  // namespace

bool operator==(const SpecularEvents& a, const SpecularEvents& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

std::optional<geometry::SurfacePoint> leaving_point(const World& world,
                                                    const geometry::SurfacePoint& point,
                                                    const Vec3& wo,
                                                    uint64_t& ray_count) {
    if (!point.mesh->has_normals()) {
        if (!point.mesh->primitives() || !world.materials.is_hair(point.material))
            return std::nullopt;
        return geometry::across_fiber(world.scene, point);
    }
    if (world.materials.material_has_transmission(point.material)) return std::nullopt;
    const std::optional<geometry::SurfacePoint> start = geometry::lifted(world.geometry, point, wo);
    if (!start) return std::nullopt;
    ++ray_count;
    if (world.accelerator->is_occluded(geometry::spawn_ray_to(point, start->p)))
        return std::nullopt;
    return start;
}

bool is_plain_vertex(const World& world,
                     const geometry::SurfacePoint& point,
                     const shading::Bsdf& bsdf) {
    if (point.material >= world.scene.materials.size()) return false;
    const scene::Material& material = world.scene.materials[point.material];
    using Source = scene::Input::Source;
    if (material.normal.source != Source::Constant || material.ior.source != Source::Constant) {
        return false;
    }
    Vec3d normals[3];
    if (point.mesh->has_normals() &&
        !point.mesh->corner_normals(point.triangle, normals, point.time)) {
        return false;
    }
    return bsdf.ns() == point.ns || bsdf.ns() == -point.ns;
}

std::array<Vec3d, 2> directions_across(const Vec3d& d) {
    return {lights::from_axis_frame(d, Vec3d(1.0, 0.0, 0.0)),
            lights::from_axis_frame(d, Vec3d(0.0, 1.0, 0.0))};
}

bool follow_chain(const World& world,
                  const geometry::SurfacePoint& from,
                  const Vec3d& d,
                  const std::array<Vec3d, 2>& across,
                  const SpecularEvents& events,
                  SpecularChain& out,
                  RayCounts& counts) {
    RayDifferential& ray = out.ray;
    ray = {Vec3d(from.p), d, {Vec3d(0.0), Vec3d(0.0)}, across};
    const geometry::SurfacePoint* start = &from;
    geometry::SurfacePoint leaving;
    for (int i = 0; i < events.count; ++i) {
        const Vec3 direction = to_float(ray.d);
        const geometry::Ray query = geometry::spawn_ray(*start, direction);
        const geometry::Hit hit = world.accelerator->intersect(query);
        ++counts.caustic;
        if (!hit.is_valid()) return false;
        geometry::SurfacePoint& point = out.points[size_t(i)];
        point = geometry::make_surface_point(world.scene, world.geometry, query, hit);
        const SpecularEvent& event = events.events[size_t(i)];
        const bool is_behind = point.ng.dot(direction) > 0.0f;
        if (point.material != event.material || is_behind != event.is_behind) return false;
        leaving = leaving_point(world, point, -direction, counts.caustic).value_or(point);
        out.directions[size_t(i)] = ray.d;
        const Vec3d before = ray.o;
        if (!scatter(world, hit, point, leaving, event, ray)) return false;
        out.lengths[size_t(i)] = (ray.o - before).length();
        start = &leaving;
    }
    out.directions[size_t(events.count)] = ray.d;
    return true;
}

}  // namespace velatura::integrator
