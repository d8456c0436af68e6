// SPDX-License-Identifier: Apache-2.0
// f and pdf of the lobes.
#include "sampling/warp.h"
#include "shading/bsdf.h"
#include "shading/bsdf_tests.h"
#include "shading/fresnel.h"
#include "shading/ggx.h"
#include "shading/rgb_math.h"
#include "shading/sheet.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

BsdfValue Bsdf::evaluate_lambert(const Vec3& wo, const Vec3& wi) const {
    BsdfValue value;
    const float mu_i = wi.dot(frame_.z);
    if (!(wo.dot(ng_) > 0.0f && wo.dot(frame_.z) > 0.0f && mu_i > 0.0f && is_above(wi)))
        return value;
    value.pdf = is_black(p_.diffuse) ? 0.0f : sampling::cosine_hemisphere_pdf(std::min(mu_i, 1.0f));
    value.diffuse = p_.diffuse * inv_pi;
    return value;
}

BsdfValue Bsdf::evaluate(const Vec3& wo, const Vec3& wi) const {
    if (kind_ == Kind::Plain) return evaluate_layers<true>(wo, wi);
    if (kind_ == Kind::Layers) return evaluate_layers<false>(wo, wi);
    return is_fibre() ? evaluate_hair(wo, wi) : evaluate_lambert(wo, wi);
}

template <bool plain>
BsdfValue Bsdf::evaluate_layers(const Vec3& wo, const Vec3& wi) const {
    BsdfValue value;
    if (!(wo.dot(ng_) > 0.0f)) return value;
    const Vec3 wi_local = frame_.to_local(wi);
    // Light through the surface comes by refraction alone, whatever the shading normal says
    const bool reflects = is_above(wi);
    const bool passes =
        wi_local.z < 0.0f &&
        (is_rough_interface<plain>() || is_rough_sheet<plain>() || transmits_diffusely<plain>());
    if (reflects ? !(wi_local.z > 0.0f) : !passes) return value;
    if (wo == wo_) {
        if (view_.wo.z > 0.0f) evaluate_local<plain>(view_, wi_local, value);
        return value;
    }
    const View view = make_view<plain>(frame_.to_local(wo));
    if (view.wo.z > 0.0f) evaluate_local<plain>(view, wi_local, value);
    return value;
}

template <bool plain>
void Bsdf::evaluate_local(const View& v, const Vec3& wi, BsdfValue& value) const {
    if (!plain && wi.z < 0.0f) {
        if (is_rough_interface<plain>()) {
            evaluate_refraction(v, wi, value);
        } else {
            evaluate_through_sheet(v, wi, value);
        }
        if (has_sheen<plain>()) {
            const float most = is_thin<plain>()
                                   ? std::max(v.sheen, p_.sheen->at(-wi.z, p_.sheen_roughness))
                                   : v.sheen;
            value.diffuse *= under_sheen(most);
            value.specular *= under_sheen(most);
        }
        return;
    }
    const float mu_i = std::min(wi.z, 1.0f);
    value.pdf = v.probability[Cosine] * sampling::cosine_hemisphere_pdf(mu_i);
    Vec3 wm = v.wo + wi;
    const float wm_length2 = wm.dot(wm);
    wm = wm_length2 > 0.0f ? wm / std::sqrt(wm_length2) : Vec3(0.0f);
    const float cos_m = std::clamp(v.wo.dot(wm), 0.0f, 1.0f);

    // Specular reflection of the base, and what its interface reflects in all
    Rgb specular_i;
    if (is_rough_interface<plain>()) {
        specular_i = add_rough_reflection(v, wi, wm, cos_m, value);
    } else {
        specular_i = add_reflection<plain>(v, wi, wm, cos_m, value);
    }

    // Diffuse base: what passes the interface on the way in and out, over its mean
    if (opacity<plain>() > 0.0f) {
        value.diffuse = safe_divide(p_.diffuse * (opacity<plain>() * inv_pi) *
                                        one_minus(v.specular) * one_minus(specular_i),
                                    one_minus(specular_average_));
    }
    if (has_extras<plain>()) add_extras(v, wi, wm, cos_m, value);
}

