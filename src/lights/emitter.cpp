// SPDX-License-Identifier: Apache-2.0
#include "lights/emitter.h"

#include "sampling/warp.h"

#include <cmath>

namespace velatura::lights {

std::optional<ShapeFrame> ShapeFrame::make(const Vec3d& origin,
                                           const Vec3d& x,
                                           const Vec3d& y,
                                           const Vec3d& z) {
    ShapeFrame f{origin, x, y, z, {}, {}, {}, 0.0};
    const double det = x.cross(y).dot(z);
    const double lengths = std::sqrt(x.dot(x)) * std::sqrt(y.dot(y)) * std::sqrt(z.dot(z));
    const bool is_finite = std::isfinite(lengths) && std::isfinite(origin.dot(origin));
    // The rounding error of det is about 1e-15 of the product of the lengths
    if (!is_finite || !(std::abs(det) > 1e-13 * lengths)) return std::nullopt;
    f.dual_x = y.cross(z) / det;
    f.dual_y = z.cross(x) / det;
    f.dual_z = x.cross(y) / det;
    f.volume = std::abs(det);
    return f;
}

EmitterSample to_render(const ShapeFrame& frame, const ObjectSample& sample) {
    const Vec3d v = frame.from_object_direction(sample.wi);
    const double stretch = std::sqrt(v.dot(v));
    EmitterSample s;
    s.wi = v * (1.0 / stretch);
    s.distance = sample.distance * stretch;
    s.pdf = sample.pdf * frame.density_ratio(stretch);
    return s;
}

Vec2d concentric_disk(const Vec2& u) {
    return sampling::concentric_disk(Vec2d(u));
}

Vec3d sample_cone(const Vec2& u, double one_minus_cos) {
    // Lambert's azimuthal equal-area map: 1 − cosθ grows with the square of the radius in the disk
    const Vec2d disk = concentric_disk(u);
    const double s = std::min(one_minus_cos * disk.dot(disk), 2.0);
    const double k = std::sqrt(one_minus_cos * (2.0 - s));
    return {disk.x * k, disk.y * k, 1.0 - s};
}

bool is_similarity(const Mat4d& m) {
    const auto axis = [&m](int row) { return Vec3d(m[row][0], m[row][1], m[row][2]); };
    const Vec3d x = axis(0), y = axis(1), z = axis(2);
    const double xx = x.dot(x), yy = y.dot(y), zz = z.dot(z);
    const double bound = 1e-6 * (xx + yy + zz);
    return std::abs(xx - yy) <= bound && std::abs(yy - zz) <= bound &&
           std::abs(x.dot(y)) <= bound && std::abs(y.dot(z)) <= bound &&
           std::abs(z.dot(x)) <= bound;
}

Vec3d from_axis_frame(const Vec3d& n, const Vec3d& local) {
    // Ref: Duff et al. 2017, "Building an Orthonormal Basis, Revisited", JCGT 6(1)
    const double sign = std::copysign(1.0, n.z);
    const double a = -1.0 / (sign + n.z);
    const double b = n.x * n.y * a;
    const Vec3d x(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    const Vec3d y(b, sign + n.y * n.y * a, -n.y);
    return x * local.x + y * local.y + n * local.z;
}

}  // namespace velatura::lights
