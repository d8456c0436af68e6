// SPDX-License-Identifier: Apache-2.0
#include "integrator/nested_dielectrics.h"

#include "scene/effect_calls.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace velatura::integrator {

namespace {

/// Faces lie on each other when they are no further apart than this many times the error of a
/// point. Two points that are the same but for rounding are apart by twice that at most.
constexpr float coincidence = 4.0f;

/// Of a point's error along its normal: what offset_ray_origin moves by.
float error_along_normal(const geometry::SurfacePoint& point) {
    float error = 0;
    for (int k = 0; k < 3; ++k) error += std::abs(point.ng[k]) * point.p_error[k];
    return error;
}

/// Wherever the instance moves.
Box3d placed_box(const scene::Instance& instance, const Box3& local) {
    Box3d box;
    if (!instance.later_render_from_prototype.empty()) {
        box.makeInfinite();
        return box;
    }
    const Mat4d forward(instance.render_from_prototype);
    for (int i = 0; i < 8; ++i) {
        const Vec3 corner(i & 1 ? local.max.x : local.min.x, i & 2 ? local.max.y : local.min.y,
                          i & 4 ? local.max.z : local.min.z);
        box.extendBy(transform_point(Vec3d(corner), forward));
    }
    return box;
}

bool is_near(const Box3d& box, const Vec3d& p, double distance) {
    for (int k = 0; k < 3; ++k)
        if (p[k] < box.min[k] - distance || p[k] > box.max[k] + distance) return false;
    return true;
}

bool is_outside(const geometry::SurfacePoint& face, const Vec3& w) {
    return face.ng.dot(w) > 0.0f;
}

}  // namespace

NestedDielectrics::NestedDielectrics(const scene::Scene& scene,
                                     const geometry::GeometrySet& geometry,
                                     const shading::MaterialEvaluator& materials)
    : scene_(scene), geometry_(geometry), materials_(materials) {
    for (uint32_t s = 0; s < scene.shapes.size(); ++s) {
        if (!bounds_solid(scene.shapes[s], scene::none)) continue;
        const geometry::TriangleMesh& mesh = geometry.shapes()[s];
        const Box3& b = mesh.bounds();
        solids_.push_back({{scene::none, s, trees_.add(mesh)}, Box3d(Vec3d(b.min), Vec3d(b.max))});
    }
    for (uint32_t i = 0; i < scene.instances.size(); ++i)
        add_dielectrics(i, scene.instances[i].prototype);
}

void NestedDielectrics::add_dielectrics(uint32_t instance, uint32_t prototype) {
    const std::vector<scene::Shape>& shapes = scene_.prototypes[prototype].shapes;
    const scene::Instance& placed = scene_.instances[instance];
    for (uint32_t s = 0; s < shapes.size(); ++s) {
        if (!bounds_solid(shapes[s], placed.material_override)) continue;
        const geometry::TriangleMesh& mesh = geometry_.prototypes()[prototype][s];
        solids_.push_back({{instance, s, trees_.add(mesh)}, placed_box(placed, mesh.bounds())});
    }
}

bool NestedDielectrics::bounds_solid(const scene::Shape& shape,
                                     scene::MaterialId override_material) const {
    return has_material(shape, override_material,
                        [&](scene::MaterialId m) { return materials_.bounds_solid(m); });
}

geometry::SurfacePoint NestedDielectrics::clear_of_faces(const geometry::SurfacePoint& point) {
    geometry::SurfacePoint clear = point;
    clear.p_error *= coincidence;
    return clear;
}

/// The face of a solid that the probe meets, if it is there where the probe is aimed at.
bool NestedDielectrics::find_face(const Solid& solid,
                                  const geometry::Ray& probe,
                                  geometry::SurfacePoint& out) const {
    // Thrice as long: rays are rounded in the solid's space
    const geometry::Ray ray{probe.o - probe.d, probe.d * 3.0f, 1.0f, probe.time};
    std::optional<geometry::InstanceTransform> storage;
    const Mat4d* backward = nullptr;
    if (solid.placed.instance != scene::none)
        backward =
            &geometry_.instance(solid.placed.instance, probe.time, storage).prototype_from_render;
    const std::optional<PlacedMeshHit> hit =
        intersect_placed_mesh(scene_, geometry_, solid.placed, backward, ray);
    if (!hit) return false;
    out = hit->point;
    return materials_.bounds_solid(out.material);
}

NestedDielectrics::Faces NestedDielectrics::faces_at(const geometry::SurfacePoint& point) const {
    Faces faces;
    faces.add(point);
    const geometry::SurfacePoint clear = clear_of_faces(point);
    const Vec3 above = geometry::offset_ray_origin(clear, point.ng);
    geometry::Ray probe{above, geometry::offset_ray_origin(clear, -point.ng) - above, 1.0f,
                        point.time};
    const double reach = double(probe.d.length());
    geometry::SurfacePoint face;
    for (const Solid& solid : solids_) {
        if (faces.is_full()) break;
        if (solid.placed.instance == point.instance && solid.placed.shape == point.shape) continue;
        if (!is_near(solid.box, Vec3d(point.p), reach) || !find_face(solid, probe, face)) continue;
        const double apart = (Vec3d(face.p) - Vec3d(point.p)).dot(Vec3d(point.ng));
        if (std::abs(apart) <= double(coincidence * error_along_normal(point))) faces.add(face);
    }
    return faces;
}

NestedDielectrics::Crossing NestedDielectrics::cross(const Interior& inside,
                                                     const geometry::SurfacePoint& point,
                                                     const Vec3& wo,
                                                     RayCounts* counts) const {
    scene::count_call(scene::Effect::NestedDielectrics);
    const Faces faces = faces_at(point);
    Crossing crossing;
    crossing.beyond = inside;
    Interior here = inside;

    // Leave first: solids of one material that touch are two
    for (const geometry::SurfacePoint& face : faces) {
        if (is_outside(face, wo) || crossing.beyond.leave(face.material)) continue;
        // Whoever meets an inside was inside
        here.enter(materials_, face.material);
        if (counts) ++counts->dielectrics_unmatched;
    }
    for (const geometry::SurfacePoint& face : faces) {
        if (!is_outside(face, wo)) continue;
        if (!crossing.beyond.enter(materials_, face.material) && counts)
            ++counts->dielectrics_too_deep;
    }

    // The boundary is that of the solid with the higher priority
    const scene::MaterialId before = here.filling(), after = crossing.beyond.filling();
    crossing.is_boundary = before != after;
    const geometry::SurfacePoint* owner = faces.begin();
    if (crossing.is_boundary) {
        const auto find = [&](scene::MaterialId material, bool from_outside) {
            return std::find_if(faces.begin(), faces.end(), [&](const auto& face) {
                return face.material == material && is_outside(face, wo) == from_outside;
            });
        };
        const auto left = find(before, false), entered = find(after, true);
        const bool has_both = left != faces.end() && entered != faces.end();
        const bool is_left = has_both ? materials_.priority(before) > materials_.priority(after)
                                      : left != faces.end();
        owner = is_left ? left : entered;
        const scene::MaterialId other = is_left ? after : before;
        if (other != scene::none) crossing.surrounding_index = materials_.index(other);
    }
    crossing.point = clear_of_faces(*owner);
    return crossing;
}

size_t NestedDielectrics::bytes() const {
    return solids_.capacity() * sizeof(Solid) + trees_.bytes();
}

}  // namespace velatura::integrator
