// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/floats.h"

#include <Imath/ImathBox.h>
#include <Imath/ImathColor.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace velatura {

using Vec2 = Imath::V2f;
using Vec3 = Imath::V3f;
using Vec2d = Imath::V2d;
using Vec3d = Imath::V3d;
using Vec2i = Imath::V2i;
using Mat3d = Imath::M33d;
using Mat4 = Imath::M44f;   ///< row vectors: v' = v · M, translation in row 3
using Mat4d = Imath::M44d;  ///< the same in double; USD's convention
using Box3 = Imath::Box3f;
using Box3d = Imath::Box3d;
using Rgb = Imath::C3f;  ///< scene-linear color in the working space

inline constexpr float pi = 3.14159265358979323846f;
inline constexpr float inv_pi = 0.31830988618379067154f;
inline constexpr double pi_d = 3.14159265358979323846;

/// Relative luminance of linear Rec.709.
inline float luminance(const Rgb& c) {
    return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
}

inline float max_component(const Rgb& c) {
    return std::max(c.x, std::max(c.y, c.z));
}

/// Of either sign of zero. By the bits: paths ask this of every product, and comparisons of floats
/// take thrice as long.
inline bool is_black(const Rgb& c) {
    const auto bits = [](float v) { return std::bit_cast<uint32_t>(v); };
    return ((bits(c.x) | bits(c.y) | bits(c.z)) << 1) == 0;
}

inline bool is_finite(const Imath::V3f& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Whether all 16 entries of m lie strictly between −limit and limit; NaN does not.
template <class T>
inline bool is_finite(const Imath::Matrix44<T>& m, T limit = std::numeric_limits<T>::infinity()) {
    for (int i = 0; i < 4; ++i) {
        for (int k = 0; k < 4; ++k) {
            if (!(std::abs(m[i][k]) < limit)) return false;
        }
    }
    return true;
}

/// Nearest float vector.
inline Vec3 to_float(const Vec3d& v) {
    return {float(v.x), float(v.y), float(v.z)};
}

inline float abs_dot(const Vec3& a, const Vec3& b) {
    return std::abs(a.dot(b));
}

/// Cross product, each component within 0.51 ulp.
inline Vec3 cross(const Vec3& a, const Vec3& b) {
    return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
            difference_of_products(a.x, b.y, a.y, b.x)};
}

/// Unit vector along v; v must not be zero. Scales by a power of two first, so that neither tiny
/// nor huge vectors lose their length to underflow or overflow.
template <class T>
inline Imath::Vec3<T> normalize(const Imath::Vec3<T>& v) {
    const T largest = std::max(std::abs(v.x), std::max(std::abs(v.y), std::abs(v.z)));
    const Imath::Vec3<T> w = v * normalizing_scale(largest);
    return w / std::sqrt(w.dot(w));
}

/// v, whose length is 1 but for rounding, with its length put right: a Newton step, without root or
/// division. A length of 1 + e becomes 1 − 1.5 e².
template <class T>
inline Imath::Vec3<T> renormalize(const Imath::Vec3<T>& v) {
    return v * (T(1.5) - T(0.5) * v.dot(v));
}

/// Affine transforms of points, directions and normals by row-vector matrices (no projective
/// division).
template <class T>
inline Imath::Vec3<T> transform_point(const Imath::Vec3<T>& p, const Imath::Matrix44<T>& m) {
    return {p.x * m[0][0] + p.y * m[1][0] + p.z * m[2][0] + m[3][0],
            p.x * m[0][1] + p.y * m[1][1] + p.z * m[2][1] + m[3][1],
            p.x * m[0][2] + p.y * m[1][2] + p.z * m[2][2] + m[3][2]};
}

template <class T>
inline Imath::Vec3<T> transform_direction(const Imath::Vec3<T>& v, const Imath::Matrix44<T>& m) {
    return {v.x * m[0][0] + v.y * m[1][0] + v.z * m[2][0],
            v.x * m[0][1] + v.y * m[1][1] + v.z * m[2][1],
            v.x * m[0][2] + v.y * m[1][2] + v.z * m[2][2]};
}

/// Cofactor matrix of the upper 3×3: transforms normals (n' = n · C, not normalized) without an
/// inverse, also for singular matrices; flips with the sign of the determinant.
template <class T>
inline Imath::Matrix33<T> cofactor_matrix(const Imath::Matrix44<T>& m) {
    return Imath::Matrix33<T>(
        m[1][1] * m[2][2] - m[1][2] * m[2][1], m[1][2] * m[2][0] - m[1][0] * m[2][2],
        m[1][0] * m[2][1] - m[1][1] * m[2][0], m[2][1] * m[0][2] - m[2][2] * m[0][1],
        m[2][2] * m[0][0] - m[2][0] * m[0][2], m[2][0] * m[0][1] - m[2][1] * m[0][0],
        m[0][1] * m[1][2] - m[0][2] * m[1][1], m[0][2] * m[1][0] - m[0][0] * m[1][2],
        m[0][0] * m[1][1] - m[0][1] * m[1][0]);
}

template <class T>
inline T determinant3(const Imath::Matrix44<T>& m) {
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
           m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/// Right-handed orthonormal frame; z is the given unit vector.
/// Ref: Duff et al. 2017, "Building an Orthonormal Basis, Revisited", JCGT 6(1).
struct Frame {
    Vec3 x, y, z;

    static Frame from_z(const Vec3& n) {
        const float sign = std::copysign(1.0f, n.z);
        const float a = -1.0f / (sign + n.z);
        const float b = n.x * n.y * a;
        return {{1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x},
                {b, sign + n.y * n.y * a, -n.y},
                n};
    }

    Vec3 to_local(const Vec3& v) const { return {v.dot(x), v.dot(y), v.dot(z)}; }

    Vec3 from_local(const Vec3& v) const { return x * v.x + y * v.y + z * v.z; }
};

}  // namespace velatura
