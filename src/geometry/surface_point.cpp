// SPDX-License-Identifier: Apache-2.0
#include "geometry/surface_point.h"

#include "geometry/absolute.h"
#include "geometry/geometry_set.h"
#include "geometry/triangle_mesh.h"
#include "scene/effect_calls.h"
#include "scene/scene.h"

#include <algorithm>
#include <cmath>

namespace velatura::geometry {

using scene::Effect;

namespace {

/// Bound of the relative error of the double operations that make a point.
constexpr double double_error = 16.0 * 0x1p-53;

/// Float error bound that is not below v: the widening outdoes the rounding.
Vec3 cast_up(const Vec3d& v) {
    constexpr double widening = 1.0 + 0x1p-22;
    return to_float(v * widening);
}

/// Error of a point in a prototype after the way there and back: of the double operations here and
/// in traversal.
Vec3d placed_error(const InstanceTransform& instance, const Vec3d& p, const Vec3d& error) {
    const Mat4d forward(instance.render_from_prototype), reach = absolute(forward);
    return transform_direction(error, reach) + transform_point(absolute(p), reach) * double_error +
           transform_point(absolute(transform_point(p, forward)), instance.round_trip_bound) *
               double_error;
}

/// Sets p to q with the bound of its error before the cast to float.
void set_place(SurfacePoint& point, const Vec3d& q, const Vec3d& error) {
    point.p = to_float(q);
    point.p_error = cast_up(error + absolute(q) * double(gamma_bound(2)));
}

/// Unit vector, or zero for a vector without a direction.
Vec3d unit_or_zero(const Vec3d& v) {
    const double length = std::sqrt(v.dot(v));
    return length > 0.0 && std::isfinite(length) ? v * (1.0 / length) : Vec3d(0.0);
}

/// ∂p/∂s and ∂p/∂t in shape space; false where st does not span the triangle.
bool texture_derivatives(
    const float st[3][4], const Vec3d& e1, const Vec3d& e2, Vec3d& dpds, Vec3d& dpdt) {
    const double s1 = double(st[1][0]) - double(st[0][0]), t1 = double(st[1][1]) - double(st[0][1]);
    const double s2 = double(st[2][0]) - double(st[0][0]), t2 = double(st[2][1]) - double(st[0][1]);
    const double det = s1 * t2 - t1 * s2;
    if (!(det != 0.0) || !std::isfinite(det)) return false;
    const double sign = det < 0.0 ? -1.0 : 1.0;
    dpds = (e1 * t2 - e2 * t1) * sign;
    dpdt = (e2 * s1 - e1 * s2) * sign;
    return true;
}

/// Texture coordinates of the normal map, else those of the mesh.
scene::PrimvarId tangent_coordinates(const scene::Scene& scene,
                                     scene::MaterialId material,
                                     const TriangleMesh& mesh) {
    if (material < scene.materials.size()) {
        const scene::Input& normal = scene.materials[material].normal;
        if (normal.source == scene::Input::Source::Texture &&
            normal.texture < scene.textures.size()) {
            const scene::PrimvarId st = scene.textures[normal.texture].st;
            if (st != scene::none && mesh.has_primvar(st)) return st;
        }
    }
    return mesh.texture_coordinates();
}

/// ∂p/∂s and ∂p/∂t in shape space; false where the mesh does not tell.
bool triangle_derivatives(const scene::Scene& scene,
                          const SurfacePoint& point,
                          Vec3d& dpds,
                          Vec3d& dpdt) {
    const TriangleMesh& mesh = *point.mesh;
    const scene::PrimvarId st = tangent_coordinates(scene, point.material, mesh);
    float corners[3][4];
    if (st == scene::none || !mesh.primvar_corners(st, point.triangle, corners)) return false;
    const auto corner = [&](int k) { return Vec3d(mesh.corner(point.triangle, k, point.time)); };
    const Vec3d p0 = corner(0), e1 = corner(1) - p0, e2 = corner(2) - p0;
    return texture_derivatives(corners, e1, e2, dpds, dpdt);
}

/// The same for a primitive; forward: from its space to render space.
bool primitive_derivatives(const SurfacePoint& point,
                           const Mat4d& forward,
                           Vec3d& dpds,
                           Vec3d& dpdt) {
    const Vec3d p = transform_point(Vec3d(point.p), forward.inverse());
    return point.mesh->primitives()->tangents(point.triangle, point.face, p,
                                              {0.0, point.b1, point.b2}, dpds, dpdt);
}

/// What a shape of primitives is called for as.
scene::Effect effect_of(const scene::Shape& shape) {
    if (std::holds_alternative<scene::Curves>(shape.geometry)) return scene::Effect::Curves;
    if (std::holds_alternative<scene::Points>(shape.geometry)) return scene::Effect::Points;
    if (std::holds_alternative<scene::LevelSet>(shape.geometry)) return scene::Effect::LevelSets;
    return scene::Effect::Quadrics;
}

/// Sets all three to the primitive's.
void set_to_primitive(SurfacePoint& point,
                      const GeometrySet& geometry,
                      const Ray& ray,
                      const Hit& hit) {
    const PrimitiveSurface surface =
        primitive_surface(geometry, hit, Vec3d(ray.o), Vec3d(ray.d), ray.time);
    set_place(point, surface.p, surface.error);
    point.face = surface.face;
    const Vec3 n = to_float(unit_or_zero(surface.n));
    const bool has_facet = surface.facet_n != Vec3d(0.0);
    point.ng = has_facet ? to_float(unit_or_zero(surface.facet_n)) : n;
    point.ns = point.ng.dot(n) < 0.0f ? -n : n;
}

/// Sets ng and ns of a point on a shape that is placed directly.
void set_normals(SurfacePoint& point, const Vec3d& e1, const Vec3d& e2) {
    const TriangleMesh& mesh = *point.mesh;
    const Vec3d ng = unit_or_zero(e1.cross(e2)) * (mesh.flip_normals() ? -1.0 : 1.0);
    point.ng = ng == Vec3d(0.0) ? Vec3(0.0f, 0.0f, 1.0f) : to_float(ng);
    point.ns = point.ng;
    if (!mesh.has_normals()) return;
    const Vec3d ns = unit_or_zero(mesh.normal(point.triangle, point.b1, point.b2, point.time));
    if (ns != Vec3d(0.0)) point.ns = to_float(ns.dot(ng) < 0.0 ? -ns : ns);
}

/// The same for one in a prototype, from edges in its space.
void set_normals(SurfacePoint& point,
                 const Vec3d& e1,
                 const Vec3d& e2,
                 const InstanceTransform& instance) {
    const TriangleMesh& mesh = *point.mesh;
    const Mat3d normal_matrix = cofactor_matrix(Mat4d(instance.render_from_prototype));
    // Cofactors turn normals inside out under a mirror; covectors must stay outside
    const double mirror = instance.is_mirrored ? -1.0 : 1.0;
    const double outside = mesh.flip_normals() ? -mirror : mirror;
    const Vec3d ng = unit_or_zero(unit_or_zero(e1.cross(e2)) * normal_matrix) * outside;
    point.ng = ng == Vec3d(0.0) ? Vec3(0.0f, 0.0f, 1.0f) : to_float(ng);
    point.ns = point.ng;
    if (!mesh.has_normals()) return;
    const Vec3d n = mesh.normal(point.triangle, point.b1, point.b2, point.time);
    const Vec3d ns = unit_or_zero(n * normal_matrix) * mirror;
    if (ns != Vec3d(0.0)) point.ns = to_float(ns.dot(ng) < 0.0 ? -ns : ns);
}

}  // namespace

PrimitiveSurface primitive_surface(
    const GeometrySet& geometry, const Hit& hit, const Vec3d& o, const Vec3d& d, float time) {
    const TriangleMesh& mesh = geometry.mesh(hit);
    const PrimitiveSet& set = *mesh.primitives();
    const PrimitiveHit place{double(hit.t), hit.b1, hit.b2};
    PrimitiveSurface surface;
    if (hit.instance == scene::none) {
        surface = set.surface(hit.triangle, o, d, place);
    } else {
        std::optional<InstanceTransform> storage;
        const InstanceTransform& instance = geometry.instance(hit.instance, time, storage);
        const Mat4d& backward = instance.prototype_from_render;
        surface = set.surface(hit.triangle, transform_point(o, backward),
                              transform_direction(d, backward), place);
        surface.error = placed_error(instance, surface.p, surface.error);
        surface.p = transform_point(surface.p, Mat4d(instance.render_from_prototype));
        // Covectors: the same number for what was carried over
        Mat3d to_prototype;
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) to_prototype[i][k] = backward[i][k];
        const Mat3d covector = to_prototype.transposed();
        surface.n = surface.n * covector;
        surface.facet_n = surface.facet_n * covector;
        surface.normal_by_p = to_prototype * surface.normal_by_p * covector;
    }
    if (mesh.flip_normals()) {
        surface.n = -surface.n;
        surface.facet_n = -surface.facet_n;
        surface.normal_by_p = surface.normal_by_p * -1.0;
    }
    return surface;
}

