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
inline float next_float_down(float v) { return -next_float_up(-v); }

/// next_float_up(v) for step = 1 and next_float_down(v) for step = −1, without branches; v finite.
inline float next_float_toward(float v, int32_t step) {
    // Floats in order, as integers of either sign; both zeros are 0
    const int32_t bits = std::bit_cast<int32_t>(v);
    const int32_t sign = bits >> 31;
    const int32_t next = (((bits & 0x7fffffff) ^ sign) - sign) + step;
    const int32_t next_sign = next >> 31;
    return std::bit_cast<float>(((next ^ next_sign) - next_sign) | (next_sign & int32_t(0x80000000)));
}

template <class T>
constexpr T sqr(T x) {
    return x * x;
}

/// Square root of max(x, 0).
inline float safe_sqrt(float x) { return std::sqrt(std::max(x, 0.0f)); }
inline double safe_sqrt(double x) { return std::sqrt(std::max(x, 0.0)); }

/// Arc cosine of x clamped to [−1, 1].
inline float safe_acos(float x) { return std::acos(std::clamp(x, -1.0f, 1.0f)); }
inline double safe_acos(double x) { return std::acos(std::clamp(x, -1.0, 1.0)); }

/// a·b − c·d with an error of at most 1.5 ulp (Kahan's algorithm; the FMA is wanted here).
inline float difference_of_products(float a, float b, float c, float d) {
    const float cd = c * d;
    const float difference = std::fma(a, b, -cd);
    const float error = std::fma(-c, d, cd);
    return difference + error;
}

}  // namespace velatura
