// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace velatura {

/// Half the distance from 1 to the next float: the unit roundoff u.
inline constexpr float machine_epsilon = std::numeric_limits<float>::epsilon() * 0.5f;

/// Bound of the relative error of n rounded operations in a row, n·u / (1 − n·u).
/// Ref: Higham 2002, "Accuracy and Stability of Numerical Algorithms", section 3.1.
constexpr float gamma_bound(int n) {
    return float(n) * machine_epsilon / (1.0f - float(n) * machine_epsilon);
}

/// The next float towards +infinity (−0 counts as +0; +infinity stays).
inline float next_float_up(float v) {
    if (std::isinf(v) && v > 0.0f) return v;
    if (v == 0.0f) v = 0.0f;
    const uint32_t bits = std::bit_cast<uint32_t>(v);
    return std::bit_cast<float>(v >= 0.0f ? (bits & 0x7fffffffu) + 1u : bits - 1u);
}

/// The next float towards −infinity.
inline float next_float_down(float v) {
    return -next_float_up(-v);
}

template <class T>
constexpr T sqr(T x) {
    return x * x;
}

/// Square root of max(x, 0).
inline float safe_sqrt(float x) {
    return std::sqrt(std::max(x, 0.0f));
}

inline double safe_sqrt(double x) {
    return std::sqrt(std::max(x, 0.0));
}

/// Arc cosine of x clamped to [−1, 1].
inline float safe_acos(float x) {
    return std::acos(std::clamp(x, -1.0f, 1.0f));
}

inline double safe_acos(double x) {
    return std::acos(std::clamp(x, -1.0, 1.0));
}

/// a·b − c·d with an error of less than 0.51 ulp: the products are exact in double.
inline float difference_of_products(float a, float b, float c, float d) {
    return float(double(a) * double(b) - double(c) * double(d));
}

/// The power of two that brings x into [1, 2), or as near to it as a normal number can: multiplying
/// by it is exact. x finite and not below zero.
inline float normalizing_scale(float x) {
    const int32_t exponent = std::bit_cast<int32_t>(x) >> 23;
    return std::bit_cast<float>(std::max(254 - exponent, 1) << 23);
}

inline double normalizing_scale(double x) {
    const int64_t exponent = std::bit_cast<int64_t>(x) >> 52;
    return std::bit_cast<double>(std::max<int64_t>(2046 - exponent, 1) << 52);
}

}  // namespace velatura
