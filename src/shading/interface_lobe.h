// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shading/bsdf_value.h"
#include "shading/ggx_lobe.h"
#include "shading/layer_view.h"
#include "shading/rough_interface.h"

namespace velatura::shading {

/// An interface that blurs what it refracts: reflection and refraction by the same microfacets.
/// Ref: Walter et al. 2007.
struct InterfaceLobe {
    float eta = 1;               ///< index beyond over index on the side of wo
    bool is_dense_side = false;  ///< wo is on the side of the larger index
    float opacity = 1;
    bool has_tint = false;
    Rgb tint = Rgb(1.0f);
    RoughInterface::Curve curve;
    Rgb lost_average = Rgb(0.0f);  ///< cosine-weighted mean of LayerView::lost

    /// Directional albedo of all that is reflected: what is not transmitted.
    Rgb reflectance(const GgxLobe& ggx, const Vec3& w, const rough_interface::Shares& shares) const;
    /// Its cosine-weighted mean.
    Rgb average(const GgxLobe& ggx) const;
    /// Cosine-weighted mean of what a film adds to loss().
    Rgb film_loss_average(const GgxLobe& ggx) const;
    /// What single scattering loses, and compensation returns.
    Rgb loss(const GgxLobe& ggx, const Vec3& w, const rough_interface::Shares& shares) const;
    /// F of one microfacet, by the cosine on the side of the smaller index.
    Rgb fresnel(const GgxLobe& ggx, float cos_m) const;
    /// Probability to reflect at a microfacet, in proportion to what it sends each way.
    float reflect_share(const Rgb& fresnel) const;
    /// Returns: the albedo of the reflection for wi.
    Rgb add_reflection(const GgxLobe& ggx,
                       const LayerView& v,
                       const Vec3& wi,
                       const Vec3& wm,
                       float cos_m,
                       BsdfValue& value) const;
    /// Refraction at the one microfacet that turns wi to wo. Ref: Walter et al. 2007, equations 16,
    /// 17 and 21; f carries the 1/η² of radiance.
    void add_refraction(const GgxLobe& ggx,
                        const LayerView& v,
                        const Vec3& wi,
                        BsdfValue& value) const;
    /// Draws a visible microfacet and lets it reflect or refract. Zero vector: nothing.
    Vec3 sample(const GgxLobe& ggx, const LayerView& v, float u_choice, const Vec2& u) const;
};

}  // namespace velatura::shading
