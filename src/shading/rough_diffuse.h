// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

namespace rough_diffuse_detail {

inline constexpr float c1 = 0.5f - 2.0f / (3.0f * pi);
inline constexpr float c2 = 2.0f / 3.0f - 28.0f / (15.0f * pi);

/// Directional albedo of single scattering off white facets.
inline float single_albedo(float mu, float roughness) {
    const float sine = std::sqrt(std::max(1.0f - mu * mu, 0.0f));
    // The tangent is finite where the product with 1 − sin³ is taken: both vanish at grazing
    const float slope = mu > 1e-4f ? sine / mu * (1.0f - sine * sine * sine) : 0.0f;
    const float g =
        sine * (std::acos(std::min(mu, 1.0f)) - sine * mu) + 2.0f / 3.0f * (slope - sine);
    return (1.0f + roughness * inv_pi * g) / (1.0f + c1 * roughness);
}

}  // namespace rough_diffuse_detail

/// π·f of a rough diffuse surface: the EON model, energy-preserving Oren-Nayar. It reflects
/// `albedo` exactly where that is 1 and much as it elsewhere; roughness 0 gives Lambert. Space: wo,
/// wi in the shading frame (ns = +z), unit, z > 0. Args:  albedo in [0, 1]; roughness in [0, 1].
/// Ref:   Portsmouth, Kutz, Hill 2025, "EON: A Practical Energy-Preserving Rough Diffuse BRDF",
/// JCGT
///        14(1), equations 14 to 24.
inline Rgb rough_diffuse(const Rgb& albedo, float roughness, const Vec3& wo, const Vec3& wi) {
    using namespace rough_diffuse_detail;
    const float scale = 1.0f / (1.0f + c1 * roughness);
    const float mu_o = std::min(wo.z, 1.0f), mu_i = std::min(wi.z, 1.0f);
    const float s = wo.dot(wi) - mu_o * mu_i;
    const float ratio = s > 0.0f ? s / std::max(mu_o, mu_i) : s;
    const float single = scale * (1.0f + roughness * ratio);
    const float average = scale * (1.0f + c2 * roughness);
    const float lost = (1.0f - single_albedo(mu_o, roughness)) *
                       (1.0f - single_albedo(mu_i, roughness)) / std::max(1.0f - average, 1e-7f);
    Rgb f;
    for (int c = 0; c < 3; ++c) {
        const float multiple =
            albedo[c] * albedo[c] * average / (1.0f - albedo[c] * (1.0f - average));
        f[c] = albedo[c] * single + multiple * std::max(lost, 0.0f);
    }
    return f;
}

}  // namespace velatura::shading
