// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sampling/warp.h"
#include "shading/bsdf_value.h"

#include <algorithm>
#include <optional>

namespace velatura::shading {

/// One diffuse lobe and nothing else. Directions in the shading frame.
struct LambertLobe {
    Rgb albedo = Rgb(0.0f);

    /// mu_i: cosine of wi, above 0.
    void add(float mu_i, BsdfValue& value) const {
        value.pdf = is_black(albedo) ? 0.0f : sampling::cosine_hemisphere_pdf(std::min(mu_i, 1.0f));
        value.diffuse = albedo * inv_pi;
    }

    /// Zero vector: absorbed.
    Vec3 sample(const Vec2& u) const {
        const Vec3 wi = sampling::cosine_hemisphere(u);
        return is_black(albedo) || !(wi.z > 0.0f) ? Vec3(0.0f) : wi;
    }
};

}  // namespace velatura::shading
