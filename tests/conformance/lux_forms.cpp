// SPDX-License-Identifier: Apache-2.0
#include "lux_forms.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::test {

namespace {

using Kind = LuxLight::Kind;

constexpr int corner_count = 4096;  ///< of an outline

double length_of(const Vec3d& v) {
    return std::sqrt(v.dot(v));
}

Vec3d axis_of(const LuxLight& light) {
    const Vec3d v = transform_direction(Vec3d(0, 0, -1), light.world_from_light);
    return v / length_of(v);
}

// ---- Exact: radiance 1 from everywhere inside an outline ----

/// Cuts off what lies below the horizon of n. Sutherland & Hodgman 1974, on directions.
std::vector<Vec3d> above_horizon(const std::vector<Vec3d>& outline, const Vec3d& n) {
    std::vector<Vec3d> out;
    for (size_t i = 0; i < outline.size(); ++i) {
        const Vec3d& a = outline[i];
        const Vec3d& b = outline[(i + 1) % outline.size()];
        const double ha = a.dot(n), hb = b.dot(n);
        if (ha >= 0) out.push_back(a);
        if ((ha > 0 && hb < 0) || (ha < 0 && hb > 0)) out.push_back((a * hb - b * ha) / (hb - ha));
    }
    return out;
}

/// Lambert's formula: ½ Σ (angle of an edge) · (normal of its plane · n).
double polygon_irradiance(const std::vector<Vec3d>& outline, const Vec3d& n) {
    const std::vector<Vec3d> corners = above_horizon(outline, n);
    double sum = 0;
    for (size_t i = 0; i < corners.size(); ++i) {
        const Vec3d a = corners[i].normalized(), b = corners[(i + 1) % corners.size()].normalized();
        const Vec3d normal = a.cross(b);
        const double s = length_of(normal);
        if (s > 0) sum += std::atan2(s, a.dot(b)) / s * normal.dot(n);
    }
    return 0.5 * std::abs(sum);
}

/// Circle around `center` spanned by two vectors.
std::vector<Vec3d> circle(const Vec3d& center, const Vec3d& a, const Vec3d& b) {
    std::vector<Vec3d> out;
    for (int i = 0; i < corner_count; ++i) {
        const double t = 2 * pi_d * i / corner_count;
        out.push_back(center + a * std::cos(t) + b * std::sin(t));
    }
    return out;
}

/// Two unit vectors across the unit vector w and each other.
void span_plane(const Vec3d& w, Vec3d& a, Vec3d& b) {
    a = w.cross(std::abs(w.x) < 0.7 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0)).normalized();
    b = w.cross(a);
}

/// Outline in light space of what of the shape shines at q, empty where nothing does.
std::vector<Vec3d> outline_of(const LuxLight& light, const Vec3d& q) {
    const double r = light.radius, w = light.width / 2, h = light.height / 2;
    if (light.kind == Kind::Rect || light.kind == Kind::Disk) {
        if (q.z >= 0) return {};
        if (light.kind == Kind::Disk) return circle(Vec3d(0.0), {r, 0, 0}, {0, r, 0});
        return {{-w, -h, 0}, {w, -h, 0}, {w, h, 0}, {-w, h, 0}};
    }
    if (light.kind == Kind::Sphere) {
        // Where the tangents from q touch
        const double d = length_of(q), sine = r / d;
        Vec3d a, b;
        span_plane(q / d, a, b);
        const double ring = r * std::sqrt(1 - sine * sine);
        return circle(q * (sine * sine), a * ring, b * ring);
    }
    // The part of the mantle that faces q lies between two lines along X
    const double rho = std::hypot(q.y, q.z), middle = std::atan2(q.z, q.y);
    if (rho <= r) return {};
    const double visible = std::acos(r / rho);
    std::vector<Vec3d> out;
    for (const double side : {-1.0, 1.0}) {
        for (int i = 0; i <= corner_count / 2; ++i) {
            const double t = middle + side * visible * (1 - 4.0 * i / corner_count);
            out.push_back({side * light.length / 2, r * std::cos(t), r * std::sin(t)});
        }
    }
    return out;
}