namespace {

/// Where a ray meets a triangle, as weights of its second and third corner.
struct Weights {
    double b1, b2;
};

/// Floats place a hit within 2^-24 of the triangle's size, sideways: nothing beside the pixel that
/// sees it, unless the triangle is far larger than the way to it, as a floor that reaches to the
/// horizon. Then the weights come from the ray, in double. Ray and triangle in one space. Ref:
/// Möller, Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection", JGT 2(1).
Weights exact_weights(const Vec3d& o,
                      const Vec3d& d,
                      const Vec3d& p0,
                      const Vec3d& e1,
                      const Vec3d& e2,
                      const Weights& found) {
    const Vec3d across = d.cross(e2), from = o - p0;
    const double det = e1.dot(across);
    const double b1 = from.dot(across) / det, b2 = d.dot(from.cross(e1)) / det;
    // Seen edge-on, the ray tells less than was found; written so that NaN fails
    constexpr double rounding = 0x1p-20;
    const bool is_better_placed =
        std::abs(b1 - found.b1) <= rounding && std::abs(b2 - found.b2) <= rounding;
    const double inside = std::clamp(b1, 0.0, 1.0);
    const Weights placed = {inside, std::clamp(b2, 0.0, 1.0 - inside)};
    return is_better_placed ? placed : found;
}

/// Whether that is worth it. distance2: square of the way to the hit.
bool is_large_for_its_distance(const Vec3d& e1, const Vec3d& e2, double distance2) {
    return e1.length2() + e2.length2() > 16.0 * distance2;
}

/// is_plain: a triangle that stays, of a shape placed directly.
template <bool is_plain>
SurfacePoint make_point(const scene::Scene& scene,
                        const GeometrySet& geometry,
                        const TriangleMesh& mesh,
                        const Ray& ray,
                        const Hit& hit) {
    SurfacePoint point;
    std::optional<InstanceTransform> storage;
    const InstanceTransform* instance = nullptr;
    if (!is_plain && hit.instance != scene::none)
        instance = &geometry.instance(hit.instance, ray.time, storage);
    if (instance) {
        scene::count_call(Effect::Instancing);
        if (!scene.instances[hit.instance].later_render_from_prototype.empty())
            scene::count_call(Effect::TransformBlur);
    }
    if (!is_plain && mesh.segments() > 0) scene::count_call(Effect::DeformationBlur);
    point.mesh = &mesh;
    point.triangle = hit.triangle;
    point.instance = hit.instance;
    point.shape = hit.shape;
    point.b1 = hit.b1;
    point.b2 = hit.b2;
    point.time = ray.time;
    const scene::Shape& shape = instance ? scene.prototypes[instance->prototype].shapes[hit.shape]
                                         : scene.shapes[hit.shape];
    point.double_sided = shape.double_sided;
    point.provenance = shape.provenance;
    point.material = mesh.material(hit.triangle);
    if (instance && scene.instances[hit.instance].material_override != scene::none)
        point.material = scene.instances[hit.instance].material_override;

    if (!is_plain && mesh.primitives()) {
        scene::count_call(effect_of(shape));
        set_to_primitive(point, geometry, ray, hit);
        return point;
    }
    point.face = mesh.face(hit.triangle);

    // Place the point on the triangle in double
    const auto corner = [&](int k) {
        if (is_plain) return Vec3d(mesh.positions()[mesh.vertices(hit.triangle)[size_t(k)]]);
        return Vec3d(mesh.corner(hit.triangle, k, ray.time));
    };
    const Vec3d p0 = corner(0), e1 = corner(1) - p0, e2 = corner(2) - p0;
    Weights weights = {double(hit.b1), double(hit.b2)};
    const Vec3d d = instance ? transform_direction(Vec3d(ray.d), instance->prototype_from_render)
                             : Vec3d(ray.d);
    if (is_large_for_its_distance(e1, e2, d.length2() * double(hit.t) * double(hit.t))) {
        const Vec3d o = instance ? transform_point(Vec3d(ray.o), instance->prototype_from_render)
                                 : Vec3d(ray.o);
        weights = exact_weights(o, d, p0, e1, e2, weights);
    }
    const Vec3d p = p0 + e1 * weights.b1 + e2 * weights.b2;
    // Count the double operations here and in traversal, then the cast
    const Vec3d error = (absolute(p0) + absolute(e1) + absolute(e2)) * double_error;
    if (instance) {
        set_place(point, transform_point(p, Mat4d(instance->render_from_prototype)),
                  placed_error(*instance, p, error));
        set_normals(point, e1, e2, *instance);
    } else {
        set_place(point, p, error);
        set_normals(point, e1, e2);
    }
    return point;
}

}  // namespace