template <bool plain>
float Bsdf::facet_d(const Vec3& wm) const {
    return is_anisotropic<plain>() ? ggx_d(wm, Vec2(p_.alpha, p_.alpha_y)) : ggx_d(wm, p_.alpha);
}

template <bool plain>
float Bsdf::facet_visibility(const View& v, const Vec3& wi, float mu_i) const {
    return is_anisotropic<plain>() ? ggx_visibility(v.wo, wi, Vec2(p_.alpha, p_.alpha_y))
                                   : ggx_visibility(v.mu, mu_i, p_.alpha);
}

template <bool plain>
float Bsdf::facet_pdf(const Vec3& wo, const Vec3& wm) const {
    return is_anisotropic<plain>() ? ggx_pdf(wo, wm, Vec2(p_.alpha, p_.alpha_y))
                                   : ggx_pdf(wo, wm, p_.alpha);
}

float Bsdf::facet_normal_pdf(const Vec3& wo, const Vec3& wm, float cos_m) const {
    return is_anisotropic() ? ggx_normal_pdf(wo, wm, cos_m, Vec2(p_.alpha, p_.alpha_y))
                            : ggx_normal_pdf(wo, wm, cos_m, p_.alpha);
}

/// Adds the GGX lobe of an opaque base, of one that refracts without blur, or of a sheet; wm may be
/// zero. Returns: the albedo of the reflection for wi.
template <bool plain>
Rgb Bsdf::add_reflection(
    const View& v, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const {
    const float mu_i = std::min(wi.z, 1.0f);
    const GgxAlbedo albedo_i = specular_albedo<plain>(wi, mu_i);
    if (!specular_is_delta_) {
        // From inside a rough interface, and by a sheet that does not blur, the reflectance is that
        // of the macroscopic normal, so that R + T = 1
        const bool is_macroscopic =
            is_dense_side<plain>() ||
            (is_thin<plain>() && transmits<plain>() && !is_rough_sheet<plain>());
        Rgb fresnel = is_macroscopic ? v.reflected : fresnel_schlick(p_.f0, p_.f90, cos_m);
        Rgb multiple = is_macroscopic ? v.reflected : multiple_f_;
        float share = 1.0f;
        if (is_rough_sheet<plain>()) {
            const SheetShares sheet = sheet_shares(fresnel, passage(cos_m));
            fresnel += (sheet.reflected - fresnel) * (1.0f - opacity<plain>());
            multiple += (sheet_multiple_.reflected - multiple) * (1.0f - opacity<plain>());
            share = sheet_reflect_share(cos_m);
        }
        if (wm.z > 0.0f) {
            value.specular += fresnel * (facet_d<plain>(wm) * facet_visibility<plain>(v, wi, mu_i));
            value.pdf += (plain ? v.probability[Specular]
                                : v.probability[Specular] + v.probability[Sheet] * share) *
                         facet_pdf<plain>(v.wo, wm);
        }
        if (average_loss_ > 0.0f) {
            value.specular += multiple * (v.loss * albedo_i.loss * inv_pi / average_loss_);
        }
    }
    return is_dense_side<plain>()
               ? interface_albedo(Vec3(wi.x, wi.y, mu_i))
               : albedo_i.reflectance(p_.f0, p_.f90) + multiple_f_ * albedo_i.loss;
}

/// The same for an interface that blurs what it refracts.
Rgb Bsdf::add_rough_reflection(
    const View& v, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const {
    const float mu_i = std::min(wi.z, 1.0f);
    const Vec3 clamped(wi.x, wi.y, mu_i);
    const rough_interface::Shares shares = interface_curve_->at(clamped);
    if (wm.z > 0.0f && cos_m > 0.0f) {
        const Rgb fresnel = microfacet_fresnel(cos_m);
        value.specular += fresnel * (facet_d<false>(wm) * facet_visibility<false>(v, wi, mu_i));
        value.pdf += v.probability[Interface] * reflect_share(fresnel) *
                     facet_normal_pdf(v.wo, wm, cos_m) / (4.0f * cos_m);
    }
    value.specular += safe_divide(v.lost * rough_loss(clamped, shares) * inv_pi, lost_average_);
    return one_minus(one_minus(p_.f0) * shares.passed);
}

/// What comes through a sheet from its other side: the base's diffuse light, and the lobe of the
/// reflection mirrored, by the very microfacets that do not reflect: both together keep the energy.
/// Ref: Kulla & Conty 2017, "Revisiting Physically Based Shading at Imageworks" (the mirrored
/// lobe).
void Bsdf::evaluate_through_sheet(const View& v, const Vec3& wi, BsdfValue& value) const {
    value.kind = ScatterKind::Transmit;
    const Vec3 mirrored(wi.x, wi.y, -wi.z);
    const float mu_i = std::min(mirrored.z, 1.0f);
    value.pdf = v.probability[CosineBack] * sampling::cosine_hemisphere_pdf(mu_i);
    const GgxAlbedo albedo_i = specular_albedo<false>(mirrored, mu_i);
    if (transmits_diffusely()) {
        const Rgb specular_i = albedo_i.reflectance(p_.f0, p_.f90) + multiple_f_ * albedo_i.loss;
        value.diffuse = safe_divide(p_.diffuse_transmitted * (opacity() * inv_pi) *
                                        one_minus(v.specular) * one_minus(specular_i),
                                    one_minus(specular_average_));
    }
    if (is_rough_sheet()) {
        const float share = 1.0f - opacity();
        Vec3 wm = v.wo + mirrored;
        const float length2 = wm.dot(wm);
        wm = length2 > 0.0f ? wm / std::sqrt(length2) : Vec3(0.0f);
        if (wm.z > 0.0f) {
            const float cos_m = std::clamp(v.wo.dot(wm), 0.0f, 1.0f);
            const SheetShares sheet =
                sheet_shares(fresnel_schlick(p_.f0, p_.f90, cos_m), passage(cos_m));
            value.specular += sheet.transmitted * (share * facet_d<false>(wm) *
                                                   facet_visibility<false>(v, mirrored, mu_i));
            value.pdf += v.probability[Sheet] * (1.0f - sheet_reflect_share(cos_m)) *
                         facet_pdf<false>(v.wo, wm);
        }
        if (average_loss_ > 0.0f) {
            value.specular += sheet_multiple_.transmitted *
                              (share * v.loss * albedo_i.loss * inv_pi / average_loss_);
        }
    }
    if (has_coat()) put_under_coat(v, mu_i, value);
}

/// Probability to reflect at a microfacet of a sheet, in proportion to what it sends each way.
float Bsdf::sheet_reflect_share(float cos_m) const {
    const Rgb fresnel = fresnel_schlick(p_.f0, p_.f90, cos_m);
    const SheetShares sheet = sheet_shares(fresnel, passage(cos_m));
    const float through = (1.0f - opacity()) * mean(sheet.transmitted);
    const float reflected = opacity() * mean(fresnel) + (1.0f - opacity()) * mean(sheet.reflected);
    return reflected + through > 0.0f ? reflected / (reflected + through) : 1.0f;
}

/// Refraction at the one microfacet that turns wi to wo. Ref: Walter et al. 2007, equations 16, 17
/// and 21; f carries the 1/η² of radiance.
void Bsdf::evaluate_refraction(const View& v, const Vec3& wi, BsdfValue& value) const {
    value.kind = ScatterKind::Transmit;
    value.eta = eta_;
    const Vec3 across = v.wo + wi * eta_;
    const float length2 = across.dot(across);
    if (!(length2 > 0.0f)) return;
    const Vec3 wm = across * ((eta_ > 1.0f ? -1.0f : 1.0f) / std::sqrt(length2));
    const float cos_o = v.wo.dot(wm), cos_i = -wi.dot(wm);
    if (!(wm.z > 0.0f && cos_o > 0.0f && cos_i > 0.0f)) return;
    const Rgb fresnel =
        fresnel_schlick(p_.f0, p_.f90, std::min(is_dense_side() ? cos_i : cos_o, 1.0f));
    const float mu_i = std::min(-wi.z, 1.0f);
    const float visible = facet_normal_pdf(v.wo, wm, cos_o);
    const float jacobian = cos_i / length2;
    // D·G1(wo)·cos_o / μo is the density of visible normals
    const float unmasked = is_anisotropic()
                               ? rough_interface::refraction_weight(v.wo, Vec3(wi.x, wi.y, -wi.z),
                                                                    Vec2(p_.alpha, p_.alpha_y))
                               : rough_interface::refraction_weight(v.mu, mu_i, p_.alpha);
    value.specular = one_minus(fresnel) *
                     ((1.0f - opacity()) * (1.0f - v.coat) * visible * jacobian * unmasked / mu_i);
    if (has_tint()) value.specular *= p_.transmission_tint;
    value.pdf = v.probability[Interface] * (1.0f - reflect_share(fresnel)) * visible * jacobian *
                (eta_ * eta_);
}

/// F of one microfacet of a rough interface, by the cosine on the side of the smaller index.
Rgb Bsdf::microfacet_fresnel(float cos_m) const {
    if (!is_dense_side()) return fresnel_schlick(p_.f0, p_.f90, cos_m);
    const float outer = refracted_cosine(cos_m, eta_);
    return outer < 0.0f ? Rgb(1.0f) : fresnel_schlick(p_.f0, p_.f90, outer);
}

/// Probability to reflect at a microfacet, in proportion to what it sends each way.
float Bsdf::reflect_share(const Rgb& fresnel) const {
    const float reflected = mean(fresnel);
    const float passing =
        has_tint() ? (1.0f - opacity()) * mean(p_.transmission_tint) : 1.0f - opacity();
    const float sum = reflected + (1.0f - reflected) * passing;
    return sum > 0.0f ? reflected / sum : 1.0f;
}

/// The coat takes its share first. The base below is coupled like the one below the interface;
/// specular lobes, whose directions have much the same cosine, are left what the larger share of
/// the two leaves. Both are reciprocal. Returns: what the coat loses of wi.
float Bsdf::put_under_coat(const View& v, float mu_i, BsdfValue& value) const {
    const GgxAlbedo c = coat_curve_.at(mu_i);
    const float coat_i =
        p_.clearcoat * (c.reflectance(Rgb(coat_f0_), Rgb(1.0f)).x + coat_multiple_f_ * c.loss);
    value.diffuse *= coat_coupling_ * ((1.0f - v.coat) * (1.0f - coat_i));
    value.specular *= 1.0f - std::max(v.coat, coat_i);
    return c.loss;
}

void Bsdf::add_coat(
    const View& v, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const {
    const float mu_i = std::min(wi.z, 1.0f);
    const float loss_i = put_under_coat(v, mu_i, value);
    if (coat_is_delta_) return;
    float coat = 0;
    if (wm.z > 0.0f) {
        coat = (coat_f0_ + (1.0f - coat_f0_) * schlick_weight(cos_m)) *
               (ggx_d(wm, p_.clearcoat_alpha) * ggx_visibility(v.mu, mu_i, p_.clearcoat_alpha));
        value.pdf += v.probability[Coat] * ggx_pdf(v.wo, wm, p_.clearcoat_alpha);
    }
    if (coat_average_loss_ > 0.0f) {
        coat += coat_multiple_f_ * v.coat_loss * loss_i * inv_pi / coat_average_loss_;
    }
    value.coat = p_.clearcoat * coat;
    value.specular += Rgb(value.coat);
}

template void Bsdf::evaluate_local<true>(const View&, const Vec3&, BsdfValue&) const;
template void Bsdf::evaluate_local<false>(const View&, const Vec3&, BsdfValue&) const;

}  // namespace velatura::shading
