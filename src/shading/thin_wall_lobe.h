// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shading/bsdf_value.h"
#include "shading/ggx_lobe.h"
#include "shading/layer_view.h"
#include "shading/sheet.h"

namespace velatura::shading {

/// A sheet without thickness, air on both sides, whose two interfaces reflect to and fro.
struct ThinWallLobe {
    float ior = 1.5f;
    float opacity = 1;
    bool has_tint = false;
    Rgb tint = Rgb(1.0f);   ///< of the perpendicular passage
    bool is_rough = false;  ///< the roughness blurs what passes, too
    SheetShares multiple;   ///< Fresnel factors of the compensation, to either side

    /// What survives one passage between the interfaces; slanted ones are longer.
    Rgb passage(float cosine) const;
    /// Light that leaves a rough sheet after several microfacets: each sends on what it neither
    /// absorbs nor lets out; to which side, as one microfacet does in the mean.
    void set_compensation(const Rgb& f_average, float average_loss);
    /// The second interface, behind that part of the first which does not end at the base.
    void set_view(LayerView& v) const;
    /// Probability to reflect at a microfacet, in proportion to what it sends each way.
    float reflect_share(const GgxLobe& ggx, float cos_m) const;
    /// The lobe of the reflection mirrored, by the very microfacets that do not reflect: both
    /// together keep the energy. mirrored: wi on the side of wo. Ref: Kulla & Conty 2017,
    /// "Revisiting Physically Based Shading at Imageworks".
    void add_through(const GgxLobe& ggx,
                     const LayerView& v,
                     const Vec3& mirrored,
                     float mu_i,
                     float loss_i,
                     BsdfValue& value) const;
    /// Draws a reflection and keeps it, or takes its mirror image on the other side.
    Vec3 sample(const GgxLobe& ggx, const LayerView& v, float u_choice, const Vec2& u) const;
};

}  // namespace velatura::shading
