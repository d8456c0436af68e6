// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <algorithm>
#include <cmath>

/// Isotropic GGX microfacets in the local frame (z = normal). Directions are unit with z
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

/// Unnormalised microfacet normal from the spherical cap of directions that `o` (wo, stretched and
/// unit) can reflect to, of which `bound` is cut away below. Ref: Dupuy & Benyoub 2023, "Sampling
/// Visible GGX Normals with Spherical Caps".
template <class T>
Imath::Vec3<T> cap_normal(const Imath::Vec3<T>& o, T bound, T alpha, const Imath::Vec2<T>& u) {
    const T one_minus_z = u.y * (T(1) + bound);
    const T z = T(1) - one_minus_z;
    const T r = std::sqrt(std::max(one_minus_z * (T(1) + z), T(0)));
    const T phi = T(2 * pi_d) * u.x;
    return {alpha * (o.x + r * std::cos(phi)), alpha * (o.y + r * std::sin(phi)), o.z + z};
}

template <class T>
Imath::Vec3<T> stretched(const Imath::Vec3<T>& wo, T alpha) {
    const Imath::Vec3<T> s(alpha * wo.x, alpha * wo.y, wo.z);
    return s / std::sqrt(s.dot(s));
}

}  // namespace ggx_detail

/// Smith's masking: share of the microfacets facing a direction that are visible from it. cos > 0.
template <class T>
T ggx_g1(T cos, T alpha) {
    return T(2) * cos / (cos + std::sqrt(alpha * alpha * (T(1) - cos * cos) + cos * cos));
}

/// Density [1/sr] of the normals visible from wo, at a wm with cos_m = wo·wm > 0. Ref: Heitz 2018,
/// "Sampling the GGX Distribution of Visible Normals".
template <class T>
T ggx_normal_pdf(const Imath::Vec3<T>& wo, const Imath::Vec3<T>& wm, T cos_m, T alpha) {
    const T t = std::sqrt(alpha * alpha * (wo.x * wo.x + wo.y * wo.y) + wo.z * wo.z);
    return ggx_d(wm, alpha) * T(2) * cos_m / (wo.z + t);
}

/// Draws a normal visible from wo, with density ggx_normal_pdf. Zero vector: none.
template <class T>
Imath::Vec3<T> ggx_sample_normal(const Imath::Vec3<T>& wo, T alpha, const Imath::Vec2<T>& u) {
    const Imath::Vec3<T> o = ggx_detail::stretched(wo, alpha);
    const Imath::Vec3<T> m = ggx_detail::cap_normal(o, o.z, alpha, u);
    const T length2 = m.dot(m);
    if (!(length2 > T(0))) return Imath::Vec3<T>(T(0));
    return m / std::sqrt(length2);
}

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
    const V o = ggx_detail::stretched(wo, alpha);
    V m = ggx_detail::cap_normal(o, ggx_detail::cap_bound(wo, alpha) * o.z, alpha, u);
    const T length2 = m.dot(m);
    if (!(length2 > T(0))) return V(T(0));
    m /= std::sqrt(length2);
    return m * (T(2) * wo.dot(m)) - wo;
}

}  // namespace velatura::shading
