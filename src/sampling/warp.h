// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <type_traits>

/// Maps from the unit square to the usual domains. Directions are unit with +z as the axis; u in
/// [0,1)^2. Densities are in 1/sr for directions and per area for points.
namespace velatura::sampling {

inline constexpr float inv_2pi = 0.15915494309189533577f;
inline constexpr float inv_4pi = 0.07957747154594766788f;

/// Cosine and sine of x·π/4 for x in [−1, 1], within an ulp or two: Taylor's series, which is short
/// there and needs no branch.
template <class T>
inline void cos_sin_eighth_turn(T x, T& cosine, T& sine) {
    const T a = x * (T(pi_d) / T(4)), s = a * a;
    // 1 − s/(1·2)·(1 − s/(3·4)·(1 − …)), and 1 − s/(2·3)·(1 − s/(4·5)·(1 − …))
    const auto step = [s](T inner, double divisor) { return T(1) - s * T(1.0 / divisor) * inner; };
    T c = T(1), q = T(1);
    if constexpr (sizeof(T) > sizeof(float)) {
        c = step(step(step(step(c, 17 * 18.0), 15 * 16.0), 13 * 14.0), 11 * 12.0);
        q = step(step(step(q, 16 * 17.0), 14 * 15.0), 12 * 13.0);
    }
    cosine = step(step(step(step(step(c, 9 * 10.0), 7 * 8.0), 5 * 6.0), 3 * 4.0), 1 * 2.0);
    sine = a * step(step(step(step(step(q, 10 * 11.0), 8 * 9.0), 6 * 7.0), 4 * 5.0), 2 * 3.0);
}

/// a or b without a branch: for choices that random numbers make, which no processor predicts.
template <class T>
inline T chosen(bool is_first, T a, T b) {
    using Bits = std::conditional_t<sizeof(T) == sizeof(uint32_t), uint32_t, uint64_t>;
    const Bits mask = Bits(0) - Bits(is_first);
    const Bits bits_b = std::bit_cast<Bits>(b);
    return std::bit_cast<T>(bits_b ^ ((std::bit_cast<Bits>(a) ^ bits_b) & mask));
}

/// Uniform point in the unit disk. Ref: Shirley & Chiu 1997, "A Low Distortion Map Between Disk and
/// Square", in the branch-light form of Cline (Shirley's blog, 2011).
template <class T>
inline Imath::Vec2<T> concentric_disk(const Imath::Vec2<T>& u) {
    const T x = T(2) * u.x - T(1);
    const T y = T(2) * u.y - T(1);
    const bool x_leads = std::abs(x) > std::abs(y);
    const T r = chosen(x_leads, x, y), other = chosen(x_leads, y, x);
    if (r == T(0)) return {T(0), T(0)};
    T along, across;
    cos_sin_eighth_turn(other / r, along, across);
    along *= r;
    across *= r;
    return {chosen(x_leads, along, across), chosen(x_leads, across, along)};
}

/// Direction with density cosθ/π (Malley's method). cosθ may be as small as 0.
inline Vec3 cosine_hemisphere(const Vec2& u) {
    const Vec2 d = concentric_disk(u);
    return {d.x, d.y, safe_sqrt(1.0f - d.x * d.x - d.y * d.y)};
}

inline float cosine_hemisphere_pdf(float cos_theta) {
    return std::max(cos_theta, 0.0f) * inv_pi;
}

inline Vec3 uniform_hemisphere(const Vec2& u) {
    const float z = 1.0f - u.x;
    const float r = safe_sqrt(u.x * (2.0f - u.x));
    const float phi = 2.0f * pi * u.y;
    return {r * std::cos(phi), r * std::sin(phi), z};
}

inline constexpr float uniform_hemisphere_pdf = inv_2pi;

inline Vec3 uniform_sphere(const Vec2& u) {
    const float z = 1.0f - 2.0f * u.x;
    const float r = 2.0f * safe_sqrt(u.x * (1.0f - u.x));
    const float phi = 2.0f * pi * u.y;
    return {r * std::cos(phi), r * std::sin(phi), z};
}

inline constexpr float uniform_sphere_pdf = inv_4pi;

}  // namespace velatura::sampling
