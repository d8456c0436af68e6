// SPDX-License-Identifier: Apache-2.0
#include "lights/light_bounds.h"

#include "base/box.h"
#include "base/floats.h"

#include <algorithm>
#include <cmath>

namespace velatura::lights {
namespace {

/// Angle between unit vectors, accurate for nearly parallel ones too. Ref: Kahan, "How Futile are
/// Mindless Assessments of Roundoff in Floating-Point Computation?", §12.
double angle_between(const Vec3d& a, const Vec3d& b) {
    const Vec3d difference = a - b, sum = a + b;
    return 2.0 * std::atan2(std::sqrt(difference.dot(difference)), std::sqrt(sum.dot(sum)));
}

/// Unit vector `a` turned by `angle` towards `b`; towards anywhere when they are (anti)parallel.
Vec3d turn_towards(const Vec3d& a, const Vec3d& b, double angle) {
    const auto across_a = [&a](const Vec3d& v) { return v - a * a.dot(v); };
    // Twice: between nearly opposite vectors the first difference is mostly rounding
    Vec3d across = across_a(across_a(b));
    if (!(across.dot(across) > 0.0)) {
        across = across_a(std::abs(a.x) < 0.5 ? Vec3d(1.0, 0.0, 0.0) : Vec3d(0.0, 1.0, 0.0));
    }
    across = across_a(across / std::sqrt(across.dot(across)));
    return a * std::cos(angle) + across / std::sqrt(across.dot(across)) * std::sin(angle);
}

}  // namespace

EmissionCone merged(const EmissionCone& a, const EmissionCone& given_b) {
    // Two double cones merge along whichever of the axes is closer. With a one-sided one a double
    // cone stands for all directions.
    EmissionCone b = given_b;
    const bool are_two_sided = a.is_two_sided && b.is_two_sided;
    if (are_two_sided && a.axis.dot(b.axis) < 0.0) b.axis = -b.axis;
    EmissionCone out = a.normals >= b.normals ? a : b;
    out.spread = std::max(a.spread, b.spread);
    out.intensity = a.intensity + b.intensity;
    out.is_two_sided = are_two_sided;
    if (a.is_two_sided != b.is_two_sided) {
        out.normals = pi_d;
        return out;
    }

    // The wider cone of normals holds the other one already
    const EmissionCone& narrow = a.normals >= b.normals ? b : a;
    const double apart = angle_between(out.axis, narrow.axis);
    if (std::min(apart + narrow.normals, pi_d) <= out.normals) return out;

    const double half = (out.normals + apart + narrow.normals) / 2.0;
    if (half >= pi_d) {
        out.normals = pi_d;
        return out;
    }
    out.axis = turn_towards(out.axis, narrow.axis, half - out.normals);
    out.normals = half;
    return out;
}

EmissionCone cone_around(std::span<const Vec3d> normals, bool is_two_sided) {
    EmissionCone out;
    bool is_first = true;
    for (const Vec3d& normal : normals) {
        const double length = std::sqrt(normal.dot(normal));
        if (!(length > 0.0) || !std::isfinite(length)) continue;
        EmissionCone one;
        one.axis = normal / length;
        one.normals = 0.0;
        out = is_first ? one : merged(out, one);
        is_first = false;
    }
    // Sums of vectors within half a turn stay between them; else they may point anywhere
    if (out.normals >= pi_d / 2.0) out.normals = pi_d;
    out.is_two_sided = is_two_sided;
    return out;
}

Box3d carried(const Box3d& box, const scene::AffineMotion& motion) {
    // Points go straight on between keys
    Box3d out;
    for (const Mat4d& key : motion.keys()) out.extendBy(transformed(box, key));
    return out;
}

LightBounds carried(const LightBounds& bounds, const scene::AffineMotion& motion) {
    if (!motion.moves()) return bounds;
    LightBounds out{carried(bounds.box, motion), bounds.cone};
    if (motion.only_translates()) return out;
    // What turns may shine anywhere
    out.cone.normals = pi_d;
    double largest = 0.0;
    for (const Mat4d& key : motion.keys())
        largest = std::max(largest, std::cbrt(sqr(determinant3(key))));
    out.cone.intensity *= largest;
    return out;
}

LightBounds LightBounds::merged(const LightBounds& a, const LightBounds& b) {
    LightBounds out{a.box, lights::merged(a.cone, b.cone)};
    out.box.extendBy(b.box);
    return out;
}

}  // namespace velatura::lights
