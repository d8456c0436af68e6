// SPDX-License-Identifier: Apache-2.0
#include "lights/emitters.h"
#include "lights/length_of.h"

#include <algorithm>
#include <cmath>

namespace velatura::lights {
namespace {

/// The mantle y² + z² = 1, |x| <= half of its frame, seen from outside. The angle around the axis
/// is chosen uniformly among the visible ones, then the place along the line uniformly in the angle
/// seen from the point (Kulla & Fajardo 2012, "equiangular sampling"), both in object space.
class CylinderEmitter final : public Emitter {
  public:
    CylinderEmitter(const scene::Light& light, const ShapeFrame& frame, double half_length)
        : frame_(frame), half_(half_length), Le_(light.Le), shaping_(light) {}

    std::optional<EmitterSample> sample(const Vec3d& p, const Vec2& u) const override {
        const Vec3d q = frame_.to_object_point(p);
        const double rho = std::sqrt(q.y * q.y + q.z * q.z);
        if (!(rho > 1.0)) return std::nullopt;
        const double visible = largest_angle(rho);
        const double angle = (2.0 * double(u.x) - 1.0) * visible;
        const double line = line_distance(rho, angle);
        if (!(line > 0.0)) return std::nullopt;

        // Walk from one end by a part of the angle that the line fills
        const double full = angle_of_line(q.x, line);
        const double start = std::atan2(-half_ - q.x, line);
        const double x =
            std::clamp(q.x + line * std::tan(start + double(u.y) * full), -half_, half_);
        const double c = std::cos(angle), s = std::sin(angle);
        const double ny = (q.y * c - q.z * s) / rho, nz = (q.z * c + q.y * s) / rho;
        const Vec3d v(x - q.x, ny - q.y, nz - q.z);

        ObjectSample object;
        object.distance = length_of(v);
        object.wi = v / object.distance;
        object.pdf = object_pdf(rho, visible, angle, line, full, object.distance);
        if (!(object.pdf > 0.0)) return std::nullopt;
        EmitterSample result = to_render(frame_, object);
        result.Le = Le_ * shaping_.factor(-result.wi);
        return result;
    }

    std::optional<EmitterHit> intersect(const Vec3d& o, const Vec3d& d) const override {
        const Vec3d q = frame_.to_object_point(o);
        const Vec3d v = frame_.to_object_direction(d);
        const double rho = std::sqrt(q.y * q.y + q.z * q.z);
        const double across_squared = v.y * v.y + v.z * v.z;
        if (!(rho > 1.0) || !(across_squared > 0.0)) return std::nullopt;

        // In the plane across the axis: a circle and a line
        const double across = std::sqrt(across_squared);
        const double wy = v.y / across, wz = v.z / across;
        const double b = q.y * wy + q.z * wz;
        const double moment = q.y * wz - q.z * wy;
        const double rest = (1.0 - moment) * (1.0 + moment);
        if (!(b < 0.0) || !(rest >= 0.0)) return std::nullopt;
        const double root = std::sqrt(rest);
        const double t = (rho - 1.0) * (rho + 1.0) / (root - b) / across;
        const double x = q.x + v.x * t;
        if (std::abs(x) > half_) return std::nullopt;

        const double ny = q.y + v.y * t, nz = q.z + v.z * t;
        const double angle = std::atan2(ny * q.z - nz * q.y, ny * q.y + nz * q.z);
        const double line = line_distance(rho, angle);
        const double length = length_of(v);
        const double pdf =
            object_pdf(rho, largest_angle(rho), angle, line, angle_of_line(q.x, line), t * length);
        return EmitterHit{t, Le_ * shaping_.factor(-d), pdf * frame_.density_ratio(1.0 / length)};
    }

    std::optional<EmitterPoint> sample_point(const Vec2& u,
                                             const std::optional<Vec3d>&) const override {
        const double angle = 2.0 * pi_d * double(u.x);
        const Vec3d m(0.0, std::cos(angle), std::sin(angle));
        EmitterPoint point;
        const double x = (2.0 * double(u.y) - 1.0) * half_;
        point.p = frame_.origin + frame_.from_object_direction({x, m.y, m.z});
        const Vec3d normal = frame_.dual_y * m.y + frame_.dual_z * m.z;
        // Areas grow by the cofactors of the map
        point.pdf = 1.0 / (4.0 * pi_d * half_ * frame_.volume * length_of(normal));
        point.n = normalize(normal);
        return point;
    }

    Rgb radiance_at(const EmitterPoint& point, const Vec3d&, const Vec3d& d) const override {
        // A ray that comes through an open end meets the dark inside
        return point.n.dot(d) < 0.0 ? Le_ * shaping_.factor(-d) : Rgb(0.0f);
    }

    Box3d bounds() const override {
        Vec3d extent;
        for (int i = 0; i < 3; ++i)
            extent[i] = std::abs(frame_.x[i]) * half_ + length_of({0.0, frame_.y[i], frame_.z[i]});
        return {frame_.origin - extent, frame_.origin + extent};
    }

    EmissionCone emission_cone() const override { return shaped_cone(shaping_, power(0.0)); }

    double power(double) const override {
        const double girth =
            2.0 * pi_d * std::sqrt((frame_.y.dot(frame_.y) + frame_.z.dot(frame_.z)) / 2.0);
        return pi_d * girth * 2.0 * half_ * length_of(frame_.x) * double(luminance(Le_)) *
               shaping_.mean_over_sphere();
    }

  private:
    /// Half of the range of angles around the axis that face a point at distance rho > 1 from it.
    static double largest_angle(double rho) {
        return std::atan2(std::sqrt((rho - 1.0) * (rho + 1.0)), 1.0);
    }

    /// Distance from the point to the line of the mantle at `angle` from it.
    static double line_distance(double rho, double angle) {
        const double s = std::sin(0.5 * angle);
        return std::sqrt((rho - 1.0) * (rho - 1.0) + 4.0 * rho * s * s);
    }

    /// Angle that the line fills, seen from its distance; one atan2, so that it keeps its digits
    /// far away.
    double angle_of_line(double x, double line) const {
        const double x0 = -half_ - x, x1 = half_ - x;
        return std::atan2(line * 2.0 * half_, line * line + x0 * x1);
    }

    /// Density in angle and x, divided by cosine / distance² to be one in solid angle.
    static double object_pdf(
        double rho, double visible, double angle, double line, double full, double distance) {
        // rho · cos(angle) − 1, the distance from the tangent plane
        const double s = std::sin(0.5 * angle);
        const double facing = (rho - 1.0) - 2.0 * rho * s * s;
        return facing > 0.0 ? line * distance / (2.0 * visible * full * facing) : 0.0;
    }

    ShapeFrame frame_;
    double half_;  // of the length, in object units
    Rgb Le_;
    LightShaping shaping_;
};

}  // namespace

EmitterResult make_cylinder(const EmitterInput& input) {
    const Mat4d& m = input.light.render_from_light;
    const double r = std::abs(double(input.light.radius));
    const double half_length = std::abs(double(input.light.length)) / (2.0 * r);
    const auto frame =
        ShapeFrame::make(axis_of(m, 3), axis_of(m, 0) * r, axis_of(m, 1) * r, axis_of(m, 2) * r);
    if (!frame || !(half_length > 0.0) || !std::isfinite(half_length)) {
        return Error{"light-degenerate",
                     "cylinder light without volume emits nothing: its radius, length or transform "
                     "is zero, flat or not finite"};
    }
    return std::unique_ptr<Emitter>(new CylinderEmitter(input.light, *frame, half_length));
}

}  // namespace velatura::lights
