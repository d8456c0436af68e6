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
/// What animation leaves of an angle scale of 0, which changes nothing: real ones this small would
/// leave no light.
constexpr float smallest_angle_scale = 1e-6f;

}  // namespace

LightShaping::LightShaping(const scene::Shaping& s, const Mat4d& render_from_light) {
    const Vec3d axis = transform_direction(Vec3d(0.0, 0.0, -1.0), render_from_light);
    const double squared = axis.dot(axis);
    if ((!s.is_active && !s.ies) || !std::isfinite(squared) || axis == Vec3d(0.0)) return;
    axis_ = normalize(axis);
    if (s.ies) set_profile(s, render_from_light);
    const double softness = std::clamp(double(s.cone_softness), 0.0, 1.0);
    cone_outer_ = std::max(0.0, double(s.cone_angle_deg)) * (pi_d / 180.0);
    cone_inner_ = cone_outer_ * (1.0 - softness);
    has_cone_ = cone_inner_ < pi_d;
    has_focus_ = s.focus > 0.0f;
    focus_ = double(s.focus);
    tint_ = s.focus_tint;
}

void LightShaping::set_profile(const scene::Shaping& s, const Mat4d& render_from_light) {
    const Vec3d x = transform_direction(Vec3d(1.0, 0.0, 0.0), render_from_light);
    const Vec3d y = transform_direction(Vec3d(0.0, 1.0, 0.0), render_from_light);
    const Vec3d across = x - axis_ * axis_.dot(x);
    // A light that is squeezed flat keeps some directions across its axis
    across_x_ =
        across.dot(across) > 0.0 ? normalize(across) : Vec3d(Frame::from_z(to_float(axis_)).x);
    const Vec3d other = axis_.cross(across_x_);
    across_y_ = other.dot(y) < 0.0 ? -other : other;
    profile_ = s.ies;
    angle_scale_ =
        std::abs(s.ies_angle_scale) < smallest_angle_scale ? 0.0 : double(s.ies_angle_scale);
    const double mean = s.ies_normalize ? scene::mean_intensity(*profile_) : 1.0;
    profile_scale_ = mean > 0.0 ? 1.0 / mean : 0.0;
}

EmissionCone LightShaping::cone() const {
    EmissionCone cone;
    double outer = has_cone_ ? cone_outer_ : pi_d;
    if (profile_) {
        const double end = profile_->vertical.back();
        const double scaled = angle_scale_ > 0.0   ? end * angle_scale_
                              : angle_scale_ < 0.0 ? pi_d + (pi_d - end) * angle_scale_
                                                   : end;
        // With room for the rounding of angles
        outer = std::min(outer, std::max(0.0, scaled) + 1e-9);
    }
    if (outer >= pi_d) return cone;
    cone.axis = axis_;
    cone.normals = 0.0;
    cone.spread = outer;
    return cone;
}

double LightShaping::profile_factor(double theta, double phi) const {
    if (angle_scale_ > 0.0)
        theta = theta / angle_scale_;
    else if (angle_scale_ < 0.0)
        theta = pi_d - (pi_d - theta) / -angle_scale_;
    return profile_scale_ * scene::intensity(*profile_, theta, phi);
}

double LightShaping::mean_profile_factor(double theta) const {
    if (!profile_) return 1.0;
    constexpr int steps = 64;
    double sum = 0.0;
    for (int i = 0; i < steps; ++i) sum += profile_factor(theta, (i + 0.5) * 2.0 * pi_d / steps);
    return sum / steps;
}

Rgb LightShaping::active_factor(const Vec3d& wo) const {
    using scene::Effect;
    const double cosine = axis_.dot(wo);
    Rgb result(1.0f);
    if (has_cone_ || has_focus_) {
        scene::count_call(Effect::LightShaping);
        result = factor_of_cosine(cosine);
    }
    if (profile_) {
        scene::count_call(Effect::LightProfiles);
        const double phi = std::atan2(-wo.dot(across_y_), -wo.dot(across_x_));
        result *= float(profile_factor(safe_acos(cosine), phi));
    }
    return result;
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
        sum += double(luminance(factor_of_cosine(std::cos(theta)))) * mean_profile_factor(theta) *
               std::sin(theta);
    }
    return std::max(sum * pi_d / (2.0 * steps), smallest_mean);
}

double LightShaping::mean_over_hemisphere() const {
    if (!is_active()) return 1.0;
    constexpr int steps = 256;
    double sum = 0.0;
    for (int i = 0; i < steps; ++i) {
        const double theta = (i + 0.5) * pi_d / (2.0 * steps);
        sum += double(luminance(factor_of_cosine(std::cos(theta)))) * mean_profile_factor(theta) *
               std::sin(2.0 * theta);
    }
    return std::max(sum * pi_d / (2.0 * steps), smallest_mean);
}

}  // namespace velatura::lights
