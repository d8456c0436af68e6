// SPDX-License-Identifier: Apache-2.0
#include "lights/emitters.h"
#include "lights/environment_map.h"
#include "lights/length_of.h"
#include "lights/spherical_rectangle.h"
#include "scene/effect_calls.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::lights {
namespace {

/// Below this solid angle rectangles are sampled by area, where the density is smooth and free of
/// cancellation.
constexpr double smallest_solid_angle = 1e-5;
/// Disks that fill less are sampled by area; the others by the square around them, which costs
/// every fifth sample.
constexpr double smallest_disk_square = 2.0;

/// Frame of a flat shape from its spanning vectors: z is the direction of emission, the image of
/// −Z's side.
std::optional<ShapeFrame> planar_frame(const scene::Light& light, const Vec3d& x, const Vec3d& y) {
    const Mat4d& m = light.render_from_light;
    const Vec3d normal = x.cross(y);
    if (!std::isfinite(normal.dot(normal)) || normal == Vec3d(0.0)) return std::nullopt;
    // A mirrored transform swaps the winding but light still leaves toward the image of −Z
    const bool is_mirrored = determinant3(m) < 0.0;
    const Vec3d n = normalize(is_mirrored ? normal : -normal);
    return ShapeFrame::make(axis_of(m, 3), x, y, n * std::sqrt(length_of(x) * length_of(y)));
}

/// Density [1/sr] of a point chosen uniformly on an area of the plane z = 0, seen from a point at
/// height h.
double area_pdf(double distance, double height, double area) {
    return distance * (distance * distance) / (height * area);
}

RectangleView view_from(const Vec3d& p, double half_x, double half_y) {
    RectangleView v;
    v.x0 = -half_x - p.x;
    v.x1 = half_x - p.x;
    v.y0 = -half_y - p.y;
    v.y1 = half_y - p.y;
    v.width = 2.0 * half_x;
    v.length = 2.0 * half_y;
    v.height = p.z;
    return v;
}

ObjectSample toward(const Vec3d& p, const Vec2d& point) {
    const Vec3d v(point.x - p.x, point.y - p.y, -p.z);
    ObjectSample s;
    s.distance = length_of(v);
    s.wi = v * (1.0 / s.distance);
    return s;
}

/// Where a ray meets the plane z = 0.
struct PlaneHit {
    double t = 0;
    Vec2d point;
};

PlaneHit meet_plane(const Vec3d& o, const Vec3d& d) {
    const double t = o.z / -d.z;
    return {t, {o.x + d.x * t, o.y + d.y * t}};
}

/// Common part: frame, radiance, box. The shape fills |x| <= half_x, |y| <= half_y of its plane.
class PlanarEmitter : public Emitter {
  public:
    PlanarEmitter(const scene::Light& light, const ShapeFrame& frame, double half_x, double half_y)
        : frame_(frame), half_x_(half_x), half_y_(half_y), Le_(light.Le), shaping_(light) {}

    Box3d bounds() const override {
        const Vec3d ex = frame_.x * half_x_, ey = frame_.y * half_y_;
        Box3d box;
        for (const double sx : {-1.0, 1.0})
            for (const double sy : {-1.0, 1.0}) box.extendBy(frame_.origin + ex * sx + ey * sy);
        return box;
    }

    EmissionCone emission_cone() const override {
        // Whichever is narrower: the half space in front, or the shaped cone
        EmissionCone cone = shaping_.cone();
        if (cone.normals > 0.0 || cone.spread >= pi_d / 2.0) {
            cone.axis = normalize(frame_.z);
            cone.normals = 0.0;
            cone.spread = pi_d / 2.0;
        }
        cone.intensity = power(0.0) / (pi_d * shaping_.mean_over_hemisphere());
        return cone;
    }

  protected:
    EmitterPoint point_at(const Vec2d& at, double pdf) const {
        return {frame_.origin + frame_.x * at.x + frame_.y * at.y, normalize(frame_.z), pdf};
    }

    double parallelogram_area() const {
        return 4.0 * half_x_ * half_y_ * length_of(frame_.x.cross(frame_.y));
    }

