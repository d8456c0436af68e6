// SPDX-License-Identifier: Apache-2.0
#include "shading/hair.h"

#include "shading/fresnel.h"
#include "shading/rgb_math.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

namespace {

constexpr float two_pi = 2.0f * pi;

float square(float x) {
    return x * x;
}

/// e^−x · I0(x) of the modified Bessel function, x ≥ 0, within 2e-7.
/// Ref: Abramowitz & Stegun 1964, 9.8.1 and 9.8.2.
float scaled_bessel(float x) {
    if (x < 3.75f) {
        const float t = square(x / 3.75f);
        const float i0 =
            1.0f +
            t * (3.5156229f +
                 t * (3.0899424f +
                      t * (1.2067492f + t * (0.2659732f + t * (0.0360768f + t * 0.0045813f)))));
        return i0 * std::exp(-x);
    }
    const float t = 3.75f / x;
    const float series =
        0.39894228f +
        t * (0.01328592f +
             t * (0.00225319f +
                  t * (-0.00157565f +
                       t * (0.00916281f +
                            t * (-0.02057706f +
                                 t * (0.02635537f + t * (-0.01647633f + t * 0.00392377f)))))));
    return series / std::sqrt(x);
}

float longitudinal_normalizer(float variance) {
    return 1.0f / (variance * -std::expm1(-2.0f / variance));
}

/// Scattering along the fiber about the cone of the mirrored direction; its integral over the
/// sphere is 2π. Ref: d'Eon et al. 2011, equation 7, written so that it neither overflows nor
/// cancels.
float longitudinal(
    float sin_i, float cos_i, float sin_o, float cos_o, float variance, float normalizer) {
    const float a = cos_i * cos_o / variance;
    // 1 − cos(θi + θo)
    const float c = cos_i * cos_o - sin_i * sin_o;
    const float s = difference_of_products(sin_i, cos_o, -cos_i, sin_o);
    const float off = c > 0.0f ? s * s / (1.0f + c) : 1.0f - c;
    return scaled_bessel(a) * std::exp(-off / variance) * normalizer;
}

float logistic_cdf(float x, float scale) {
    return 1.0f / (1.0f + std::exp(-x / scale));
}

/// Share of a logistic distribution that lies within ±π.
float logistic_inside(float scale) {
    return std::tanh(0.5f * pi / scale);
}

/// Density of a logistic distribution cut off at ±π, of which `inside` is left.
float trimmed_logistic(float x, float scale, float inside) {
    const float e = std::exp(-std::abs(x) / scale);
    return e / (scale * square(1.0f + e) * inside);
}

float sample_trimmed_logistic(float u, float scale, float inside) {
    const float p = u * inside + logistic_cdf(-pi, scale);
    // ln(p / (1 − p)) keeps its digits at both ends
    const float x = scale * (std::log(p) - std::log1p(-p));
    return std::clamp(x, -pi, pi);
}

/// Angle in [−π, π], of one of a few turns.
float wrapped(float angle) {
    return angle - two_pi * float(int(angle / two_pi + std::copysign(0.5f, angle)));
}

/// What of the color of many fibers the roughness around them makes.
float color_scale(float b) {
    return 5.969f + b * (-0.215f + b * (2.532f + b * (-10.73f + b * (5.574f + b * 0.245f))));
}

}  // namespace

Rgb absorption_of_melanin(const scene::Hair& hair, float eumelanin, float pheomelanin) {
    return hair.eumelanin_absorption * eumelanin + hair.pheomelanin_absorption * pheomelanin;
}

Rgb absorption_of_color(const Rgb& color, float azimuthal_roughness) {
    // Black would absorb without bound
    constexpr float darkest = 1e-4f;
    const float scale = color_scale(azimuthal_roughness);
    Rgb sigma_a;
    for (int c = 0; c < 3; ++c)
        sigma_a[c] = square(std::log(std::clamp(color[c], darkest, 1.0f)) / scale);
    return sigma_a;
}

HairLobes::HairLobes(const HairParameters& p, float h)
    : sigma_a_(p.sigma_a), h_(std::clamp(h, -1.0f, 1.0f)), ior_(p.ior), gamma_o_(std::asin(h_)) {
    // Ref: Chiang et al. 2016, equations 7 and 8: roughness that looks even to the eye
    const float m = p.roughness, n = p.azimuthal_roughness;
    const float variance = square(0.726f * m + 0.812f * m * m + 3.7f * std::pow(m, 20.0f));
    variance_ = {variance, 0.25f * variance, 4.0f * variance, 4.0f * variance};
    for (size_t i = 0; i < variance_.size(); ++i)
        normalizer_[i] = longitudinal_normalizer(variance_[i]);
    constexpr float root_of_eighth_pi = 0.626657069f;
    scale_ = root_of_eighth_pi * (0.265f * n + 1.194f * n * n + 5.372f * std::pow(n, 22.0f));
    inside_ = logistic_inside(scale_);
    for (int i = 0; i < 3; ++i) {
        sin_tilt_[size_t(i)] = std::sin(p.cuticle_angle * float(1 << i));
        cos_tilt_[size_t(i)] = std::cos(p.cuticle_angle * float(1 << i));
    }
}

