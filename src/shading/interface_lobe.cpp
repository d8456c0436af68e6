// SPDX-License-Identifier: Apache-2.0
#include "shading/interface_lobe.h"

#include "shading/fresnel.h"
#include "shading/rgb_math.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

Rgb InterfaceLobe::loss(const GgxLobe& ggx,
                        const Vec3& w,
                        const rough_interface::Shares& shares) const {
    return ggx.f0 * ggx.albedo(w, w.z).loss + one_minus(ggx.f0) * shares.excess;
}

Rgb InterfaceLobe::fresnel(const GgxLobe& ggx, float cos_m) const {
    if (!is_dense_side) return fresnel_schlick(ggx.f0, ggx.f90, cos_m);
    const float outer = refracted_cosine(cos_m, eta);
    return outer < 0.0f ? Rgb(1.0f) : fresnel_schlick(ggx.f0, ggx.f90, outer);
}

float InterfaceLobe::reflect_share(const Rgb& fresnel) const {
    const float reflected = mean(fresnel);
    const float passing = has_tint ? (1.0f - opacity) * mean(tint) : 1.0f - opacity;
    const float sum = reflected + (1.0f - reflected) * passing;
    return sum > 0.0f ? reflected / sum : 1.0f;
}

Rgb InterfaceLobe::add_reflection(const GgxLobe& ggx,
                                  const LayerView& v,
                                  const Vec3& wi,
                                  const Vec3& wm,
                                  float cos_m,
                                  BsdfValue& value) const {
    const float mu_i = std::min(wi.z, 1.0f);
    const Vec3 clamped(wi.x, wi.y, mu_i);
    const rough_interface::Shares shares = curve.at(clamped);
    if (wm.z > 0.0f && cos_m > 0.0f) {
        const Rgb f = fresnel(ggx, cos_m);
        value.specular += f * (ggx.d(wm) * ggx.visibility(v, wi, mu_i));
        value.pdf += v.probability[Interface] * reflect_share(f) * ggx.normal_pdf(v.wo, wm, cos_m) /
                     (4.0f * cos_m);
    }
    value.specular += safe_divide(v.lost * loss(ggx, clamped, shares) * inv_pi, lost_average);
    return one_minus(one_minus(ggx.f0) * shares.passed);
}

void InterfaceLobe::add_refraction(const GgxLobe& ggx,
                                   const LayerView& v,
                                   const Vec3& wi,
                                   BsdfValue& value) const {
    value.kind = ScatterKind::Transmit;
    value.eta = eta;
    const Vec3 across = v.wo + wi * eta;
    const float length2 = across.dot(across);
    if (!(length2 > 0.0f)) return;
    const Vec3 wm = across * ((eta > 1.0f ? -1.0f : 1.0f) / std::sqrt(length2));
    const float cos_o = v.wo.dot(wm), cos_i = -wi.dot(wm);
    if (!(wm.z > 0.0f && cos_o > 0.0f && cos_i > 0.0f)) return;
    const Rgb f = fresnel_schlick(ggx.f0, ggx.f90, std::min(is_dense_side ? cos_i : cos_o, 1.0f));
    const float mu_i = std::min(-wi.z, 1.0f);
    const float visible = ggx.normal_pdf(v.wo, wm, cos_o);
    const float jacobian = cos_i / length2;
    // D·G1(wo)·cos_o / μo is the density of visible normals
    const float unmasked = ggx.is_anisotropic()
                               ? rough_interface::refraction_weight(v.wo, Vec3(wi.x, wi.y, -wi.z),
                                                                    Vec2(ggx.alpha, ggx.alpha_y))
                               : rough_interface::refraction_weight(v.mu, mu_i, ggx.alpha);
    value.specular =
        one_minus(f) * ((1.0f - opacity) * (1.0f - v.coat) * visible * jacobian * unmasked / mu_i);
    if (has_tint) value.specular *= tint;
    value.pdf =
        v.probability[Interface] * (1.0f - reflect_share(f)) * visible * jacobian * (eta * eta);
}

Vec3 InterfaceLobe::sample(const GgxLobe& ggx,
                           const LayerView& v,
                           float u_choice,
                           const Vec2& u) const {
    const Vec3 wm = ggx.sample_normal(v.wo, u);
    const float cos_m = std::min(v.wo.dot(wm), 1.0f);
    if (!(cos_m > 0.0f)) return Vec3(0.0f);
    if (u_choice < reflect_share(fresnel(ggx, cos_m))) {
        const Vec3 wi = wm * (2.0f * cos_m) - v.wo;
        return wi.z > 0.0f ? wi : Vec3(0.0f);
    }
    const float cos_t = refracted_cosine(cos_m, eta);
    if (!(cos_t > 0.0f)) return Vec3(0.0f);
    const Vec3 wi = wm * (cos_m / eta - cos_t) - v.wo / eta;
    return wi.z < 0.0f ? wi : Vec3(0.0f);
}

}  // namespace velatura::shading
