// SPDX-License-Identifier: Apache-2.0
// f and pdf of the lobes.
#include "sampling/warp.h"
#include "shading/bsdf.h"
#include "shading/fresnel.h"
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
    lambert_.add(mu_i, value);
    return value;
}

BsdfValue Bsdf::evaluate(const Vec3& wo, const Vec3& wi) const {
    if (kind_ == Kind::Plain) return evaluate_layers<true>(wo, wi);
    if (kind_ == Kind::Layers) return evaluate_layers<false>(wo, wi);
    return is_hair() ? evaluate_hair(wo, wi) : evaluate_lambert(wo, wi);
}

template <bool plain>
BsdfValue Bsdf::evaluate_layers(const Vec3& wo, const Vec3& wi) const {
    BsdfValue value;
    if (!(wo.dot(ng_) > 0.0f)) return value;
    const Vec3 wi_local = frame_.to_local(wi);
    // Light through the surface comes by refraction alone, whatever the shading normal says
    const bool reflects = is_above(wi);
    const bool passes = wi_local.z < 0.0f && (features_.is_rough_interface<plain>() ||
                                              features_.is_rough_sheet<plain>() ||
                                              features_.transmits_diffusely<plain>());
    if (reflects ? !(wi_local.z > 0.0f) : !passes) return value;
    if (wo == wo_) {
        if (view_.wo.z > 0.0f) evaluate_local<plain>(view_, wi_local, value);
        return value;
    }
    const LayerView view = make_view<plain>(frame_.to_local(wo));
    if (view.wo.z > 0.0f) evaluate_local<plain>(view, wi_local, value);
    return value;
}