/// Irradiance for radiance 1.
double unshaped_irradiance(const LuxLight& light, const Vec3d& p, const Vec3d& n) {
    if (light.kind == Kind::Distant) {
        const Vec3d w = -axis_of(light);
        const double half = light.angle_deg / 2 * pi_d / 180;
        if (half == 0) return std::max(0.0, w.dot(n));
        Vec3d a, b;
        span_plane(w, a, b);
        return polygon_irradiance(
            circle(w * std::cos(half), a * std::sin(half), b * std::sin(half)), n);
    }
    const Vec3d q = transform_point(p, light.world_from_light.inverse());
    std::vector<Vec3d> outline = outline_of(light, q);
    for (Vec3d& corner : outline) corner = transform_point(corner, light.world_from_light) - p;
    return polygon_irradiance(outline, n);
}

// ---- By quadrature over the surface ----

struct SurfacePatch {
    Vec3d position;
    Vec3d area;  ///< dA · outward normal, per unit of (s, t)
};

/// The shape as a map of the unit square, with the side that shines.
SurfacePatch patch_at(const LuxLight& light, double s, double t) {
    const double r = light.radius, a = 2 * pi_d * t, b = pi_d * s;
    Vec3d at, along_s, along_t, out(0, 0, -1);
    if (light.kind == Kind::Rect) {
        at = {light.width * (s - 0.5), light.height * (t - 0.5), 0};
        along_s = {light.width, 0, 0};
        along_t = {0, light.height, 0};
    } else if (light.kind == Kind::Disk) {
        at = {r * s * std::cos(a), r * s * std::sin(a), 0};
        along_s = {r * std::cos(a), r * std::sin(a), 0};
        along_t = Vec3d(-at.y, at.x, 0) * (2 * pi_d);
    } else if (light.kind == Kind::Sphere) {
        at = Vec3d(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b)) * r;
        along_s = Vec3d(std::cos(b) * std::cos(a), std::cos(b) * std::sin(a), -std::sin(b)) * r;
        along_s *= pi_d;
        along_t = Vec3d(-at.y, at.x, 0) * (2 * pi_d);
        out = at;
    } else {
        out = {0, std::cos(a), std::sin(a)};
        at = Vec3d(light.length * (s - 0.5), r * out.y, r * out.z);
        along_s = {light.length, 0, 0};
        along_t = Vec3d(0, -out.z, out.y) * (2 * pi_d * r);
    }
    const Mat4d& m = light.world_from_light;
    SurfacePatch patch{transform_point(at, m),
                       transform_direction(along_s, m).cross(transform_direction(along_t, m))};
    if (patch.area.dot(transform_direction(out, m)) < 0) patch.area = -patch.area;
    return patch;
}

double smooth_step(double x, double from, double to) {
    if (x <= from) return 0;
    if (x > to) return 1;
    const double t = (x - from) / (to - from);
    return t * t * (3 - 2 * t);
}

/// Cone and focus of what leaves along the unit vector `wo`.
Vec3d cone_and_focus(const LuxLight& light,
                     const Vec3d& axis,
                     const Vec3d& wo,
                     double focus_cosine) {
    const double theta = std::acos(std::clamp(axis.dot(wo), -1.0, 1.0));
    const double cutoff = light.cone_angle_deg * pi_d / 180;
    if (theta > cutoff) return Vec3d(0.0);
    const double softness = std::clamp(light.cone_softness, 0.0, 1.0);
    const double cone = 1 - smooth_step(theta, cutoff * (1 - softness), cutoff);
    if (!(light.focus > 0)) return Vec3d(cone);
    const double f = std::pow(std::abs(focus_cosine), light.focus);
    return (light.focus_tint * (1 - f) + Vec3d(f)) * cone;
}

/// Of a light that is turned and moved alone. Horizontal angles are those of the direction towards
/// the light, in its own space: reference code of luxtest, `EvalIES`.
double profile(const LuxLight& light, const Vec3d& wo) {
    if (!light.ies) return 1;
    const Vec3d local = transform_direction(-wo, light.world_from_light.inverse()).normalized();
    const double degrees = 180 / pi_d, phi = std::atan2(local.y, local.x) * degrees;
    const double theta = std::acos(std::clamp(local.z, -1.0, 1.0)) * degrees;
    return light.ies->scaled(theta, phi < 0 ? phi + 360 : phi, light.ies_angle_scale) /
           light.ies_divisor;
}