SurfacePoint make_surface_point(const scene::Scene& scene,
                                const GeometrySet& geometry,
                                const Ray& ray,
                                const Hit& hit) {
    const TriangleMesh& mesh = geometry.mesh(hit);
    const bool is_placed = hit.instance != scene::none;
    const bool is_plain = !is_placed && !mesh.primitives() && mesh.segments() == 0;
    return is_plain ? make_point<true>(scene, geometry, mesh, ray, hit)
                    : make_point<false>(scene, geometry, mesh, ray, hit);
}

Tangents tangents(const scene::Scene& scene, const SurfacePoint& point) {
    const Frame frame = Frame::from_z(point.ns);
    const Tangents fallback{frame.x, frame.y};
    if (point.mesh == nullptr) return fallback;
    Mat4d forward;
    if (point.instance != scene::none)
        forward = Mat4d(render_from_prototype(scene.instances[point.instance], point.time));
    Vec3d dpds(0.0), dpdt(0.0);
    const bool is_known = point.mesh->primitives()
                              ? primitive_derivatives(point, forward, dpds, dpdt)
                              : triangle_derivatives(scene, point, dpds, dpdt);
    if (!is_known) return fallback;
    if (point.instance != scene::none) {
        dpds = transform_direction(dpds, forward);
        dpdt = transform_direction(dpdt, forward);
    }
    dpds = unit_or_zero(dpds);
    dpdt = unit_or_zero(dpdt);
    // Tangents that are missing or stand along the normal say nothing
    const bool is_usable = dpds.cross(Vec3d(point.ns)).length2() > 0.0 && dpdt != Vec3d(0.0);
    return is_usable ? Tangents{to_float(dpds), to_float(dpdt)} : fallback;
}

