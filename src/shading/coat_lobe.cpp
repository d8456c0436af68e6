// SPDX-License-Identifier: Apache-2.0
#include "shading/coat_lobe.h"

#include "shading/fresnel.h"
#include "shading/ggx.h"
#include "shading/rgb_math.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

namespace {

/// How far the albedo of Schlick's lobe (albedo.h) spreads over the cosines, as a standard
/// deviation against that of a mirror. Fit to the tables, within 0.02.
float schlick_spread(float alpha) {
    return 1.0f / (1.0f + 23.0f * alpha * std::sqrt(alpha));
}

}  // namespace

void CoatLobe::set(float ior) {
    const float r = (1.0f - ior) / (1.0f + ior);
    f0 = r * r;
    curve = GgxAlbedoCurve(alpha);
    const GgxAlbedo coat = curve.average();
    average_loss = coat.loss;
    multiple_f = multiple_scattering_fresnel(Rgb(f0 + (1.0f - f0) * (1.0f / 21.0f)), coat.loss).x;
}

void CoatLobe::set_coupling(const Rgb& under_base, const Rgb& base_schlick, float base_alpha) {
    const GgxAlbedo coat = curve.average();
    // The base receives (1 − C)(1 − R) of both directions, over the mean of that product: the
    // product of the means and the covariance of the two Schlick terms, 1/66 − 1/441 for mirrors
    const float coat_average =
        weight * (coat.reflectance(Rgb(f0), Rgb(1.0f)).x + multiple_f * coat.loss);
    const float covariance = weight * (1.0f - f0) * (1.0f / 66.0f - 1.0f / 441.0f) *
                             schlick_spread(alpha) * schlick_spread(base_alpha);
    coupling =
        safe_divide(under_base, under_base * (1.0f - coat_average) + base_schlick * covariance);
}

void CoatLobe::set_view(LayerView& v) const {
    const GgxAlbedo c = curve.at(v.mu);
    v.coat_loss = c.loss;
    v.coat_single = weight * c.reflectance(Rgb(f0), Rgb(1.0f)).x;
    v.coat = v.coat_single + weight * multiple_f * c.loss;
}

float CoatLobe::put_under(const LayerView& v, float mu_i, BsdfValue& value) const {
    const GgxAlbedo c = curve.at(mu_i);
    const float coat_i = weight * (c.reflectance(Rgb(f0), Rgb(1.0f)).x + multiple_f * c.loss);
    value.diffuse *= coupling * ((1.0f - v.coat) * (1.0f - coat_i));
    value.specular *= 1.0f - std::max(v.coat, coat_i);
    return c.loss;
}

void CoatLobe::add(
    const LayerView& v, const Vec3& wi, const Vec3& wm, float cos_m, BsdfValue& value) const {
    const float mu_i = std::min(wi.z, 1.0f);
    const float loss_i = put_under(v, mu_i, value);
    if (is_delta) return;
    float coat = 0;
    if (wm.z > 0.0f) {
        coat = (f0 + (1.0f - f0) * schlick_weight(cos_m)) *
               (ggx_d(wm, alpha) * ggx_visibility(v.mu, mu_i, alpha));
        value.pdf += v.probability[Coat] * ggx_pdf(v.wo, wm, alpha);
    }
    if (average_loss > 0.0f) coat += multiple_f * v.coat_loss * loss_i * inv_pi / average_loss;
    value.coat = weight * coat;
    value.specular += Rgb(value.coat);
}

}  // namespace velatura::shading
