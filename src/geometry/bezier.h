// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace velatura::geometry {

/// Cubic Bézier curves by their four control values; u in [0, 1], exact at both ends.

template <class T>
inline T mixed(const T& a, const T& b, double u) {
    return a * (1.0 - u) + b * u;
}

/// The blossom: bezier_point at u = v = w, symmetric, affine in each.
template <class T>
inline T blossom(const T c[4], double u, double v, double w) {
    const T a = mixed(c[0], c[1], u), b = mixed(c[1], c[2], u), d = mixed(c[2], c[3], u);
    return mixed(mixed(a, b, v), mixed(b, d, v), w);
}

template <class T>
inline T bezier_point(const T c[4], double u) {
    return blossom(c, u, u, u);
}

template <class T>
inline T bezier_derivative(const T c[4], double u) {
    return mixed(mixed(T(c[1] - c[0]), T(c[2] - c[1]), u), mixed(T(c[2] - c[1]), T(c[3] - c[2]), u),
                 u) *
           3.0;
}

template <class T>
inline T bezier_second(const T c[4], double u) {
    return mixed(T(c[2] - c[1] - (c[1] - c[0])), T(c[3] - c[2] - (c[2] - c[1])), u) * 6.0;
}

/// Control values of the part between u = a and b. Neighbors share their end to the bit.
template <class T>
inline void bezier_part(const T c[4], double a, double b, T out[4]) {
    out[0] = blossom(c, a, a, a);
    out[1] = blossom(c, a, a, b);
    out[2] = blossom(c, a, b, b);
    out[3] = blossom(c, b, b, b);
}

/// Cuts a polynomial in Bernstein form at u: both halves in Bernstein form.
template <size_t n>
inline void bernstein_split(const double (&c)[n], double u, double (&left)[n], double (&right)[n]) {
    for (size_t i = 0; i < n; ++i) right[i] = c[i];
    for (size_t i = 0; i < n; ++i) {
        left[i] = right[0];
        for (size_t k = 0; k + i + 1 < n; ++k) right[k] = mixed(right[k], right[k + 1], u);
    }
}

}  // namespace velatura::geometry
