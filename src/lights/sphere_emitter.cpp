// SPDX-License-Identifier: Apache-2.0
#include "lights/emitters.h"
#include "lights/length_of.h"

#include <algorithm>
#include <cmath>

namespace velatura::lights {
namespace {

/// 1 − cos of half the cone that the unit sphere fills from distance d > 1; keeps its digits far
/// away.
double cone_of_sphere(double d) {
    const double cos_max = std::sqrt((d - 1.0) * (d + 1.0)) / d;
    return 1.0 / (d * d * (1.0 + cos_max));
}

/// The unit sphere of its frame, an ellipsoid in general. From outside the cone that it fills is
/// sampled, from inside all directions; directions are chosen in object space.
class SphereEmitter final : public Emitter {
  public:
    SphereEmitter(const scene::Light& light, const ShapeFrame& frame)
        : frame_(frame), Le_(light.Le), shaping_(light) {}

    std::optional<EmitterSample> sample(const Vec3d& p, const Vec2& u) const override {
        const Vec3d q = frame_.to_object_point(p);
        const double d = length_of(q);
        ObjectSample s;
        s.pdf = object_pdf(d);
        if (d > 1.0) {
            const Vec3d local = sample_cone(u, cone_of_sphere(d));
            s.wi = from_axis_frame(q / -d, local);
            const double sin_squared = local.x * local.x + local.y * local.y;
            const double half_chord = safe_sqrt(1.0 - d * d * sin_squared);
            s.distance = (d - 1.0) * (d + 1.0) / (d * local.z + half_chord);
        } else {
            s.wi = sample_cone(u, 2.0);
            const double b = q.dot(s.wi);
            s.distance = safe_sqrt(b * b + (1.0 - d) * (1.0 + d)) - b;
        }
        EmitterSample result = to_render(frame_, s);
        result.Le = Le_ * shaping_.factor(-result.wi);
        return result;
    }

    std::optional<EmitterHit> intersect(const Vec3d& o, const Vec3d& d) const override {
        const Vec3d q = frame_.to_object_point(o);
        const Vec3d v = frame_.to_object_direction(d);
        if (clearly_misses(q, v)) return std::nullopt;
        const double length = length_of(v);
        const Vec3d w = v / length;
        const double distance = length_of(q);
        const double b = q.dot(w);
        double t = 0.0;
        if (distance > 1.0) {
            // Distance of the ray from the center, without subtracting large squares
            const Vec3d closest = q - w * b;
            const double rest = 1.0 - closest.dot(closest);
            if (!(b < 0.0) || !(rest >= 0.0)) return std::nullopt;
            t = (distance - 1.0) * (distance + 1.0) / (std::sqrt(rest) - b);
        } else {
            t = safe_sqrt(b * b + (1.0 - distance) * (1.0 + distance)) - b;
        }
        return EmitterHit{t / length, Le_ * shaping_.factor(-d),
                          object_pdf(distance) * frame_.density_ratio(1.0 / length)};
    }

    std::optional<EmitterPoint> sample_point(const Vec2& u,
                                             const std::optional<Vec3d>& facing) const override {
        // Half of the sphere is seen from any one side, its middle most
        Vec3d m;
        double object_density = 1.0 / (4.0 * pi_d);
        if (facing) {
            const Vec3d axis = normalize(frame_.to_object_direction(*facing));
            const double share = double(u.x);
            if (share < facing_share) {
                const Vec2d disk = concentric_disk({float(share / facing_share), u.y});
                m = from_axis_frame(axis, {disk.x, disk.y, safe_sqrt(1.0 - disk.dot(disk))});
            } else {
                m = sample_cone({float((share - facing_share) / (1.0 - facing_share)), u.y}, 2.0);
            }
            object_density = (1.0 - facing_share) / (4.0 * pi_d) +
                             facing_share * std::max(0.0, m.dot(axis)) / pi_d;
        } else {
            m = sample_cone(u, 2.0);
        }
        EmitterPoint point;
        point.p = frame_.origin + frame_.from_object_direction(m);
        const Vec3d normal = frame_.dual_x * m.x + frame_.dual_y * m.y + frame_.dual_z * m.z;
        // Areas grow by the cofactors of the map
        point.pdf = object_density / (frame_.volume * length_of(normal));
        point.n = normalize(normal);
        return point;
    }

    Rgb radiance_at(const EmitterPoint& point, const Vec3d& o, const Vec3d& d) const override {
        const bool is_inside = length_of(frame_.to_object_point(o)) <= 1.0;
        if (is_inside != (point.n.dot(d) > 0.0)) return Rgb(0.0f);
        return Le_ * shaping_.factor(-d);
    }

    Box3d bounds() const override {
        Vec3d extent;
        for (int i = 0; i < 3; ++i) extent[i] = length_of({frame_.x[i], frame_.y[i], frame_.z[i]});
        return {frame_.origin - extent, frame_.origin + extent};
    }

    EmissionCone emission_cone() const override { return shaped_cone(shaping_, power(0.0)); }

    double power(double) const override {
        // Ref: Thomsen 2004, area of an ellipsoid within 1.1 %; enough for choosing lights
        const double a = length_of(frame_.x), b = length_of(frame_.y), c = length_of(frame_.z);
        const double p = 1.6075;
        const double ab = std::pow(a * b, p), bc = std::pow(b * c, p), ca = std::pow(c * a, p);
        const double area = 4.0 * pi_d * std::pow((ab + bc + ca) / 3.0, 1.0 / p);
        return pi_d * area * double(luminance(Le_)) * shaping_.mean_over_sphere();
    }

  private:
    /// Whether the line q + t·v passes the unit sphere, or leaves it behind, by more than any
    /// rounding: most lines do, and these need no root.
    static bool clearly_misses(const Vec3d& q, const Vec3d& v) {
        const double qq = q.dot(q), vv = v.dot(v), b = q.dot(v);
        if (!(qq > 1.0 + 1e-6)) return false;
        const double room = 1e-12 * qq * vv;
        return (b > 0.0 && b * b > room) || qq * vv - b * b > vv * (1.0 + 1e-6) + room;
    }

    /// Of the points chosen with regard to a direction; the others keep every point possible.
    static constexpr double facing_share = 0.9;

    static double object_pdf(double d) {
        return d > 1.0 ? 1.0 / (2.0 * pi_d * cone_of_sphere(d)) : 1.0 / (4.0 * pi_d);
    }

    ShapeFrame frame_;
    Rgb Le_;
    LightShaping shaping_;
};

}  // namespace

EmitterResult make_sphere(const EmitterInput& input) {
    const Mat4d& m = input.light.render_from_light;
    const double r = std::abs(double(input.light.radius));
    const auto frame =
        ShapeFrame::make(axis_of(m, 3), axis_of(m, 0) * r, axis_of(m, 1) * r, axis_of(m, 2) * r);
    if (!frame) {
        return Error{"light-degenerate",
                     "sphere light without volume emits nothing: its radius or its transform is "
                     "zero, flat or not finite"};
    }
    return std::unique_ptr<Emitter>(new SphereEmitter(input.light, *frame));
}

}  // namespace velatura::lights