    /// Whether the ray o + t·d comes from the lit side and goes towards the plane.
    bool faces(const Vec3d& o, const Vec3d& d) const {
        return (o - frame_.origin).dot(frame_.dual_z) > 0.0 && d.dot(frame_.dual_z) < 0.0;
    }

    ShapeFrame frame_;
    double half_x_, half_y_;
    Rgb Le_;
    LightShaping shaping_;
};

/// Parallelograms are rectangles of a skewed frame.
class RectEmitter final : public PlanarEmitter {
  public:
    RectEmitter(const EmitterInput& input, const ShapeFrame& frame, double half_x, double half_y)
        : PlanarEmitter(input.light, frame, half_x, half_y) {
        if (input.image != nullptr) texture_ = std::move(*input.image);
    }

    std::optional<EmitterSample> sample(const Vec3d& p, const Vec2& u) const override {
        const Vec3d q = frame_.to_object_point(p);
        if (!(q.z > 0.0)) return std::nullopt;
        const RectangleView view = view_from(q, half_x_, half_y_);
        const double omega = solid_angle(view);
        Vec2d point((double(u.x) - 0.5) * view.width, (double(u.y) - 0.5) * view.length);
        if (omega >= smallest_solid_angle) {
            const Vec2d relative = sample_solid_angle(view, omega, u);
            point = {relative.x + q.x, relative.y + q.y};
        }
        ObjectSample s = toward(q, point);
        s.pdf = pdf(view, omega, s.distance);
        EmitterSample result = to_render(frame_, s);
        result.Le = radiance(point, result.wi);
        return result;
    }

    std::optional<EmitterHit> intersect(const Vec3d& o, const Vec3d& d) const override {
        if (!faces(o, d)) return std::nullopt;
        const Vec3d q = frame_.to_object_point(o);
        const Vec3d v = frame_.to_object_direction(d);
        const PlaneHit hit = meet_plane(q, v);
        if (std::abs(hit.point.x) > half_x_ || std::abs(hit.point.y) > half_y_) return std::nullopt;
        const double length = length_of(v);
        const RectangleView view = view_from(q, half_x_, half_y_);
        const double object_pdf = pdf(view, solid_angle(view), hit.t * length);
        return EmitterHit{hit.t, radiance(hit.point, d),
                          object_pdf * frame_.density_ratio(1.0 / length)};
    }

    std::optional<EmitterPoint> sample_point(const Vec2& u,
                                             const std::optional<Vec3d>&) const override {
        const Vec2d at((2.0 * double(u.x) - 1.0) * half_x_, (2.0 * double(u.y) - 1.0) * half_y_);
        return point_at(at, 1.0 / parallelogram_area());
    }

    Rgb radiance_at(const EmitterPoint& point, const Vec3d&, const Vec3d& d) const override {
        if (!(point.n.dot(d) < 0.0)) return Rgb(0.0f);
        const Vec3d q = frame_.to_object_point(point.p);
        return radiance({q.x, q.y}, d);
    }

    double power(double) const override {
        const double texture = texture_.width > 0 ? double(mean_luminance(texture_)) : 1.0;
        return pi_d * parallelogram_area() * double(luminance(Le_)) * texture *
               shaping_.mean_over_hemisphere();
    }

  private:
    static double pdf(const RectangleView& view, double omega, double distance) {
        if (omega >= smallest_solid_angle) return 1.0 / omega;
        return area_pdf(distance, view.height, view.width * view.length);
    }

    /// Radiance of a point of the plane toward −wi.
    Rgb radiance(const Vec2d& point, const Vec3d& wi) const {
        Rgb result = Le_ * shaping_.factor(-wi);
        if (texture_.width > 0) {
            scene::count_call(scene::Effect::LightTextures);
            // The texture starts at (+x, +y): upright and not mirrored for a viewer on the lit side
            const Vec2d uv(0.5 - point.x / (2.0 * half_x_), 0.5 - point.y / (2.0 * half_y_));
            result *= bilinear_clamped(texture_, uv);
        }
        return result;
    }

    EnvironmentImage texture_;  // width 0 = none
};

/// The unit disk of its frame.
class DiskEmitter final : public PlanarEmitter {
  public:
    DiskEmitter(const scene::Light& light, const ShapeFrame& frame)
        : PlanarEmitter(light, frame, 1.0, 1.0) {}

