// SPDX-License-Identifier: Apache-2.0
#include "accel/ray_query.h"

#include <bit>

namespace velatura::accel {

namespace {

// Largest distance along an axis from the origin to the far side of the bounds.
double reach(const Vec3d& o, const Box3& bounds) {
    double largest = 0;
    for (int k = 0; k < 3; ++k) {
        largest = std::max(largest, std::abs(double(bounds.min[k]) - o[k]));
        largest = std::max(largest, std::abs(double(bounds.max[k]) - o[k]));
    }
    return largest;
}

bool is_usable(const Vec3& p) {
    // Written so that NaN is not usable
    return std::abs(p.x) < coordinate_limit && std::abs(p.y) < coordinate_limit &&
           std::abs(p.z) < coordinate_limit;
}

// Slab constants of axis k for the unscaled origin o and the scaled direction component d. Without
// branches: the signs of directions are what a processor cannot predict.
void set_slab(QueryRay& q, int k, double o, double d, double error, float widening) {
    const uint32_t is_backward = std::signbit(d) ? 1u : 0u;
    const int32_t forward = 1 - 2 * int32_t(is_backward);
    const double outward = std::copysign(error, d);
    q.near_origin[k] = next_float_toward(float(o + outward), forward);
    q.far_origin[k] = next_float_toward(float(o - outward), -forward);
    // A finite bound instead of infinity keeps 0·inf out; distances are far smaller than 1e38
    const auto inverse = float(std::copysign(std::min(1.0 / std::abs(d), 1e38), d));
    q.near_inverse[k] = inverse * (1.0f - widening);
    q.far_inverse[k] = inverse * (1.0f + widening);
    q.near_row[k] = uint32_t(k) + 3u * is_backward;
    q.far_row[k] = uint32_t(k) + 3u * (1u - is_backward);
}

}  // namespace

bool make_query(
    const Vec3d& o, const Vec3d& d, const Box3& bounds, const QuerySlack& slack, QueryRay& q) {
    const double d_abs[3] = {std::abs(d.x), std::abs(d.y), std::abs(d.z)};
    q.kz = d_abs[0] > d_abs[1] ? (d_abs[0] > d_abs[2] ? 0u : 2u) : (d_abs[1] > d_abs[2] ? 1u : 2u);
    q.kx = q.kz == 2 ? 0u : q.kz + 1u;
    q.ky = q.kx == 2 ? 0u : q.kx + 1u;
    // Written so that NaN fails
    const double limit = double(coordinate_limit);
    if (!(std::abs(o.x) < limit && std::abs(o.y) < limit && std::abs(o.z) < limit)) return false;
    if (!(d_abs[0] <= 0x1p300 && d_abs[1] <= 0x1p300 && d_abs[2] <= 0x1p300)) return false;
    if (!(d_abs[q.kz] >= 0x1p-300)) return false;

    // Scale d by a power of two: exact, and keeps the float part away from overflow
    const uint64_t exponent = std::bit_cast<uint64_t>(d_abs[q.kz]) >> 52;
    const double scale = std::bit_cast<double>((2046 - exponent) << 52);
    q.t_from_scaled = scale;
    q.scaled_from_t = std::bit_cast<double>(exponent << 52);
    const Vec3d e = d * scale;

    const double error = slack.origin * reach(o, bounds);
    q.slop = 0;
    q.filter_error = 0;
    for (int k = 0; k < 3; ++k) {
        q.origin[k] = o[k];
        q.filter_error = std::max(q.filter_error, float(std::abs(double(float(o[k])) - o[k])));
        set_slab(q, k, o[k], e[k], error, slack.inverse);
        q.slop = std::max(q.slop, std::abs(q.near_origin[k] - q.far_origin[k]));
    }
    q.inverse_z = 1.0 / e[int(q.kz)];
    q.shear_x = e[int(q.kx)] * q.inverse_z;
    q.shear_y = e[int(q.ky)] * q.inverse_z;
    q.filter_origin[0] = float(o[int(q.kx)]);
    q.filter_origin[1] = float(o[int(q.ky)]);
    q.filter_origin[2] = float(o[int(q.kz)]);
    q.filter_shear_x = float(q.shear_x);
    q.filter_shear_y = float(q.shear_y);
    return true;
}

bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c) {
    if (!is_usable(a) || !is_usable(b) || !is_usable(c)) return true;
    const Vec3d e1 = Vec3d(b) - Vec3d(a);
    const Vec3d e2 = Vec3d(c) - Vec3d(a);
    // Separately rounded products: zero for exactly parallel edges
    return e1.y * e2.z == e1.z * e2.y && e1.z * e2.x == e1.x * e2.z && e1.x * e2.y == e1.y * e2.x;
}

}  // namespace velatura::accel
