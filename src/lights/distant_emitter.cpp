// SPDX-License-Identifier: Apache-2.0
#include "lights/emitters.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace velatura::lights {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Half angles below this (radians) cannot be told apart in float directions and are a delta of the
/// same irradiance.
constexpr double smallest_half_angle = 1e-9;

/// All directions within half_angle of `axis`, which points toward the light; a single one when the
/// angle is 0.
class DistantEmitter final : public Emitter {
  public:
    DistantEmitter(const scene::Light& light, const Vec3d& axis, double half_angle)
        : axis_(axis), Le_(light.Le), is_delta_(half_angle < smallest_half_angle) {
        const double s = std::sin(0.5 * half_angle);
        one_minus_cos_ = 2.0 * s * s;
        if (is_delta_ && half_angle > 0.0) Le_ *= float(pi_d * half_angle * half_angle);
        const double t = std::min(half_angle, pi_d / 2.0);
        irradiance_ = is_delta_ ? 1.0 : pi_d * std::sin(t) * std::sin(t);
    }

    std::optional<EmitterSample> sample(const Vec3d&, const Vec2& u) const override {
        if (is_delta_) return EmitterSample{axis_, infinity, Le_, 1.0};
        const Vec3d wi = from_axis_frame(axis_, sample_cone(u, one_minus_cos_));
        return EmitterSample{wi, infinity, Le_, pdf()};
    }

    std::optional<EmitterHit> intersect(const Vec3d&, const Vec3d& d) const override {
        // |d − axis|² = 2 (1 − cos), without cancellation for small suns
        const Vec3d apart = d - axis_;
        if (is_delta_ || apart.dot(apart) > 2.0 * one_minus_cos_) return std::nullopt;
        return EmitterHit{infinity, Le_, pdf()};
    }

    std::optional<EmitterPoint> sample_point(const Vec2& u,
                                             const std::optional<Vec3d>&) const override {
        EmitterPoint point;
        point.n = is_delta_ ? axis_ : from_axis_frame(axis_, sample_cone(u, one_minus_cos_));
        point.pdf = is_delta_ ? 1.0 : pdf();
        return point;
    }

    Rgb radiance_at(const EmitterPoint&, const Vec3d&, const Vec3d&) const override { return Le_; }

    double power(double scene_radius) const override {
        return irradiance_ * pi_d * scene_radius * scene_radius * double(luminance(Le_));
    }

    bool is_infinite() const override { return true; }

    bool is_delta() const override { return is_delta_; }

  private:
    double pdf() const { return 1.0 / (2.0 * pi_d * one_minus_cos_); }

    Vec3d axis_;
    Rgb Le_;
    bool is_delta_;
    double one_minus_cos_ = 0;
    double irradiance_ = 0;  // on a facing surface, for radiance 1
};

}  // namespace

EmitterResult make_distant(const EmitterInput& input) {
    const scene::Light& light = input.light;
    const Vec3d axis = axis_of(light.render_from_light, 2);
    const double angle = double(light.angle_deg);
    if (!std::isfinite(axis.dot(axis)) || axis == Vec3d(0.0) || !std::isfinite(angle)) {
        return Error{
            "light-degenerate",
            "distant light emits nothing: its direction or its angle is zero or not finite"};
    }
    const double half_angle = std::clamp(0.5 * angle, 0.0, 180.0) * (pi_d / 180.0);
    return std::unique_ptr<Emitter>(new DistantEmitter(light, normalize(axis), half_angle));
}

}  // namespace velatura::lights
