// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <algorithm>
#include <cmath>

/// GGX microfacets in the local frame (z = normal). Directions are unit with z > 0 where not said
/// otherwise. alpha: a number in [1e-4, 1] for isotropic facets, or the widths along x and y, each
/// in [1e-4, √2]. Templates, so that the oracles of the tests run the same formulas in double.
namespace velatura::shading {

namespace ggx_detail {

template <class T>
T along_x(T alpha) {
    return alpha;
}

template <class T>
T along_x(const Imath::Vec2<T>& alpha) {
    return alpha.x;
}

template <class T>
T along_y(T alpha) {
    return alpha;
}

template <class T>
T along_y(const Imath::Vec2<T>& alpha) {
    return alpha.y;
}

/// Length of w with x and y scaled by alpha.
template <class T>
T stretched_length(const Imath::Vec3<T>& w, T alpha) {
    return std::sqrt(alpha * alpha * (w.x * w.x + w.y * w.y) + w.z * w.z);
}

template <class T>
T stretched_length(const Imath::Vec3<T>& w, const Imath::Vec2<T>& alpha) {
    const T x = alpha.x * w.x, y = alpha.y * w.y;
    return std::sqrt(x * x + y * y + w.z * w.z);
}

}  // namespace ggx_detail

/// Distribution of normals [1/sr] from the components of wm, not from its cosine: keeps its digits
/// at small alpha. Ref: Walter et al. 2007; Heitz 2014, "Understanding the Masking-Shadowing
/// Function", equation 85.
template <class T, class Alpha>
T ggx_d(const Imath::Vec3<T>& wm, const Alpha& alpha) {
    const T alpha_x = ggx_detail::along_x(alpha), alpha_y = ggx_detail::along_y(alpha);
    const T x = wm.x / alpha_x, y = wm.y / alpha_y;
    const T s = x * x + y * y + wm.z * wm.z;
    return T(1) / (T(pi_d) * alpha_x * alpha_y * s * s);
}

/// Height-correlated Smith G2 / (4 cosθ_o cosθ_i). Ref: Heitz 2014, equation 99.
template <class T>
T ggx_visibility(T cos_o, T cos_i, T alpha) {
    const T a2 = alpha * alpha;
    const T o = cos_i * std::sqrt(a2 + (T(1) - a2) * cos_o * cos_o);
    const T i = cos_o * std::sqrt(a2 + (T(1) - a2) * cos_i * cos_i);
    return T(0.5) / (o + i);
}

/// The same from the directions, which anisotropic facets ask for; isotropic ones look at z alone.
template <class T>
T ggx_visibility(const Imath::Vec3<T>& wo, const Imath::Vec3<T>& wi, const Imath::Vec2<T>& alpha) {
    return T(0.5) / (wi.z * ggx_detail::stretched_length(wo, alpha) +
                     wo.z * ggx_detail::stretched_length(wi, alpha));
}

template <class T>
T ggx_visibility(const Imath::Vec3<T>& wo, const Imath::Vec3<T>& wi, T alpha) {
    return ggx_visibility(wo.z, wi.z, alpha);
}

namespace ggx_detail {

/// Factor k by which the cap of reflections is cut. Ref: Eto & Tokuyoshi 2023, equation 5; the
/// smaller of two widths.
template <class T, class Alpha>
T cap_bound(const Imath::Vec3<T>& wo, const Alpha& alpha) {
    const T s = T(1) + std::sqrt(wo.x * wo.x + wo.y * wo.y);
    const T min = std::min(std::min(along_x(alpha), along_y(alpha)), T(1));
    const T a2 = min * min;
    const T s2 = s * s;
    return (T(1) - a2) * s2 / (s2 + a2 * wo.z * wo.z);
}

/// Unnormalized microfacet normal from the spherical cap of directions that `o` (wo, stretched and
/// unit) can reflect to, of which `bound` is cut away below. Ref: Dupuy & Benyoub 2023, "Sampling
/// Visible GGX Normals with Spherical Caps".
/// turn: cosine and sine of the azimuth.
template <class T, class Alpha>
Imath::Vec3<T> cap_normal(
    const Imath::Vec3<T>& o, T bound, const Alpha& alpha, const Imath::Vec2<T>& turn, T u_height) {
    const T one_minus_z = u_height * (T(1) + bound);
    const T z = T(1) - one_minus_z;
    const T r = std::sqrt(std::max(one_minus_z * (T(1) + z), T(0)));
    return {along_x(alpha) * (o.x + r * turn.x), along_y(alpha) * (o.y + r * turn.y), o.z + z};
}

template <class T, class Alpha>
Imath::Vec3<T> cap_normal(const Imath::Vec3<T>& o,
                          T bound,
                          const Alpha& alpha,
                          const Imath::Vec2<T>& u) {
    const T phi = T(2 * pi_d) * u.x;
    return cap_normal(o, bound, alpha, Imath::Vec2<T>(std::cos(phi), std::sin(phi)), u.y);
}

template <class T, class Alpha>
Imath::Vec3<T> stretched(const Imath::Vec3<T>& wo, const Alpha& alpha) {
    const Imath::Vec3<T> s(along_x(alpha) * wo.x, along_y(alpha) * wo.y, wo.z);
    return s / std::sqrt(s.dot(s));
}

}  // namespace ggx_detail

/// Smith's masking: share of the microfacets facing a direction that are visible from it. cos > 0.
template <class T>
T ggx_g1(T cos, T alpha) {
    return T(2) * cos / (cos + std::sqrt(alpha * alpha * (T(1) - cos * cos) + cos * cos));
}

template <class T>
T ggx_g1(const Imath::Vec3<T>& w, const Imath::Vec2<T>& alpha) {
    return T(2) * w.z / (w.z + ggx_detail::stretched_length(w, alpha));
}

template <class T>
T ggx_g1(const Imath::Vec3<T>& w, T alpha) {
    return ggx_g1(w.z, alpha);
}

/// Density [1/sr] of the normals visible from wo, at a wm with cos_m = wo·wm > 0. Ref: Heitz 2018,
/// "Sampling the GGX Distribution of Visible Normals".
template <class T, class Alpha>
T ggx_normal_pdf(const Imath::Vec3<T>& wo, const Imath::Vec3<T>& wm, T cos_m, const Alpha& alpha) {
    const T t = ggx_detail::stretched_length(wo, alpha);
    return ggx_d(wm, alpha) * T(2) * cos_m / (wo.z + t);
}

/// Draws a normal visible from wo, with density ggx_normal_pdf. Zero vector: none.
/// turn: cosine and sine of the azimuth.
template <class T, class Alpha>
Imath::Vec3<T> ggx_sample_normal(const Imath::Vec3<T>& wo,
                                 const Alpha& alpha,
                                 const Imath::Vec2<T>& turn,
                                 T u_height) {
    const Imath::Vec3<T> o = ggx_detail::stretched(wo, alpha);
    const Imath::Vec3<T> m = ggx_detail::cap_normal(o, o.z, alpha, turn, u_height);
    const T length2 = m.dot(m);
    if (!(length2 > T(0))) return Imath::Vec3<T>(T(0));
    return m / std::sqrt(length2);
}

template <class T, class Alpha>
Imath::Vec3<T> ggx_sample_normal(const Imath::Vec3<T>& wo,
                                 const Alpha& alpha,
                                 const Imath::Vec2<T>& u) {
    const T phi = T(2 * pi_d) * u.x;
    return ggx_sample_normal(wo, alpha, Imath::Vec2<T>(std::cos(phi), std::sin(phi)), u.y);
}

/// Factor (2·(k·z + t)) with pdf(wi) = D(wm) / factor; f·cosθ_i / pdf needs no D.
template <class T, class Alpha>
T ggx_pdf_divisor(const Imath::Vec3<T>& wo, const Alpha& alpha) {
    const T t = ggx_detail::stretched_length(wo, alpha);
    return T(2) * (ggx_detail::cap_bound(wo, alpha) * wo.z + t);
}

/// Density [1/sr] of the direction drawn by ggx_sample, given its half vector. It integrates to 1
/// over the directions drawn, some of which may lie below the surface.
template <class T, class Alpha>
T ggx_pdf(const Imath::Vec3<T>& wo, const Imath::Vec3<T>& wm, const Alpha& alpha) {
    return ggx_d(wm, alpha) / ggx_pdf_divisor(wo, alpha);
}

/// Draws a reflected direction from the distribution of visible normals, bounded so that most
/// directions below the surface are never drawn. wi may have z <= 0: then nothing is reflected.
/// Zero vector: no direction. Ref: Eto & Tokuyoshi 2023, "Bounded VNDF Sampling for Smith-GGX
/// Reflections"; Dupuy & Benyoub 2023.
template <class T, class Alpha>
Imath::Vec3<T> ggx_sample(const Imath::Vec3<T>& wo, const Alpha& alpha, const Imath::Vec2<T>& u) {
    using V = Imath::Vec3<T>;
    const V o = ggx_detail::stretched(wo, alpha);
    V m = ggx_detail::cap_normal(o, ggx_detail::cap_bound(wo, alpha) * o.z, alpha, u);
    const T length2 = m.dot(m);
    if (!(length2 > T(0))) return V(T(0));
    m /= std::sqrt(length2);
    return m * (T(2) * wo.dot(m)) - wo;
}

}  // namespace velatura::shading
