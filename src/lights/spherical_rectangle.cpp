// SPDX-License-Identifier: Apache-2.0
#include "lights/spherical_rectangle.h"

#include "sampling/warp.h"

#include <algorithm>
#include <cmath>

namespace velatura::lights {
namespace {

/// Denominator of tan(Ω/2) for the triangle that the unit-free corners a, b, c span. Ref: Van
/// Oosterom & Strackee 1983, "The Solid Angle of a Plane Triangle".
double half_tangent_denominator(
    const Vec3d& a, const Vec3d& b, const Vec3d& c, double la, double lb, double lc) {
    return la * lb * lc + a.dot(b) * lc + a.dot(c) * lb + b.dot(c) * la;
}

}  // namespace

double solid_angle(const RectangleView& v) {
    const Vec3d a(v.x0, v.y0, -v.height), b(v.x1, v.y0, -v.height);
    const Vec3d c(v.x1, v.y1, -v.height), d(v.x0, v.y1, -v.height);
    const double la = std::sqrt(a.dot(a)), lb = std::sqrt(b.dot(b));
    const double lc = std::sqrt(c.dot(c)), ld = std::sqrt(d.dot(d));
    // Both halves have the same triple product. Their half angles sum to less than π, so that one
    // arc tangent of the product of the two complex numbers does for both
    const double triple = v.width * v.length * v.height;
    const double first = half_tangent_denominator(a, b, c, la, lb, lc);
    const double second = half_tangent_denominator(a, c, d, la, lc, ld);
    return 2.0 * std::atan2(triple * (first + second), first * second - triple * triple);
}

Vec2d sample_solid_angle(const RectangleView& v, double omega, const Vec2& u) {
    const double h = v.height, h_squared = h * h;
    // Dihedral angles g2, g3 of the pyramid at the corners (x0, y1) and (x0, y0) as complex numbers
    // (cosine, sine) up to length: their product has the sum as its angle, without any arc function
    const double h_x0_squared = h_squared + v.x0 * v.x0, h_y0_squared = h_squared + v.y0 * v.y0;
    const double cos_2 = v.x0 * v.y1, sin_2 = h * std::sqrt(h_x0_squared + v.y1 * v.y1);
    const double cos_3 = -v.x0 * v.y0, sin_3 = h * std::sqrt(h_x0_squared + v.y0 * v.y0);
    const double cos_sum = cos_2 * cos_3 - sin_2 * sin_3;
    const double sin_sum = sin_2 * cos_3 + cos_2 * sin_3;

    // x: where the part of the rectangle left of it has the solid angle u.x · omega. Cosine and
    // sine of au = u.x · omega − g2 − g3, times the length of the product, which is
    // (h² + x0²)·√(h² + y0²)·√(h² + y1²); then the paper's x = cu · h / √(1 − cu²) with its cu, b0
    // and b1 put in and all denominators taken out
    const double part = double(u.x) * omega;
    double cos_part = 0, sin_part = 0;
    if (part <= pi_d / 4.0) {
        sampling::cos_sin_eighth_turn(part * (4.0 / pi_d), cos_part, sin_part);
    } else {
        cos_part = std::cos(part);
        sin_part = std::sin(part);
    }
    const double cos_au = cos_part * cos_sum + sin_part * sin_sum;
    const double sin_au = sin_part * cos_sum - cos_part * sin_sum;
    double m = -(cos_au * v.y0 + h_x0_squared * h_y0_squared * v.y1), n = h * sin_au;
    const double scale = normalizing_scale(std::abs(m));  // squares of it leave the range
    m *= scale;
    n *= scale;
    const double rest_x = (m - n) * (m + n);
    const double signed_n = std::copysign(n, n * m);
    const double x =
        rest_x > 0.0 ? signed_n * std::sqrt(h_y0_squared / rest_x) : (signed_n > 0.0 ? v.x1 : v.x0);
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
