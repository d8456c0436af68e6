// SPDX-License-Identifier: Apache-2.0
#include "shading/interface_lobe.h"

#include "shading/fresnel.h"
#include "shading/rgb_math.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

namespace {

/// Direction of light on the side of the smaller index; false: there is none.
bool outer_direction(const InterfaceLobe& lobe, const Vec3& w, Vec3& outer) {
    outer = w;
    if (!lobe.is_dense_side) return true;
    const float cosine = refracted_cosine(w.z, lobe.eta);
    outer = Vec3(w.x / lobe.eta, w.y / lobe.eta, cosine);
    return cosine >= 0.0f;
}

/// What a film adds to the share of light that facets reflect and takes off what they refract.
Rgb film_excess(const GgxLobe& ggx, const InterfaceLobe& lobe, const Vec3& w) {
    Vec3 outer;
    if (!outer_direction(lobe, w, outer)) return Rgb(0.0f);
    return ggx.film_albedo(GgxAlbedo{}, outer);
}

/// What it adds to the loss: facets that reflect lose more of the light than those that refract.
Rgb film_loss(const GgxLobe& ggx,
              const InterfaceLobe& lobe,
              const Vec3& w,
              const rough_interface::Shares& shares) {
    Vec3 outer;
    if (!outer_direction(lobe, w, outer)) return Rgb(0.0f);
    const Rgb excess = ggx.film->at_in_mean(outer.z) - fresnel_schlick(ggx.f0, ggx.f90, outer.z);
    return excess * (ggx.albedo(w, w.z).loss - shares.excess);
}

}  // namespace

Rgb InterfaceLobe::reflectance(const GgxLobe& ggx,
                               const Vec3& w,
                               const rough_interface::Shares& shares) const {
    const Rgb passed = one_minus(ggx.f0) * shares.passed;
    if (!ggx.film) return one_minus(passed);
    return clamp01(one_minus(passed) + film_excess(ggx, *this, w) * (1.0f - shares.excess));
}

Rgb InterfaceLobe::average(const GgxLobe& ggx) const {
    const rough_interface::Shares& shares = curve.average();
    const Rgb passed = one_minus(ggx.f0) * shares.passed;
    if (!ggx.film) return one_minus(passed);
    // Of what arrives from the dense side 1 / index² is not reflected totally
    const float part = is_dense_side ? eta * eta : 1.0f;
    return clamp01(one_minus(passed) +
                   (ggx.mean_fresnel() - (ggx.f0 + one_minus(ggx.f0) * (1.0f / 21.0f))) * part);
}

Rgb InterfaceLobe::loss(const GgxLobe& ggx,
                        const Vec3& w,
                        const rough_interface::Shares& shares) const {
    const Rgb schlick = ggx.f0 * ggx.albedo(w, w.z).loss + one_minus(ggx.f0) * shares.excess;
    if (!ggx.film) return schlick;
    return clamp01(schlick + film_loss(ggx, *this, w, shares));
}

Rgb InterfaceLobe::film_loss_average(const GgxLobe& ggx) const {
    constexpr int count = 16;
    Rgb sum(0.0f);
    for (int i = 0; i < count; ++i) {
        const float z = std::sqrt((float(i) + 0.5f) / count);
        const Vec3 w(std::sqrt(1.0f - z * z), 0.0f, z);
        sum += film_loss(ggx, *this, w, curve.at(w));
    }
    return sum / float(count);
}

Rgb InterfaceLobe::fresnel(const GgxLobe& ggx, float cos_m) const {
    if (!is_dense_side) return ggx.fresnel(cos_m);
    const float outer = refracted_cosine(cos_m, eta);
    return outer < 0.0f ? Rgb(1.0f) : ggx.fresnel(outer);
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
    return reflectance(ggx, clamped, shares);
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
    const Rgb f = ggx.fresnel(std::min(is_dense_side ? cos_i : cos_o, 1.0f));
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
