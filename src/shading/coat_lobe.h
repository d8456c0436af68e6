// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shading/albedo.h"
#include "shading/bsdf_value.h"
#include "shading/layer_view.h"

namespace velatura::shading {

/// A clear coat over everything but sheen. It takes its share first; what is below is coupled like
/// the base below its interface.
struct CoatLobe {
    float weight = 0, alpha = 0;
    float f0 = 0.04f;
    bool is_delta = false;
    float average_loss = 0;
    float multiple_f = 0;
    Rgb coupling = Rgb(1.0f);  ///< makes a white base under the coat reflect 1
    GgxAlbedoCurve curve;

    /// ior: of the coat over what is around it.
    void set(float ior);
    /// After set(), of a base that reflects diffusely. under_base: 1 − mean albedo of the base's
    /// interface; base_alpha: its width.
    void set_coupling(const Rgb& under_base, const Rgb& base_schlick, float base_alpha);

    void set_view(LayerView& view) const;
    /// Takes off what the coat leaves to the base: diffuse light by both directions, specular
    /// lobes, whose directions have much the same cosine, by the larger share of the two. Both are
    /// reciprocal. Returns: what the coat loses of wi.
    float put_under(const LayerView& v, float mu_i, BsdfValue& value) const;
    /// put_under(), and the coat's own reflection; wm may be zero.
    void add(
        const LayerView& v, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const;
};

}  // namespace velatura::shading