std::optional<SurfacePoint> lifted(const GeometrySet& geometry,
                                   const SurfacePoint& point,
                                   const Vec3& wo) {
    constexpr double cos2_flattest = 0.99984769896;  // half the diagonal of a facet of 1 degree
    constexpr double cos2_steepest = 0.5;            // 45 degrees
    Vec3d normals[3];
    if (!point.mesh->corner_normals(point.triangle, normals, point.time)) return std::nullopt;
    const bool is_instanced = point.instance != scene::none;
    std::optional<InstanceTransform> storage;
    const Mat4d forward =
        is_instanced
            ? Mat4d(geometry.instance(point.instance, point.time, storage).render_from_prototype)
            : Mat4d();
    if (is_instanced) {
        const Mat3d normal_matrix = cofactor_matrix(forward);
        for (Vec3d& n : normals) n = unit_or_zero(n) * normal_matrix;
    }

    // Let the normals face the viewer, as a whole, as ns does. Squares tell which surfaces are flat
    // without a root, for most meshes are fine
    const bool is_behind = point.ng.dot(wo) < 0.0f;
    const Vec3d out = Vec3d(is_behind ? -point.ng : point.ng);
    const double facing[3] = {normals[0].dot(out), normals[1].dot(out), normals[2].dot(out)};
    const double sign = facing[0] + facing[1] + facing[2] < 0.0 ? -1.0 : 1.0;
    bool is_flat = true;
    for (int k = 0; k < 3; ++k) {
        const double square = facing[k] * facing[k], length2 = normals[k].dot(normals[k]);
        if (!(facing[k] * sign > 0.0) || square < cos2_steepest * length2) return std::nullopt;
        is_flat = is_flat && square > cos2_flattest * length2;
    }
    if (is_flat) return std::nullopt;

    // Rise to the tangent planes that are above
    Vec3d corners[3];
    for (int k = 0; k < 3; ++k) {
        corners[k] = Vec3d(point.mesh->corner(point.triangle, k, point.time));
        if (is_instanced) corners[k] = transform_point(corners[k], forward);
    }
    const double b1 = double(point.b1), b2 = double(point.b2);
    const double weights[3] = {1.0 - b1 - b2, b1, b2};
    const Vec3d p = corners[0] + (corners[1] - corners[0]) * b1 + (corners[2] - corners[0]) * b2;
    Vec3d lift(0.0);
    for (int k = 0; k < 3; ++k) {
        const Vec3d n = unit_or_zero(normals[k]) * sign;
        const double below = (corners[k] - p).dot(n);
        if (below > 0.0) lift += n * (weights[k] * below);
    }
    if (!(lift.dot(out) > 0.0)) return std::nullopt;
    SurfacePoint start = point;
    start.p = to_float(p + lift);
    start.p_error += cast_up(absolute(lift) * double(gamma_bound(2)));
    start.side = is_behind ? -1 : 1;
    return start;
}

