// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <algorithm>
#include <cmath>

/// Isotropic GGX microfacet reflection in the local frame (z = normal). Directions are unit with z
/// > 0 where not said otherwise; alpha in [1e-4, 1]. Templates, so that the oracles of the tests
/// run the same formulas in double.
namespace velatura::shading {

/// Distribution of normals [1/sr] from the components of wm, not from its cosine: keeps its digits
/// at small alpha. Ref: Walter et al. 2007; Heitz 2014, "Understanding the Masking-Shadowing
/// Function", equation 85.
template <class T>
T ggx_d(const Imath::Vec3<T>& wm, T alpha) {
    const T x = wm.x / alpha, y = wm.y / alpha;
    const T s = x * x + y * y + wm.z * wm.z;
    return T(1) / (T(pi_d) * alpha * alpha * s * s);
}

/// Height-correlated Smith G2 / (4 cosθ_o cosθ_i). Ref: Heitz 2014, equation 99.
template <class T>
T ggx_visibility(T cos_o, T cos_i, T alpha) {
    const T a2 = alpha * alpha;
    const T o = cos_i * std::sqrt(a2 + (T(1) - a2) * cos_o * cos_o);
    const T i = cos_o * std::sqrt(a2 + (T(1) - a2) * cos_i * cos_i);
    return T(0.5) / (o + i);
}

namespace ggx_detail {

/// Factor k by which the cap of reflections is cut. Ref: Eto & Tokuyoshi 2023, equation 5.
template <class T>
T cap_bound(const Imath::Vec3<T>& wo, T alpha) {
    const T s = T(1) + std::sqrt(wo.x * wo.x + wo.y * wo.y);
    const T a2 = std::min(alpha, T(1)) * std::min(alpha, T(1));
    const T s2 = s * s;
    return (T(1) - a2) * s2 / (s2 + a2 * wo.z * wo.z);
}

}  // namespace ggx_detail

/// Factor (2·(k·z + t)) with pdf(wi) = D(wm) / factor; f·cosθ_i / pdf needs no D.
template <class T>
T ggx_pdf_divisor(const Imath::Vec3<T>& wo, T alpha) {
    const T t = std::sqrt(alpha * alpha * (wo.x * wo.x + wo.y * wo.y) + wo.z * wo.z);
    return T(2) * (ggx_detail::cap_bound(wo, alpha) * wo.z + t);
}

/// Density [1/sr] of the direction drawn by ggx_sample, given its half vector. It integrates to 1
/// over the directions drawn, some of which may lie below the surface.
template <class T>
T ggx_pdf(const Imath::Vec3<T>& wo, const Imath::Vec3<T>& wm, T alpha) {
    return ggx_d(wm, alpha) / ggx_pdf_divisor(wo, alpha);
}

/// Draws a reflected direction from the distribution of visible normals, bounded so that most
/// directions below the surface are never drawn. wi may have z <= 0: then nothing is reflected.
/// Zero vector: no direction. Ref: Eto & Tokuyoshi 2023, "Bounded VNDF Sampling for Smith-GGX
/// Reflections"; Dupuy & Benyoub 2023.
template <class T>
Imath::Vec3<T> ggx_sample(const Imath::Vec3<T>& wo, T alpha, const Imath::Vec2<T>& u) {
    using V = Imath::Vec3<T>;
    const V stretched(alpha * wo.x, alpha * wo.y, wo.z);
    const V o = stretched / std::sqrt(stretched.dot(stretched));
    const T b = ggx_detail::cap_bound(wo, alpha) * o.z;
    const T one_minus_z = u.y * (T(1) + b);
    const T z = T(1) - one_minus_z;
    const T r = std::sqrt(std::max(one_minus_z * (T(1) + z), T(0)));
    const T phi = T(2 * pi_d) * u.x;
    V m(alpha * (o.x + r * std::cos(phi)), alpha * (o.y + r * std::sin(phi)), o.z + z);
    const T length2 = m.dot(m);
    if (!(length2 > T(0))) return V(T(0));
    m /= std::sqrt(length2);
    return m * (T(2) * wo.dot(m)) - wo;
}

}  // namespace velatura::shading
