// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shading/bsdf_value.h"
#include "shading/layer_view.h"
#include "shading/sheen.h"

#include <algorithm>

namespace velatura::shading {

/// Fibers on top of everything. Sheen takes its share first; what is below gets what the larger
/// share of the two directions leaves: reciprocal, and never more than there is. Ref: Kulla & Conty
/// 2017, "Revisiting Physically Based Shading at Imageworks", as MaterialX's layer operator.
struct SheenLobe {
    const SheenAlbedo* table = nullptr;
    Rgb color = Rgb(0.0f);  ///< weight included
    float roughness = 1;

    /// Of white sheen.
    float albedo(float mu) const { return table->at(mu, roughness); }

    /// What sheen of this albedo leaves to what is below.
    float under(float albedo) const { return 1.0f - max_component(color) * albedo; }

    void add(
        const LayerView& v, const Vec3& wi, const Vec3& wm, float mu_i, BsdfValue& value) const {
        const float max = std::max(v.sheen, albedo(mu_i));
        value.diffuse *= under(max);
        value.specular *= under(max);
        value.coat *= under(max);
        if (!(wi.z > 0.0f && v.mu > 0.0f)) return;
        value.diffuse += color * (table->scale(roughness) *
                                  sheen_f(v.mu, mu_i, std::clamp(wm.z, 0.0f, 1.0f), roughness));
    }
};

}  // namespace velatura::shading
