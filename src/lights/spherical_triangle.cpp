// SPDX-License-Identifier: Apache-2.0
#include "lights/spherical_triangle.h"

#include "lights/length_of.h"

#include <algorithm>
#include <cmath>

namespace velatura::lights {
namespace {

/// x clamped to [0, 1]; NaN, which only views without extent bring, counts as 0.
double unit_interval(double x) {
    return x > 0.0 ? std::min(x, 1.0) : 0.0;
}

}  // namespace

double solid_angle(const TriangleView& view) {
    const Vec3d &a = view.a, b = view.a + view.e1, c = view.a + view.e2;
    const double la = length_of(a), lb = length_of(b), lc = length_of(c);
    const double denominator = la * lb * lc + a.dot(b) * lc + a.dot(c) * lb + b.dot(c) * la;
    return 2.0 * std::atan2(view.triple(), denominator);
}

Vec2d sample_solid_angle(const TriangleView& view, double omega, const Vec2& u) {
    const Vec3d &a = view.a, b = view.a + view.e1;
    const double la = length_of(a), lb = length_of(b);
    const Vec3d A = a / la, B = b / lb;

    // Walk from A towards C, along the tangent T, to the point C' at which the triangle A B C' has
    // the share u.x of the solid angle: tan(Ω'/2) = D t / (1 + A·B + t B·T) with t = tan(s/2)
    const Vec3d across = a.cross(view.e2);  // = a × c
    const double sin_scaled = length_of(across);
    const Vec3d towards = view.e2 - A * A.dot(view.e2);
    const Vec3d T = towards / length_of(towards);
    const double D = view.triple() / (lb * sin_scaled);
    const Vec3d middle = A + B;
    const double k = 0.5 * middle.dot(middle);  // 1 + A·B, also for nearly opposite corners
    const double half = 0.5 * double(u.x) * omega;
    const double S = std::sin(half), C = std::cos(half);
    const double full = std::atan2(sin_scaled, a.dot(a + view.e2));
    const double walked = 2.0 * std::atan2(S * k, D * C - S * (view.e1.dot(T) / lb));
    const double s = std::clamp(walked, 0.0, full);

    // Walk from B towards C', uniform in the cosine
    const double sin_half = std::sin(0.5 * s);
    const Vec3d chord = T * std::sin(s) - A * (2.0 * sin_half * sin_half) + (A - B);
    const double one_minus_z = 0.5 * double(u.y) * chord.dot(chord);
    const Vec3d tangent = chord - B * B.dot(chord);
    const double tangent_length = length_of(tangent);
    Vec3d q = B;
    if (tangent_length > 0.0) {
        q = B * (1.0 - one_minus_z) +
            tangent * (std::sqrt(one_minus_z * (2.0 - one_minus_z)) / tangent_length);
    }

    // Where that direction meets the plane. Both weights are divided by the sum as it was before.
    const double det = q.dot(view.e1.cross(view.e2));
    const double x = unit_interval(q.dot(view.e2.cross(a)) / det);
    const double y = unit_interval(q.dot(a.cross(view.e1)) / det);
    const double sum = x + y;
    return sum > 1.0 ? Vec2d(x / sum, y / sum) : Vec2d(x, y);
}

Vec2d sample_triangle_area(const Vec2& u) {
    const double ux = double(u.x), uy = double(u.y);
    const double lesser = 0.5 * std::min(ux, uy);
    return ux < uy ? Vec2d(lesser, uy - lesser) : Vec2d(ux - lesser, lesser);
}

}  // namespace velatura::lights