bool primvar(const scene::Scene& scene,
             const SurfacePoint& point,
             scene::PrimvarId id,
             float out[4]) {
    if (id == scene::none || point.mesh == nullptr) return false;
    const bool can_be_inherited =
        point.instance != scene::none && scene.instances[point.instance].value_count > 0;
    if (can_be_inherited && point.mesh->yields_to_instance(id)) {
        const scene::InstanceValue* value =
            scene::find_value(scene, scene.instances[point.instance], id);
        if (value != nullptr) {
            std::copy_n(value->values.begin(), value->width, out);
            return true;
        }
    }
    return point.mesh->primvar(id, point.triangle, point.b1, point.b2, out);
}

Vec3 offset_ray_origin(const SurfacePoint& point, const Vec3& w) {
    const Vec3& n = point.ng;
    const float distance = std::abs(n.x) * point.p_error.x + std::abs(n.y) * point.p_error.y +
                           std::abs(n.z) * point.p_error.z;
    const bool is_inward = point.side != 0 ? point.side < 0 : w.dot(n) < 0.0f;
    const Vec3 offset = n * (is_inward ? -distance : distance);
    Vec3 origin = point.p + offset;
    for (int i = 0; i < 3; ++i) {
        // One or two floats further, for what rounding took away
        const float step = std::copysign(origin[i] * 0x1p-23f, offset[i]);
        origin[i] += offset[i] != 0.0f ? step : 0.0f;
    }
    return origin;
}

Ray spawn_ray(const SurfacePoint& point, const Vec3& d) {
    Ray ray{offset_ray_origin(point, d), d};
    ray.time = point.time;
    return ray;
}

Ray spawn_ray_to(const SurfacePoint& point, const Vec3& p1) {
    const Vec3 origin = offset_ray_origin(point, p1 - point.p);
    return {origin, p1 - origin, 1.0f, point.time};
}

Ray spawn_ray_to(const SurfacePoint& p0, const SurfacePoint& p1) {
    return spawn_ray_to(p0, offset_ray_origin(p1, p0.p - p1.p));
}

}  // namespace velatura::geometry