template <bool plain>
void Bsdf::evaluate_local(const LayerView& v, const Vec3& wi, BsdfValue& value) const {
    if (!plain && wi.z < 0.0f) {
        if (features_.is_rough_interface<plain>()) {
            interface_->add_refraction(ggx_, v, wi, value);
        } else {
            evaluate_through_sheet(v, wi, value);
        }
        if (features_.has_sheen<plain>()) {
            const float max =
                features_.is_thin<plain>() ? std::max(v.sheen, sheen_.albedo(-wi.z)) : v.sheen;
            value.diffuse *= sheen_.under(max);
            value.specular *= sheen_.under(max);
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
    if (features_.is_rough_interface<plain>()) {
        specular_i = interface_->add_reflection(ggx_, v, wi, wm, cos_m, value);
    } else {
        specular_i = add_reflection<plain>(v, wi, wm, cos_m, value);
    }

    // Diffuse base: what passes the interface on the way in and out, over its mean
    if (features_.opacity<plain>() > 0.0f) {
        value.diffuse = safe_divide(p_.diffuse * (features_.opacity<plain>() * inv_pi) *
                                        one_minus(v.specular) * one_minus(specular_i),
                                    one_minus(specular_average_));
    }
    if (features_.has_extras<plain>()) add_extras(v, wi, wm, cos_m, value);
}

/// Adds the GGX lobe of an opaque base, of one that refracts without blur, or of a sheet; wm may be
/// zero. Returns: the albedo of the reflection for wi.
template <bool plain>
Rgb Bsdf::add_reflection(
    const LayerView& v, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const {
    const float mu_i = std::min(wi.z, 1.0f);
    const GgxAlbedo albedo_i = ggx_.albedo<plain>(wi, mu_i);
    if (!ggx_.is_delta) {
        // From inside a rough interface, and by a sheet that does not blur, the reflectance is that
        // of the macroscopic normal, so that R + T = 1
        const bool is_macroscopic = features_.is_dense_side<plain>() ||
                                    (features_.is_thin<plain>() && features_.transmits<plain>() &&
                                     !features_.is_rough_sheet<plain>());
        Rgb fresnel = is_macroscopic ? v.reflected : ggx_.fresnel<plain>(cos_m);
        Rgb multiple = is_macroscopic ? v.reflected : ggx_.multiple_f;
        float share = 1.0f;
        if (features_.is_rough_sheet<plain>()) {
            const SheetShares sheet = sheet_shares(fresnel, thin_wall_.passage(cos_m));
            fresnel += (sheet.reflected - fresnel) * (1.0f - features_.opacity<plain>());
            multiple +=
                (thin_wall_.multiple.reflected - multiple) * (1.0f - features_.opacity<plain>());
            share = thin_wall_.reflect_share(ggx_, cos_m);
        }
        ggx_.add<plain>(v, wi, wm, mu_i, albedo_i.loss, fresnel, multiple,
                        plain ? v.probability[Specular]
                              : v.probability[Specular] + v.probability[Sheet] * share,
                        value);
    }
    return features_.is_dense_side<plain>()
               ? interface_albedo(Vec3(wi.x, wi.y, mu_i))
               : ggx_.reflectance<plain>(albedo_i, Vec3(wi.x, wi.y, mu_i));
}

/// What comes through a sheet from its other side: the base's diffuse light, and the lobe of the
/// reflection mirrored, by the very microfacets that do not reflect: both together keep the energy.
/// Ref: Kulla & Conty 2017, "Revisiting Physically Based Shading at Imageworks" (the mirrored
/// lobe).
void Bsdf::evaluate_through_sheet(const LayerView& v, const Vec3& wi, BsdfValue& value) const {
    value.kind = ScatterKind::Transmit;
    const Vec3 mirrored(wi.x, wi.y, -wi.z);
    const float mu_i = std::min(mirrored.z, 1.0f);
    value.pdf = v.probability[CosineBack] * sampling::cosine_hemisphere_pdf(mu_i);
    const GgxAlbedo albedo_i = ggx_.albedo<false>(mirrored, mu_i);
    if (features_.transmits_diffusely()) {
        const Rgb specular_i = ggx_.reflectance(albedo_i, Vec3(wi.x, wi.y, mu_i));
        value.diffuse = safe_divide(p_.diffuse_transmitted * (features_.opacity() * inv_pi) *
                                        one_minus(v.specular) * one_minus(specular_i),
                                    one_minus(specular_average_));
    }
    if (features_.is_rough_sheet())
        thin_wall_.add_through(ggx_, v, mirrored, mu_i, albedo_i.loss, value);
    if (features_.has_coat()) coat_.put_under(v, mu_i, value);
}

BsdfValue Bsdf::narrow_part(const BsdfValue& value) const {
    BsdfValue narrow = value;
    narrow.diffuse = narrow.specular = Rgb(0.0f);
    narrow.coat = 0.0f;
    if (kind_ == Kind::Lambert || kind_ == Kind::Hair) return narrow;
    const float base_alpha = p_.anisotropic ? std::min(p_.alpha, p_.alpha_y) : p_.alpha;
    if (base_alpha <= narrow_lobe_alpha)
        for (int c = 0; c < 3; ++c)
            narrow.specular[c] = std::max(value.specular[c] - value.coat, 0.0f);
    if (p_.clearcoat_alpha <= narrow_lobe_alpha) {
        narrow.coat = value.coat;
        for (int c = 0; c < 3; ++c) narrow.specular[c] += std::min(value.specular[c], value.coat);
    }
    return narrow;
}

BsdfValue Bsdf::wide_part(const BsdfValue& value) const {
    const BsdfValue narrow = narrow_part(value);
    BsdfValue wide = value;
    wide.coat -= narrow.coat;
    for (int c = 0; c < 3; ++c)
        wide.specular[c] = std::max(value.specular[c] - narrow.specular[c], 0.0f);
    return wide;
}

template void Bsdf::evaluate_local<true>(const LayerView&, const Vec3&, BsdfValue&) const;
template void Bsdf::evaluate_local<false>(const LayerView&, const Vec3&, BsdfValue&) const;

}  // namespace velatura::shading
