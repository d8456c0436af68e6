// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/ray_query.h"
#include "base/math.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace velatura::accel {

/// The three axes side by side, as one or two registers of the instruction set in use. All of it is
/// inlined into the kernels; no calling convention is involved.
namespace axes {

using Double4 = double __attribute__((vector_size(32)));
using Long4 = int64_t __attribute__((vector_size(32)));
using Float4 = float __attribute__((vector_size(16)));
using Int4 = int32_t __attribute__((vector_size(16)));

inline constexpr int64_t sign_bit = std::numeric_limits<int64_t>::min();

[[gnu::always_inline]] inline double largest(const Double4& v) {
    return std::max(std::max(v[0], v[1]), v[2]);
}

[[gnu::always_inline]] inline float largest(const Float4& v) {
    return std::max(std::max(v[0], v[1]), v[2]);
}

[[gnu::always_inline]] inline Double4 absolute(const Double4& v) {
    return __builtin_bit_cast(Double4, __builtin_bit_cast(Long4, v) & ~sign_bit);
}

/// v >= 0 with the signs of `signs`.
[[gnu::always_inline]] inline Double4 with_signs(const Double4& v, const Double4& signs) {
    return __builtin_bit_cast(
        Double4, __builtin_bit_cast(Long4, v) | (__builtin_bit_cast(Long4, signs) & sign_bit));
}

template <class Vector, class T>
[[gnu::always_inline]] inline void store(T (&to)[4], const Vector& v) {
    __builtin_memcpy(to, &v, sizeof(to));
}

}  // namespace axes

/// Sets the slab constants for the unscaled origin o, known up to `error`, and the scaled direction
/// e. Without branches: the signs of directions are what a processor cannot predict.
[[gnu::always_inline]] inline void set_slabs(
    QueryRay& q, const axes::Double4& o, const axes::Double4& e, double error, float widening) {
    using namespace axes;
    // Room for the rounding to float as well, of which the last term is that of the smallest floats
    const Double4 margin = error * (1.0 + 0x1p-22) + absolute(o) * 0x1p-23 + 0x1p-149;
    const Double4 outward = with_signs(margin, e);
    const Float4 near = __builtin_convertvector(o + outward, Float4);
    const Float4 far = __builtin_convertvector(o - outward, Float4);
    store(q.near_origin, near);
    store(q.far_origin, far);
    const Float4 gap = near - far;
    q.slop = largest(gap < 0 ? -gap : gap);
    // A finite bound instead of infinity keeps 0·inf out; distances are far smaller than 1e38
    const Double4 steepness = 1.0 / absolute(e), limit = Double4{} + 1e38;
    const Float4 inverse =
        __builtin_convertvector(with_signs(steepness < limit ? steepness : limit, e), Float4);
    store(q.near_inverse, inverse * (1.0f - widening));
    store(q.far_inverse, inverse * (1.0f + widening));
    const Int4 backward = (__builtin_bit_cast(Int4, inverse) >> 31) & 3, axis = {0, 1, 2, 3};
    store(q.near_row, axis + backward);
    store(q.far_row, axis + 3 - backward);
}

/// Prepares o + t·d (the tree's space) for a tree within `bounds`.
/// Returns: false when the ray cannot meet anything: d zero or something not finite or too large.
[[gnu::always_inline]] inline bool make_query(const Vec3d& o,
                                              const Vec3d& d,
                                              const QueryBounds& bounds,
                                              const QuerySlack& slack,
                                              QueryRay& q) {
    using namespace axes;
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

    const Double4 origin = {o.x, o.y, o.z, 0}, e = Double4{d.x, d.y, d.z, 1} * scale;
    Double4 lower, upper;
    __builtin_memcpy(&lower, bounds.lower, sizeof(lower));
    __builtin_memcpy(&upper, bounds.upper, sizeof(upper));
    // Largest distance along an axis to the far side of the bounds
    const Double4 below = origin - lower, above = upper - origin;
    const double reach = largest(below > above ? below : above);
    set_slabs(q, origin, e, slack.origin * reach, slack.inverse);

    store(q.origin, origin);
    const Float4 rounded = __builtin_convertvector(origin, Float4);
    const Double4 lost = __builtin_convertvector(rounded, Double4) - origin;
    q.filter_error = float(largest(lost < 0 ? -lost : lost));
    q.inverse_z = 1.0 / e[q.kz];
    q.filter_inverse_z = float(q.inverse_z);
    // With room for a t that vanishes on the way back from scaled t
    q.filter_t_margin = 4.0f * (q.slop + q.filter_error) + float(0x1p-125 * q.scaled_from_t);
    q.shear_x = e[q.kx] * q.inverse_z;
    q.shear_y = e[q.ky] * q.inverse_z;
    q.filter_origin[0] = rounded[q.kx];
    q.filter_origin[1] = rounded[q.ky];
    q.filter_origin[2] = rounded[q.kz];
    q.filter_shear_x = float(q.shear_x);
    q.filter_shear_y = float(q.shear_y);
    return true;
}

}  // namespace velatura::accel
