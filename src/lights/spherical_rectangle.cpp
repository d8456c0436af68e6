// SPDX-License-Identifier: Apache-2.0
#include "lights/spherical_rectangle.h"

#include <algorithm>
#include <cmath>

namespace velatura::lights {
namespace {

double triangle_solid_angle(const Vec3d& a, const Vec3d& b, const Vec3d& c, double triple) {
    const double la = std::sqrt(a.dot(a)), lb = std::sqrt(b.dot(b)), lc = std::sqrt(c.dot(c));
    const double denominator = la * lb * lc + a.dot(b) * lc + a.dot(c) * lb + b.dot(c) * la;
    return 2.0 * std::atan2(triple, denominator);
}

}  // namespace

double solid_angle(const RectangleView& v) {
    const Vec3d a(v.x0, v.y0, -v.height), b(v.x1, v.y0, -v.height);
    const Vec3d c(v.x1, v.y1, -v.height), d(v.x0, v.y1, -v.height);
    const double triple = v.width * v.length * v.height;
    return triangle_solid_angle(a, b, c, triple) + triangle_solid_angle(a, c, d, triple);
}

Vec2d sample_solid_angle(const RectangleView& v, double omega, const Vec2& u) {
    const double h = v.height, h_squared = h * h;
    // Dihedral angles of the pyramid at the corners (x0, y1) and (x0, y0); atan2, not acos, for
    // grazing views
    const double x0_squared = v.x0 * v.x0;
    const double g2 = std::atan2(h * std::sqrt(h_squared + x0_squared + v.y1 * v.y1), v.x0 * v.y1);
    const double g3 = std::atan2(h * std::sqrt(h_squared + x0_squared + v.y0 * v.y0), -v.x0 * v.y0);
    // z components of the normals of the sides through y0 and y1
    const double b0 = -v.y0 / std::sqrt(h_squared + v.y0 * v.y0);
    const double b1 = v.y1 / std::sqrt(h_squared + v.y1 * v.y1);

    // x: where the part of the rectangle left of it has the solid angle u.x · omega
    const double au = double(u.x) * omega + 2.0 * pi_d - g2 - g3;
    const double fu = (std::cos(au) * b0 - b1) / std::sin(au);
    const double cu = std::clamp(std::copysign(1.0 / std::sqrt(fu * fu + b0 * b0), fu), -1.0, 1.0);
    const double cu_rest = (1.0 - cu) * (1.0 + cu);
    const double x = cu_rest > 0.0 ? cu * h / std::sqrt(cu_rest) : (cu > 0.0 ? v.x1 : v.x0);
    const double xu = std::clamp(x, v.x0, v.x1);

    // y: uniform in the sine of its elevation over the great circle through xu
    const double d_squared = xu * xu + h_squared;
    const double h0 = v.y0 / std::sqrt(d_squared + v.y0 * v.y0);
    const double h1 = v.y1 / std::sqrt(d_squared + v.y1 * v.y1);
    const double hv = h0 + double(u.y) * (h1 - h0);
    const double rest = (1.0 - hv) * (1.0 + hv);
    const double yv = rest > 0.0 ? hv * std::sqrt(d_squared / rest) : (hv > 0.0 ? v.y1 : v.y0);
    return {xu, std::clamp(yv, v.y0, v.y1)};
}

}  // namespace velatura::lights