/// What leaves by each lobe, of light that looks along −wo.
void HairLobes::attenuate(float cos_theta, float sin_theta, View& v) const {
    const float cos_gamma_o = safe_sqrt(1.0f - h_ * h_);
    const float fresnel = fresnel_dielectric(cos_theta * cos_gamma_o, ior_);
    // The way through the fiber, seen along its axis by an index of its own (Bravais)
    const float projected_ior = safe_sqrt(ior_ * ior_ - sin_theta * sin_theta);
    const float sin_gamma_t = std::clamp(h_ * cos_theta / projected_ior, -1.0f, 1.0f);
    const float cos_gamma_t = safe_sqrt(1.0f - sin_gamma_t * sin_gamma_t);
    const float cos_theta_t = safe_sqrt(1.0f - square(sin_theta / ior_));
    const float way = 2.0f * cos_gamma_t / cos_theta_t;
    for (int c = 0; c < 3; ++c) {
        const float passed = std::exp(-sigma_a_[c] * way);
        v.attenuation[0][c] = fresnel;
        v.attenuation[1][c] = square(1.0f - fresnel) * passed;
        v.attenuation[2][c] = v.attenuation[1][c] * passed * fresnel;
        // 0/0 where grazing light is all reflected
        const float returned = passed * fresnel;
        v.attenuation[3][c] =
            returned < 1.0f ? v.attenuation[2][c] * returned / (1.0f - returned) : 0.0f;
    }
    const float gamma_t = std::asin(sin_gamma_t);
    for (int p = 0; p < 3; ++p)
        v.turn[p] = 2.0f * float(p) * gamma_t - 2.0f * gamma_o_ + float(p) * pi;
}

HairLobes::View HairLobes::view(const Vec3& wo) const {
    View v;
    const float sin_theta = std::clamp(wo.x, -1.0f, 1.0f), cos_theta = std::hypot(wo.y, wo.z);
    v.phi = std::atan2(wo.z, wo.y);
    attenuate(cos_theta, sin_theta, v);
    // Scales reflect by twice their tilt, and once as much the other way per passage
    const float sines[] = {-sin_tilt_[1], sin_tilt_[0], sin_tilt_[2], 0.0f};
    const float cosines[] = {cos_tilt_[1], cos_tilt_[0], cos_tilt_[2], 1.0f};
    float sum = 0;
    for (int p = 0; p < lobe_count; ++p) {
        v.sin_theta[p] = sin_theta * cosines[p] + cos_theta * sines[p];
        v.cos_theta[p] = std::abs(cos_theta * cosines[p] - sin_theta * sines[p]);
        v.probability[p] = mean(v.attenuation[p]);
        sum += v.probability[p];
    }
    for (float& probability : v.probability) probability /= sum;
    return v;
}

HairLobes::Value HairLobes::evaluate(const View& v, const Vec3& wi) const {
    const float sin_theta = std::clamp(wi.x, -1.0f, 1.0f), cos_theta = std::hypot(wi.y, wi.z);
    const float phi = std::atan2(wi.z, wi.y) - v.phi;
    Value value;
    for (int p = 0; p < lobe_count; ++p) {
        if (!(v.probability[p] > 0.0f)) continue;
        const float around =
            p < 3 ? trimmed_logistic(wrapped(phi - v.turn[p]), scale_, inside_) : 1.0f / two_pi;
        const float density =
            around * longitudinal(sin_theta, cos_theta, v.sin_theta[p], v.cos_theta[p],
                                  variance_[size_t(p)], normalizer_[size_t(p)]);
        value.f_cosine += v.attenuation[p] * density;
        value.pdf += v.probability[p] * density;
    }
    return value;
}

Vec3 HairLobes::sample(const View& v, float u_lobe, const Vec2& u) const {
    int p = 0;
    while (p < lobe_count - 1 && u_lobe >= v.probability[p]) u_lobe -= v.probability[p++];
    while (!(v.probability[p] > 0.0f)) --p;  // by rounding
    // What is left of the number is as random as it was
    const float u_turn = std::min(u_lobe / v.probability[p], 0x1.fffffep-1f);

    // Along the fiber. Ref: d'Eon, Marschner & Hanika 2013, "Importance Sampling for Physically-
    // Based Hair Fiber Models"
    const float variance = variance_[size_t(p)];
    const float tail = std::exp(-2.0f / variance);
    const float off = std::clamp(-variance * std::log(u.x + (1.0f - u.x) * tail), 0.0f, 2.0f);
    const float around = std::sqrt(off * (2.0f - off)) * std::cos(two_pi * u_turn);
    const float sin_theta =
        std::clamp(-(1.0f - off) * v.sin_theta[p] + around * v.cos_theta[p], -1.0f, 1.0f);
    const float cos_theta = safe_sqrt(1.0f - sin_theta * sin_theta);

    // Around it
    const float turn =
        p < 3 ? v.turn[p] + sample_trimmed_logistic(u.y, scale_, inside_) : two_pi * u.y;
    const float phi = v.phi + turn;
    return {sin_theta, cos_theta * std::cos(phi), cos_theta * std::sin(phi)};
}

Rgb HairLobes::albedo(const View& v) {
    Rgb sum(0.0f);
    for (const Rgb& share : v.attenuation) sum += share;
    return sum;
}

}  // namespace velatura::shading
