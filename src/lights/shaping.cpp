// SPDX-License-Identifier: Apache-2.0
#include "lights/shaping.h"

#include "lights/emitter.h"
#include "scene/effect_calls.h"

#include <algorithm>
#include <cmath>

namespace velatura::lights {
namespace {

/// A cone too narrow for the quadrature still shines.
constexpr double smallest_mean = 1e-6;

}  // namespace

LightShaping::LightShaping(const scene::Shaping& s, const Mat4d& render_from_light) {
    const Vec3d axis = transform_direction(Vec3d(0.0, 0.0, -1.0), render_from_light);
    const double squared = axis.dot(axis);
    if (!s.is_active || !std::isfinite(squared) || axis == Vec3d(0.0)) return;
    axis_ = normalize(axis);
    const double softness = std::clamp(double(s.cone_softness), 0.0, 1.0);
    cone_outer_ = std::max(0.0, double(s.cone_angle_deg)) * (pi_d / 180.0);
    cone_inner_ = cone_outer_ * (1.0 - softness);
    has_cone_ = cone_inner_ < pi_d;
    has_focus_ = s.focus > 0.0f;
    focus_ = double(s.focus);
    tint_ = s.focus_tint;
}

EmissionCone LightShaping::cone() const {
    EmissionCone cone;
    if (!has_cone_ || cone_outer_ >= pi_d) return cone;
    cone.axis = axis_;
    cone.normals = 0.0;
    cone.spread = cone_outer_;
    return cone;
}

Rgb LightShaping::factor(const Vec3d& wo) const {
    if (!is_active()) return Rgb(1.0f);
    scene::count_call(scene::Effect::LightShaping);
    return factor_of_cosine(axis_.dot(wo));
}

Rgb LightShaping::factor_of_cosine(double cos_theta) const {
    Rgb result(1.0f);
    if (has_cone_) {
        const double theta = safe_acos(cos_theta);
        if (theta > cone_outer_) return Rgb(0.0f);
        if (theta > cone_inner_) {
            const double t = (theta - cone_inner_) / (cone_outer_ - cone_inner_);
            result *= float(1.0 - t * t * (3.0 - 2.0 * t));
        }
    }
    if (has_focus_) {
        const float f = float(std::pow(std::abs(cos_theta), focus_));
        result *= tint_ * (1.0f - f) + Rgb(f);
    }
    return result;
}

double LightShaping::mean_over_sphere() const {
    if (!is_active()) return 1.0;
    constexpr int steps = 256;
    double sum = 0.0;
    for (int i = 0; i < steps; ++i) {
        const double theta = (i + 0.5) * pi_d / steps;
        sum += double(luminance(factor_of_cosine(std::cos(theta)))) * std::sin(theta);
    }
    return std::max(sum * pi_d / (2.0 * steps), smallest_mean);
}

double LightShaping::mean_over_hemisphere() const {
    if (!is_active()) return 1.0;
    constexpr int steps = 256;
    double sum = 0.0;
    for (int i = 0; i < steps; ++i) {
        const double theta = (i + 0.5) * pi_d / (2.0 * steps);
        sum += double(luminance(factor_of_cosine(std::cos(theta)))) * std::sin(2.0 * theta);
    }
    return std::max(sum * pi_d / (2.0 * steps), smallest_mean);
}

}  // namespace velatura::lights
