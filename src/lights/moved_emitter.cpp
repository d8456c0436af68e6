// SPDX-License-Identifier: Apache-2.0
#include "lights/moved_emitter.h"

#include "lights/length_of.h"
#include "scene/effect_calls.h"

namespace velatura::lights {

namespace {

using Pose = scene::AffineMotion::Pose;

/// A direction through a map: the unit one, and how long the given unit one has become.
struct Carried {
    Vec3d direction;
    double stretch = 0;
};

Carried carry(const Vec3d& d, const Mat4d& m) {
    const Vec3d v = transform_direction(d, m);
    const double stretch = length_of(v);
    return {v / stretch, stretch};
}

/// Solid angle around a direction where the light was made, over the one that it becomes. Ref:
/// ShapeFrame::density_ratio().
double density_ratio(const Pose& pose, double stretch) {
    return stretch * stretch * stretch / pose.volume;
}

/// How much larger an area across the unit normal becomes, and the normal.
Carried carry_area(const Vec3d& n, const Mat4d& m) {
    const Vec3d v = n * cofactor_matrix(m);
    const double stretch = length_of(v);
    const double sign = determinant3(m) < 0.0 ? -1.0 : 1.0;
    return {v * (sign / stretch), stretch};
}

}  // namespace

std::optional<EmitterSample> sample_moved(const Emitter& emitter,
                                          const Pose& pose,
                                          const Vec3d& p,
                                          const Vec2& u) {
    scene::count_call(scene::Effect::TransformBlur);
    if (!(pose.volume > 0.0)) return std::nullopt;
    std::optional<EmitterSample> s = emitter.sample(transform_point(p, pose.to_made), u);
    if (!s) return s;
    const Carried wi = carry(s->wi, pose.to_render);
    s->wi = wi.direction;
    s->distance *= wi.stretch;
    if (!emitter.is_delta()) s->pdf *= density_ratio(pose, wi.stretch);
    return s;
}

std::optional<EmitterHit> intersect_moved(const Emitter& emitter,
                                          const Pose& pose,
                                          const Vec3d& o,
                                          const Vec3d& d) {
    scene::count_call(scene::Effect::TransformBlur);
    if (!(pose.volume > 0.0)) return std::nullopt;
    const Carried made = carry(d, pose.to_made);
    std::optional<EmitterHit> hit =
        emitter.intersect(transform_point(o, pose.to_made), made.direction);
    if (!hit) return hit;
    // The way back stretches by one over that
    hit->t /= made.stretch;
    hit->pdf *= density_ratio(pose, 1.0 / made.stretch);
    return hit;
}

std::optional<EmitterPoint> sample_point_moved(const Emitter& emitter,
                                               const Pose& pose,
                                               const Vec2& u,
                                               const std::optional<Vec3d>& facing) {
    std::optional<Vec3d> facing_made;
    if (facing && pose.volume > 0.0) facing_made = carry(*facing, pose.to_made).direction;
    std::optional<EmitterPoint> point = emitter.sample_point(u, facing_made);
    if (!point || !(pose.volume > 0.0)) return point;
    if (emitter.is_infinite()) {
        const Carried n = carry(point->n, pose.to_render);
        point->n = n.direction;
        if (!emitter.is_delta()) point->pdf *= density_ratio(pose, n.stretch);
        return point;
    }
    point->p = transform_point(point->p, pose.to_render);
    const Carried n = carry_area(point->n, pose.to_render);
    point->n = n.direction;
    point->pdf /= n.stretch;
    return point;
}

Rgb radiance_moved(const Emitter& emitter,
                   const Pose& pose,
                   const EmitterPoint& point,
                   const Vec3d& o,
                   const Vec3d& d) {
    if (!(pose.volume > 0.0)) return Rgb(0.0f);
    EmitterPoint made = point;
    if (emitter.is_infinite()) {
        made.n = carry(point.n, pose.to_made).direction;
    } else {
        made.p = transform_point(point.p, pose.to_made);
        made.n = carry_area(point.n, pose.to_made).direction;
    }
    return emitter.radiance_at(made, transform_point(o, pose.to_made),
                               carry(d, pose.to_made).direction);
}

}  // namespace velatura::lights
