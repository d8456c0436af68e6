// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/ray_query.h"
#include "base/math.h"
#include "geometry/surface_point.h"

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

[[gnu::always_inline]] inline Float4 absolute(const Float4& v) {
    return __builtin_bit_cast(Float4, __builtin_bit_cast(Int4, v) & 0x7fffffff);
}

/// v >= 0 with the signs of `signs`.
[[gnu::always_inline]] inline Double4 with_signs(const Double4& v, const Double4& signs) {
    return __builtin_bit_cast(
        Double4, __builtin_bit_cast(Long4, v) | (__builtin_bit_cast(Long4, signs) & sign_bit));
}

/// v >= 0 with the signs of `signs`.
[[gnu::always_inline]] inline Float4 with_signs(const Float4& v, const Float4& signs) {
    const Int4 sign = Int4{} + std::numeric_limits<int32_t>::min();
    return __builtin_bit_cast(
        Float4, __builtin_bit_cast(Int4, v) | (__builtin_bit_cast(Int4, signs) & sign));
}

template <class Vector, class T>
[[gnu::always_inline]] inline void store(T (&to)[4], const Vector& v) {
    __builtin_memcpy(to, &v, sizeof(to));
}

}  // namespace axes

/// Sets the slab constants from origins moved outward and the inverse of the scaled direction.
/// Without branches: the signs of directions are what a processor cannot predict.
[[gnu::always_inline]] inline void set_slabs(QueryRay& q,
                                             const axes::Float4& near_origin,
                                             const axes::Float4& far_origin,
                                             const axes::Float4& inverse,
                                             float widening) {
    using namespace axes;
    store(q.near_origin, near_origin);
    store(q.far_origin, far_origin);
    store(q.near_inverse, inverse * (1.0f - widening));
    store(q.far_inverse, inverse * (1.0f + widening));
    const Int4 backward = (__builtin_bit_cast(Int4, inverse) >> 31) & 3, axis = {0, 1, 2, 3};
    store(q.near_row, axis + backward);
    store(q.far_row, axis + 3 - backward);
}

/// Axis of the largest component (of magnitudes), the first of equal ones.
template <class T>
[[gnu::always_inline]] inline uint32_t largest_axis(const T& x, const T& y, const T& z) {
    // Without branches: nothing predicts the axis
    const auto xy = uint32_t(y > x);
    return xy + (2 - xy) * uint32_t(z > std::max(x, y));
}

/// What hit_triangle and the filter before it need, from the scaled direction e.
/// reach: no corner of the tree is further from the origin along an axis. rounding: bound of the
/// error of float(o). slop: |near_origin - far_origin|.
template <class Origin, class Direction>
[[gnu::always_inline]] inline void set_shear(QueryRay& q,
                                             const Origin& o,
                                             const Direction& e,
                                             uint32_t kz,
                                             float reach,
                                             float rounding,
                                             float slop) {
    q.kz = kz;
    q.kx = (0x000201u >> (8 * kz)) & 0xff;  // 1, 2, 0
    q.ky = (0x010002u >> (8 * kz)) & 0xff;  // 2, 0, 1
    q.permuted_origin[0] = double(o[q.kx]);
    q.permuted_origin[1] = double(o[q.ky]);
    q.permuted_origin[2] = double(o[q.kz]);
    q.inverse_z = 1.0 / double(e[q.kz]);
    q.shear_x = double(e[q.kx]) * q.inverse_z;
    q.shear_y = double(e[q.ky]) * q.inverse_z;
    for (int k = 0; k < 3; ++k) q.filter_origin[k] = float(q.permuted_origin[k]);
    q.filter_shear_x = float(q.shear_x);
    q.filter_shear_y = float(q.shear_y);
    q.filter_inverse_z = float(q.inverse_z);
    // A difference, the shear and its product round by 2^-24 of at most 2·reach each
    const float error = 0x1p-19f * reach + 8.0f * rounding;
    // Products of larger coordinates overflow: then the filter must decide nothing
    const bool is_safe = reach < 0x1p60f;
    q.filter_error = is_safe ? error : 0.0f;
    q.filter_error_2 = is_safe ? error * error + 1e-37f : std::numeric_limits<float>::infinity();
    // With room for a t that vanishes on the way back from scaled t
    q.filter_t_margin = 4.0f * (slop + rounding) + float(0x1p-125 * q.scaled_from_t);
}