    std::optional<EmitterSample> sample(const Vec3d& p, const Vec2& u) const override {
        const Vec3d q = frame_.to_object_point(p);
        if (!(q.z > 0.0)) return std::nullopt;
        const RectangleView view = view_from(q, 1.0, 1.0);
        const double omega = solid_angle(view);
        Vec2d point;
        if (omega >= smallest_disk_square) {
            const Vec2d relative = sample_solid_angle(view, omega, u);
            point = {relative.x + q.x, relative.y + q.y};
            if (point.dot(point) > 1.0) return std::nullopt;
        } else {
            point = concentric_disk(u);
        }
        ObjectSample s = toward(q, point);
        s.pdf = pdf(view, omega, s.distance);
        EmitterSample result = to_render(frame_, s);
        result.Le = Le_ * shaping_.factor(-result.wi);
        return result;
    }

    std::optional<EmitterHit> intersect(const Vec3d& o, const Vec3d& d) const override {
        if (!faces(o, d)) return std::nullopt;
        const Vec3d q = frame_.to_object_point(o);
        const Vec3d v = frame_.to_object_direction(d);
        const PlaneHit hit = meet_plane(q, v);
        if (hit.point.dot(hit.point) > 1.0) return std::nullopt;
        const double length = length_of(v);
        const RectangleView view = view_from(q, 1.0, 1.0);
        const double object_pdf = pdf(view, solid_angle(view), hit.t * length);
        return EmitterHit{hit.t, Le_ * shaping_.factor(-d),
                          object_pdf * frame_.density_ratio(1.0 / length)};
    }

    std::optional<EmitterPoint> sample_point(const Vec2& u,
                                             const std::optional<Vec3d>&) const override {
        return point_at(concentric_disk(u), 1.0 / (pi_d / 4.0 * parallelogram_area()));
    }

    Rgb radiance_at(const EmitterPoint& point, const Vec3d&, const Vec3d& d) const override {
        return point.n.dot(d) < 0.0 ? Le_ * shaping_.factor(-d) : Rgb(0.0f);
    }

    double power(double) const override {
        return pi_d * (pi_d / 4.0) * parallelogram_area() * double(luminance(Le_)) *
               shaping_.mean_over_hemisphere();
    }

  private:
    static double pdf(const RectangleView& view, double omega, double distance) {
        if (omega >= smallest_disk_square) return 1.0 / omega;
        return area_pdf(distance, view.height, pi_d);
    }
};

Error degenerate(const char* what) {
    return {"light-degenerate", std::string(what) +
                                    " without area emits nothing: its size or its "
                                    "transform is zero or not finite"};
}

}  // namespace

EmitterResult make_rect(const EmitterInput& input) {
    const scene::Light& light = input.light;
    const Vec3d ex = axis_of(light.render_from_light, 0) * double(light.width);
    const Vec3d ey = axis_of(light.render_from_light, 1) * double(light.height);
    const double lx = length_of(ex), ly = length_of(ey);
    if (input.image != nullptr && !(mean_luminance(*input.image) > 0.0f))
        return Error{"light-black-texture", "rect light emits nothing: its texture is black"};
    if (!(lx > 0.0) || !(ly > 0.0)) return degenerate("rect light");
    // Sizes below zero mirror the shape, which the area does not show and the texture does
    const auto frame = planar_frame(light, ex / lx * (light.width < 0.0f ? -1.0 : 1.0),
                                    ey / ly * (light.height < 0.0f ? -1.0 : 1.0));
    if (!frame) return degenerate("rect light");
    return std::unique_ptr<Emitter>(new RectEmitter(input, *frame, lx / 2.0, ly / 2.0));
}

EmitterResult make_disk(const EmitterInput& input) {
    const scene::Light& light = input.light;
    const double r = std::abs(double(light.radius));
    const auto frame = planar_frame(light, axis_of(light.render_from_light, 0) * r,
                                    axis_of(light.render_from_light, 1) * r);
    if (!frame) return degenerate("disk light");
    return std::unique_ptr<Emitter>(new DiskEmitter(light, *frame));
}

}  // namespace velatura::lights
