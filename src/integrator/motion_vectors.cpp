// SPDX-License-Identifier: Apache-2.0
#include "integrator/motion_vectors.h"

#include "geometry/geometry_set.h"
#include "geometry/triangle_mesh.h"
#include "integrator/world.h"

#include <utility>

namespace velatura::integrator {

namespace {

using accumulate::DataSource;
using scene::MomentKind;

std::pair<MomentKind, MomentKind> kinds_of(DataSource source) {
    if (source == DataSource::ShutterMotion)
        return {MomentKind::ShutterOpen, MomentKind::ShutterClose};
    return {MomentKind::Frame, source == DataSource::BackwardMotion ? MomentKind::PreviousFrame
                                                                    : MomentKind::NextFrame};
}

/// Film points run down, vectors up.
std::optional<Vec2> vector(const std::optional<Vec2d>& from, const std::optional<Vec2d>& to) {
    if (!from || !to) return std::nullopt;
    return Vec2(float(to->x - from->x), float(from->y - to->y));
}

Vec3d on_triangle(const std::array<Vec3d, 3>& corners, double b1, double b2) {
    return corners[0] + (corners[1] - corners[0]) * b1 + (corners[2] - corners[0]) * b2;
}

/// The point of the surface in shape space, as when the shutter opens.
Vec3d place_in_shape(const World& world, const geometry::SurfacePoint& point) {
    const geometry::TriangleMesh& mesh = *point.mesh;
    if (!mesh.primitives()) {
        std::array<Vec3d, 3> corners;
        for (int k = 0; k < 3; ++k) corners[size_t(k)] = Vec3d(mesh.corner(point.triangle, k));
        return on_triangle(corners, double(point.b1), double(point.b2));
    }
    if (point.instance == scene::none) return Vec3d(point.p);
    std::optional<geometry::InstanceTransform> storage;
    return transform_point(
        Vec3d(point.p),
        world.geometry.instance(point.instance, point.time, storage).prototype_from_render);
}

/// What is added to it at a moment.
Vec3d offset(const geometry::SurfacePoint& point, scene::PrimvarId offsets) {
    const geometry::TriangleMesh& mesh = *point.mesh;
    if (offsets == scene::none || !mesh.has_primvar(offsets)) return Vec3d(0.0);
    if (mesh.primitives()) {
        float v[4] = {0, 0, 0, 0};
        mesh.primvar(offsets, point.triangle, point.b1, point.b2, v);
        return Vec3d(double(v[0]), double(v[1]), double(v[2]));
    }
    float rows[3][4] = {};
    if (!mesh.primvar_corners(offsets, point.triangle, rows)) return Vec3d(0.0);
    std::array<Vec3d, 3> corners;
    for (size_t k = 0; k < 3; ++k)
        corners[k] = Vec3d(double(rows[k][0]), double(rows[k][1]), double(rows[k][2]));
    return on_triangle(corners, double(point.b1), double(point.b2));
}

}  // namespace

MotionVectors::MotionVectors(const World& world) : world_(world) {
    for (const scene::Moment& moment : world.scene.moments) {
        End& end = ends_[size_t(moment.kind)];
        end.moment = &moment;
        end.camera.emplace(moment.camera, world.width(), world.height());
    }
}

const camera::CameraModel& MotionVectors::camera_at(const End& end) const {
    return end.camera ? *end.camera : world_.camera;
}

Vec3d MotionVectors::place_at(const End& end, const geometry::SurfacePoint& point) const {
    Vec3d p = place_in_shape(world_, point);
    const scene::Moment* const moment = end.moment;
    const bool is_placed = point.instance != scene::none;
    if (moment) {
        p += offset(point, moment->offsets);
        if (!moment->shapes.empty()) {
            const uint32_t prototype =
                is_placed ? world_.scene.instances[point.instance].prototype : scene::none;
            const auto at = moment->shapes.find({prototype, point.shape});
            if (at != moment->shapes.end()) p = transform_point(p, at->second);
        }
    }
    if (!is_placed) return p;
    if (moment) {
        const auto at = moment->instances.find(point.instance);
        if (at != moment->instances.end()) return transform_point(p, at->second);
    }
    return transform_point(p, Mat4d(world_.scene.instances[point.instance].render_from_prototype));
}

std::optional<Vec2> MotionVectors::of_surface(accumulate::DataSource source,
                                              const geometry::SurfacePoint& point) const {
    const auto [from, to] = kinds_of(source);
    const End &a = ends_[size_t(from)], &b = ends_[size_t(to)];
    return vector(camera_at(a).project(place_at(a, point)),
                  camera_at(b).project(place_at(b, point)));
}

std::optional<Vec2> MotionVectors::of_place(accumulate::DataSource source, const Vec3& p) const {
    const auto [from, to] = kinds_of(source);
    return vector(camera_at(ends_[size_t(from)]).project(Vec3d(p)),
                  camera_at(ends_[size_t(to)]).project(Vec3d(p)));
}

std::optional<Vec2> MotionVectors::of_direction(accumulate::DataSource source,
                                                const Vec3& d) const {
    const auto [from, to] = kinds_of(source);
    return vector(camera_at(ends_[size_t(from)]).project_direction(Vec3d(d)),
                  camera_at(ends_[size_t(to)]).project_direction(Vec3d(d)));
}

}  // namespace velatura::integrator