Vec3d shaping(const LuxLight& light, const Vec3d& axis, const Vec3d& wo, double focus_cosine) {
    return cone_and_focus(light, axis, wo, focus_cosine) * profile(light, wo);
}

/// Integrates over cells of the unit square: three by three Gauss points each, split where four
/// smaller ones say otherwise. The edge of a hard cone is found by splitting; the first cells are
/// smaller than the smallest spot that a cone of luxtest leaves.
template <class Integrand>
class AdaptiveQuadrature {
  public:
    explicit AdaptiveQuadrature(Integrand integrand) : integrand_(std::move(integrand)) {}

    /// Integral, and the sum of all last changes as a bound of its error.
    Irradiance integrate() {
        constexpr int cells = 48;
        std::vector<Vec3d> first;
        Vec3d coarse(0.0);
        for (int i = 0; i < cells * cells; ++i) {
            first.push_back(gauss({double(i / cells), double(i % cells)}, 1.0 / cells));
            coarse += first.back();
        }
        tolerance_ = 2e-7 * std::max(coarse.x, std::max(coarse.y, coarse.z));
        Irradiance out;
        for (int i = 0; i < cells * cells; ++i) {
            const Vec2d corner(double(i / cells), double(i % cells));
            out.value += refined(corner, 1.0 / cells, first[size_t(i)], 6);
        }
        out.uncertainty = uncertainty_;
        return out;
    }

  private:
    Vec3d refined(const Vec2d& corner, double side, const Vec3d& whole, int depth) {
        Vec3d parts[4], sum(0.0);
        for (int i = 0; i < 4; ++i) {
            parts[i] = gauss(corner * 2.0 + Vec2d(i / 2, i % 2), side / 2);
            sum += parts[i];
        }
        const Vec3d change = sum - whole;
        const double largest =
            std::max(std::abs(change.x), std::max(std::abs(change.y), std::abs(change.z)));
        if (largest <= tolerance_ || depth == 0) {
            uncertainty_ += largest;
            return sum;
        }
        sum = Vec3d(0.0);
        for (int i = 0; i < 4; ++i)
            sum += refined(corner * 2.0 + Vec2d(i / 2, i % 2), side / 2, parts[i], depth - 1);
        return sum;
    }

    /// Cell `corner`, counted in cells of this side.
    Vec3d gauss(const Vec2d& corner, double side) const {
        const double offsets[3] = {0.5 - std::sqrt(0.15), 0.5, 0.5 + std::sqrt(0.15)};
        const double weights[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
        Vec3d sum(0.0);
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                sum += integrand_((corner.x + offsets[i]) * side, (corner.y + offsets[j]) * side) *
                       (weights[i] * weights[j]);
            }
        }
        return sum * (side * side);
    }

    Integrand integrand_;
    double tolerance_ = 0, uncertainty_ = 0;
};

template <class Integrand>
Irradiance integrate(Integrand integrand) {
    return AdaptiveQuadrature<Integrand>(std::move(integrand)).integrate();
}

/// World-space area of the shape, or what `normalize` divides a distant light by.
double size_of(const LuxLight& light) {
    if (light.kind == Kind::Distant) {
        const double t = light.angle_deg / 2 * pi_d / 180, s = std::sin(t);
        if (t == 0) return 1;
        return t <= pi_d / 2 ? pi_d * s * s : pi_d * (2 - s * s);
    }
    return integrate([&light](double s, double t) {
               return Vec3d(length_of(patch_at(light, s, t).area));
           })
        .value.x;
}

Vec3d radiance_of(const LuxLight& light) {
    Vec3d radiance = light.emission;
    if (light.kelvin) radiance *= usd_blackbody(*light.kelvin).value();
    return light.is_normalized ? radiance / size_of(light) : radiance;
}