/// The same as make_query for rays in floats that are neither very far nor very small: no doubles
/// but in the shear. False for those that it leaves to make_query.
[[gnu::always_inline]] inline bool make_usual_query(const geometry::Ray& ray,
                                                    const QueryBounds& bounds,
                                                    const QuerySlack& slack,
                                                    QueryRay& q) {
    using namespace axes;
    const Float4 o = {ray.o.x, ray.o.y, ray.o.z, 0}, d = {ray.d.x, ray.d.y, ray.d.z, 1};
    const Float4 o_size = absolute(o), d_size = absolute(d);
    const float longest = largest(d_size);
    // Sums, as a maximum may lose what is not a number; written so that NaN fails
    const float o_sum = o_size[0] + o_size[1] + o_size[2];
    const float d_sum = d_size[0] + d_size[1] + d_size[2];
    if (!(o_sum < 0x1p100f && d_sum < 0x1p60f && longest > 0x1p-60f)) return false;
    q.t_from_scaled = q.scaled_from_t = 1;

    Float4 lower, upper;
    __builtin_memcpy(&lower, bounds.lower_float, sizeof(lower));
    __builtin_memcpy(&upper, bounds.upper_float, sizeof(upper));
    const Float4 below = o - lower, above = upper - o;
    const float reach = largest(below > above ? below : above);
    // Twice what exact arithmetic would ask for: room for the rounding of all this to floats, of
    // which the last term is that of the smallest ones
    const Float4 margin = float(slack.origin) * 2.0f * reach + o_size * 0x1p-22f + 0x1p-148f;
    const Float4 outward = with_signs(margin, d);
    const Float4 steepness = 1.0f / d_size, limit = Float4{} + 1e38f;
    set_slabs(q, o + outward, o - outward, with_signs(steepness < limit ? steepness : limit, d),
              slack.inverse);
    float origin[4], direction[4];
    store(origin, o);
    store(direction, d);
    set_shear(q, origin, direction, largest_axis(d_size[0], d_size[1], d_size[2]), reach, 0.0f,
              4.0f * largest(margin));
    return true;
}

/// Prepares origin + t·d (the tree's space) for a tree within `bounds`. Elements 3 have no meaning.
/// Returns: false when the ray cannot meet anything: d zero or something not finite or too large.
[[gnu::always_inline]] inline bool make_query(const axes::Double4& origin,
                                              const axes::Double4& d,
                                              const QueryBounds& bounds,
                                              const QuerySlack& slack,
                                              QueryRay& q) {
    using namespace axes;
    const Double4 o_size = absolute(origin), d_size = absolute(d);
    const uint32_t kz = largest_axis(d_size[0], d_size[1], d_size[2]);
    // Written so that NaN fails
    const double limit = double(coordinate_limit), longest = largest(d_size);
    if (!(o_size[0] < limit && o_size[1] < limit && o_size[2] < limit)) return false;
    if (!(d_size[0] <= 0x1p300 && d_size[1] <= 0x1p300 && d_size[2] <= 0x1p300)) return false;
    if (!(longest >= 0x1p-300)) return false;

    // Scale d by a power of two: exact, and keeps the float part away from overflow
    const uint64_t exponent = std::bit_cast<uint64_t>(longest) >> 52;
    const double scale = std::bit_cast<double>((2046 - exponent) << 52);
    q.t_from_scaled = scale;
    q.scaled_from_t = std::bit_cast<double>(exponent << 52);

    const Double4 e = d * scale;
    Double4 lower, upper;
    __builtin_memcpy(&lower, bounds.lower, sizeof(lower));
    __builtin_memcpy(&upper, bounds.upper, sizeof(upper));
    // Largest distance along an axis to the far side of the bounds
    const Double4 below = origin - lower, above = upper - origin;
    const double reach = largest(below > above ? below : above);
    const Double4 margin = slack.origin * 2.0 * reach + o_size * 0x1p-22 + 0x1p-148;
    const Double4 outward = with_signs(margin, e);
    // A finite bound instead of infinity keeps 0·inf out; distances are far smaller than 1e38
    const Double4 steepness = 1.0 / absolute(e), max = Double4{} + 1e38;
    set_slabs(q, __builtin_convertvector(origin + outward, Float4),
              __builtin_convertvector(origin - outward, Float4),
              __builtin_convertvector(with_signs(steepness < max ? steepness : max, e), Float4),
              slack.inverse);
    const Float4 rounded = __builtin_convertvector(origin, Float4);
    const double rounding = largest(absolute(__builtin_convertvector(rounded, Double4) - origin));
    set_shear(q, origin, e, kz, float(reach) * (1.0f + 0x1p-20f), float(rounding) * 2.0f,
              4.0f * float(largest(margin)));
    return true;
}

/// The same for vectors.
[[gnu::always_inline]] inline bool make_query(const Vec3d& o,
                                              const Vec3d& d,
                                              const QueryBounds& bounds,
                                              const QuerySlack& slack,
                                              QueryRay& q) {
    return make_query(axes::Double4{o.x, o.y, o.z, 0}, axes::Double4{d.x, d.y, d.z, 1}, bounds,
                      slack, q);
}

/// A ray of render space, made ready for a tree in it.
[[gnu::always_inline]] inline bool make_query(const geometry::Ray& ray,
                                              const QueryBounds& bounds,
                                              const QuerySlack& slack,
                                              QueryRay& q) {
    return make_usual_query(ray, bounds, slack, q) ||
           make_query(Vec3d(ray.o), Vec3d(ray.d), bounds, slack, q);
}

}  // namespace velatura::accel
