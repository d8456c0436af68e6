// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shading/albedo.h"
#include "shading/anisotropic_albedo.h"
#include "shading/bsdf_value.h"
#include "shading/fresnel.h"
#include "shading/ggx.h"
#include "shading/layer_view.h"
#include "shading/thin_film.h"

#include <optional>

namespace velatura::shading {

/// Reflection by microfacets of one width or two, compensated for multiple scattering (Kulla &
/// Conty 2017). `plain`: known beforehand to have one width. Directions in the shading frame, whose
/// x is the direction of the first width.
struct GgxLobe {
    Rgb f0 = Rgb(0.04f), f90 = Rgb(1.0f);
    float alpha = 0.25f, alpha_y = 0;
    bool is_delta = false;
    float average_loss = 0;      ///< 1 − A_avg(α)
    Rgb multiple_f = Rgb(0.0f);  ///< Fresnel factor of the compensation
    GgxAlbedoCurve curve;        ///< of one width
    std::optional<AnisotropicAlbedo::Curve> two_widths;
    /// Takes the place of Schlick's formula, of which f0 and f90 are the ends.
    std::optional<FilmFresnel> film;

    template <bool plain = false>
    bool is_anisotropic() const {
        return !plain && two_widths.has_value();
    }

    /// Of the microfacets alone, w.z = mu in [0, 1].
    template <bool plain = false>
    GgxAlbedo albedo(const Vec3& w, float mu) const {
        return is_anisotropic<plain>() ? two_widths->at(w) : curve.at(mu);
    }

    template <bool plain = false>
    bool has_film() const {
        return !plain && film.has_value();
    }

    /// Reflectance of one microfacet.
    template <bool plain = false>
    Rgb fresnel(float cos_m) const {
        return has_film<plain>() ? film->at(cos_m) : fresnel_schlick(f0, f90, cos_m);
    }

    /// What a film adds to the directional albedo of the microfacets that Schlick's formula gives.
    Rgb film_albedo(const GgxAlbedo& a, const Vec3& w) const;
    /// Its cosine-weighted mean.
    Rgb film_average() const;
    /// Cosine-weighted mean reflectance of a mirror.
    Rgb mean_fresnel() const;

    /// Directional albedo of the microfacets towards w, whose own albedo is `a`.
    template <bool plain = false>
    Rgb single_reflectance(const GgxAlbedo& a, const Vec3& w) const {
        const Rgb single = a.reflectance(f0, f90);
        return has_film<plain>() ? single + film_albedo(a, w) : single;
    }

    /// Directional albedo, compensation included.
    template <bool plain = false>
    Rgb reflectance(const GgxAlbedo& a, const Vec3& w) const {
        return single_reflectance<plain>(a, w) + multiple_f * a.loss;
    }

    template <bool plain = false>
    float d(const Vec3& wm) const {
        return is_anisotropic<plain>() ? ggx_d(wm, Vec2(alpha, alpha_y)) : ggx_d(wm, alpha);
    }

    template <bool plain = false>
    float visibility(const LayerView& v, const Vec3& wi, float mu_i) const {
        return is_anisotropic<plain>() ? ggx_visibility(v.wo, wi, Vec2(alpha, alpha_y))
                                       : ggx_visibility(v.mu, mu_i, alpha);
    }

    /// [1/sr] of reflected directions.
    template <bool plain = false>
    float pdf(const Vec3& wo, const Vec3& wm) const {
        return is_anisotropic<plain>() ? ggx_pdf(wo, wm, Vec2(alpha, alpha_y))
                                       : ggx_pdf(wo, wm, alpha);
    }

    /// [1/sr] of visible normals.
    float normal_pdf(const Vec3& wo, const Vec3& wm, float cos_m) const {
        return is_anisotropic() ? ggx_normal_pdf(wo, wm, cos_m, Vec2(alpha, alpha_y))
                                : ggx_normal_pdf(wo, wm, cos_m, alpha);
    }

    template <bool plain = false>
    Vec3 sample(const Vec3& wo, const Vec2& u) const {
        return is_anisotropic<plain>() ? ggx_sample(wo, Vec2(alpha, alpha_y), u)
                                       : ggx_sample(wo, alpha, u);
    }

    Vec3 sample_normal(const Vec3& wo, const Vec2& u) const {
        return is_anisotropic() ? ggx_sample_normal(wo, Vec2(alpha, alpha_y), u)
                                : ggx_sample_normal(wo, alpha, u);
    }

    /// Adds the reflection of a lobe that is no delta; wm may be zero. fresnel, multiple: of the
    /// microfacet, and of the compensation.
    template <bool plain = false>
    void add(const LayerView& v,
             const Vec3& wi,
             const Vec3& wm,
             float mu_i,
             float loss_i,
             const Rgb& fresnel,
             const Rgb& multiple,
             float probability,
             BsdfValue& value) const {
        if (wm.z > 0.0f) {
            value.specular += fresnel * (d<plain>(wm) * visibility<plain>(v, wi, mu_i));
            value.pdf += probability * pdf<plain>(v.wo, wm);
        }
        if (average_loss > 0.0f)
            value.specular += multiple * (v.loss * loss_i * inv_pi / average_loss);
    }
};

}  // namespace velatura::shading