Irradiance by_quadrature(const LuxLight& light, const Vec3d& p, const Vec3d& n, FocusAbout about) {
    const Vec3d axis = axis_of(light), radiance = radiance_of(light);
    return integrate([&](double s, double t) {
        const SurfacePatch patch = patch_at(light, s, t);
        const Vec3d v = p - patch.position;
        const double r = length_of(v), facing = patch.area.dot(v) / r, cosine = -n.dot(v) / r;
        if (facing <= 0 || cosine <= 0) return Vec3d(0.0);
        const double focus_cosine =
            about == FocusAbout::LightAxis ? axis.dot(v) / r : facing / length_of(patch.area);
        return radiance * shaping(light, axis, v / r, focus_cosine) * (facing * cosine / (r * r));
    });
}

}  // namespace

bool is_shaped(const LuxLight& light) {
    const double inner = light.cone_angle_deg * (1 - std::clamp(light.cone_softness, 0.0, 1.0));
    return light.ies || inner < 180 || (light.focus > 0 && light.focus_tint != Vec3d(1.0));
}

std::optional<Vec3d> usd_blackbody(double kelvin) {
    // Returned by UsdLuxBlackbodyTemperatureAsRgb of OpenUSD 24.08; 11000 is clamped to 10000 there
    if (kelvin == 2000) return Vec3d(2.5205663, 0.6468882, 0.0204040);
    if (kelvin == 4250) return Vec3d(1.3536833, 0.9358438, 0.5940642);
    if (kelvin == 6500) return Vec3d(1.0433334, 0.9836245, 1.0346132);
    if (kelvin == 8750) return Vec3d(0.9138679, 0.9935212, 1.3178025);
    if (kelvin == 11000) return Vec3d(0.8718413, 0.9946880, 1.4299959);
    return std::nullopt;
}

Irradiance irradiance(const LuxLight& light, const Vec3d& p, const Vec3d& n, FocusAbout about) {
    if (light.kind != Kind::Distant && is_shaped(light)) return by_quadrature(light, p, n, about);
    return {radiance_of(light) * unshaped_irradiance(light, p, n), 0};
}

Irradiance irradiance_by_quadrature(const LuxLight& light, const Vec3d& p, const Vec3d& n) {
    LuxLight plain = light;
    plain.cone_angle_deg = 180;
    plain.focus = plain.cone_softness = 0;
    plain.ies = nullptr;
    return by_quadrature(plain, p, n, FocusAbout::LightAxis);
}

Vec3d latlong_direction(const LuxImage& image, int x, int y) {
    const double latitude = pi_d * (0.5 - (y + 0.5) / image.height);
    const double longitude = pi_d * (1 - 2 * (x + 0.5) / image.width);
    return {std::cos(latitude) * std::sin(longitude), std::sin(latitude),
            std::cos(latitude) * std::cos(longitude)};
}

Vec3d dome_irradiance(const LuxImage& image, const Vec3d& n) {
    Vec3d sum(0.0);
    for (int y = 0; y < image.height; ++y) {
        // Exact solid angle of a texel of this row
        const double above = std::cos(pi_d * y / image.height);
        const double below = std::cos(pi_d * (y + 1) / image.height);
        Vec3d row(0.0);
        for (int x = 0; x < image.width; ++x)
            row += image.at(x, y) * std::max(0.0, latlong_direction(image, x, y).dot(n));
        sum += row * ((above - below) * 2 * pi_d / image.width);
    }
    return sum;
}

Vec3d rect_texel(const LuxImage& image, double width, double height, int x, int y) {
    return {width * (0.5 - (x + 0.5) / image.width), height * (0.5 - (y + 0.5) / image.height), 0};
}

Vec3d rect_irradiance(const LuxLight& light,
                      const LuxImage& image,
                      const Vec3d& p,
                      const Vec3d& n) {
    const Mat4d& m = light.world_from_light;
    Vec3d area = transform_direction(Vec3d(light.width, 0, 0), m)
                     .cross(transform_direction(Vec3d(0, light.height, 0), m)) /
                 (double(image.width) * image.height);
    if (area.dot(transform_direction(Vec3d(0, 0, -1), m)) < 0) area = -area;
    Vec3d sum(0.0);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const Vec3d v =
                p - transform_point(rect_texel(image, light.width, light.height, x, y), m);
            const double r2 = v.dot(v);
            sum += image.at(x, y) *
                   (std::max(0.0, area.dot(v)) * std::max(0.0, -n.dot(v)) / (r2 * r2));
        }
    }
    return sum * radiance_of(light);
}

}  // namespace velatura::test
