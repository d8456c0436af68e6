// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "lux_ies.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace velatura::test {

/// What a UsdLux light says, read from its attributes alone; nothing of the renderer is in here.
/// Space: world of the stage. Quantities and formulas: schema documentation of UsdLux with OpenUSD
/// proposal "Clarification of UsdLux Quantities and Behavior".
struct LuxLight {
    enum class Kind { Rect, Disk, Sphere, Cylinder, Distant };
    Kind kind = Kind::Sphere;
    Mat4d world_from_light;
    double width = 1, height = 1, radius = 0.5, length = 1, angle_deg = 0.53;
    /// intensity × 2^exposure × color × diffuse, before color temperature and `normalize`
    Vec3d emission = Vec3d(1.0);
    std::optional<double> kelvin;  ///< where the color temperature is enabled
    bool is_normalized = false;
    double cone_angle_deg = 180, cone_softness = 0, focus = 0;
    Vec3d focus_tint = Vec3d(0.0);
    std::shared_ptr<const LuxIes> ies;
    double ies_angle_scale = 0, ies_divisor = 1;
};

/// What the focus of a light turns around. The schema's text says the surface normal, OpenUSD's
/// reference code (hdEmbree) the light's −Z.
enum class FocusAbout { SurfaceNormal, LightAxis };

struct Irradiance {
    Vec3d value = Vec3d(0.0);
    /// Bound of the error of `value`: 0 for closed forms, else the sum of the last changes of the
    /// adaptive quadrature.
    double uncertainty = 0;
};

/// Irradiance of the light at a point with a unit normal, nothing in between. Without shaping the
/// exact form of a polygon (Lambert 1760; outlines of round shapes as polygons of 4096 corners,
/// relative error 1e-6), with shaping adaptive quadrature over the
/// surface in double precision.
Irradiance irradiance(const LuxLight& light, const Vec3d& p, const Vec3d& n, FocusAbout about);

/// The same without shaping, by quadrature over the surface: to check the exact forms. Not for
/// distant lights.
Irradiance irradiance_by_quadrature(const LuxLight& light, const Vec3d& p, const Vec3d& n);

/// Whether cone and focus leave the emission as it is.
bool is_shaped(const LuxLight& light);

/// UsdLuxBlackbodyTemperatureAsRgb of the temperatures that luxtest has; nullopt for others.
std::optional<Vec3d> usd_blackbody(double kelvin);

/// A decoded image: [height][width], row 0 = top.
struct LuxImage {
    int width = 0, height = 0;
    std::vector<Vec3d> texels;

    const Vec3d& at(int x, int y) const { return texels[size_t(y) * size_t(width) + size_t(x)]; }
};

/// Direction of the middle of a texel of a latlong dome whose own space is the world: pixel (0, 0)
/// at latitude +90°, longitude +180°; longitude 0° = +Z, 90° = +X.
Vec3d latlong_direction(const LuxImage& image, int x, int y);

/// Irradiance of such a dome of radiance 1 × image, texel by texel.
Vec3d dome_irradiance(const LuxImage& image, const Vec3d& n);

/// Middle of a texel on a RectLight, light space: upright and not mirrored when seen from the lit
/// side, image's left at +X.
Vec3d rect_texel(const LuxImage& image, double width, double height, int x, int y);

/// Irradiance of a textured RectLight without shaping, texel by texel.
Vec3d rect_irradiance(const LuxLight& light, const LuxImage& image, const Vec3d& p, const Vec3d& n);

}  // namespace velatura::test
