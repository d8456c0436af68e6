// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

/// Cosine of the refracted ray, or −1 under total internal reflection. eta = η_t/η_i, cos_i ≥ 0.
inline float refracted_cosine(float cos_i, float eta) {
    if (eta == 1.0f) return cos_i;
    // cos²t = (cos²i + (η−1)(η+1)) / η²; in double, because it cancels at the critical angle
    const double c = double(cos_i), n = double(eta);
    const double square = c * c + (n - 1.0) * (n + 1.0);
    if (square < 0.0) return -1.0f;
    return std::min(float(std::sqrt(square) / n), 1.0f);
}

/// Unpolarized reflectance of a smooth dielectric; 1 under total internal reflection, 0 for eta
/// = 1. eta = η_t/η_i > 0, cos_i in [0, 1].
inline float fresnel_dielectric(float cos_i, float eta) {
    if (eta == 1.0f) return 0.0f;
    cos_i = std::clamp(cos_i, 0.0f, 1.0f);
    const float cos_t = refracted_cosine(cos_i, eta);
    if (cos_t < 0.0f) return 1.0f;
    // At grazing incidence both quotients tend to 1; cos_t = 0 as well only at the critical angle,
    // where they are 1
    if (cos_i == 0.0f) return 1.0f;
    const float parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    const float perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    return std::min(0.5f * (parallel * parallel + perpendicular * perpendicular), 1.0f);
}

/// (1 − cosθ)^5. Ref: Schlick 1994.
inline float schlick_weight(float cos_theta) {
    const float m = std::clamp(1.0f - cos_theta, 0.0f, 1.0f);
    const float m2 = m * m;
    return m2 * m2 * m;
}

/// UsdPreviewSurface's Fresnel term: F0 + (F90 − F0)·(1 − cosθ)^5.
inline Rgb fresnel_schlick(const Rgb& f0, const Rgb& f90, float cos_theta) {
    return f0 + (f90 - f0) * schlick_weight(cos_theta);
}

}  // namespace velatura::shading
