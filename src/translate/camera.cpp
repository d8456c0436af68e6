// SPDX-License-Identifier: Apache-2.0
#include "translate/camera.h"

#include "translate/context/instance_source.h"
#include "translate/context/values.h"
#include "translate/geometry/mesh_motion.h"
#include "translate/motion/shutter.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::translate {

namespace {

struct Aperture {
    double width = 20.955, height = 15.2908;  ///< tenths of scene units
};

/// That shows the whole aperture, at most the largest of an image.
int height_of(const scene::RenderSettings& settings, const Aperture& authored) {
    constexpr double largest = 65536;
    return int(std::lround(
        std::clamp(settings.width * settings.pixel_aspect_ratio * authored.height / authored.width,
                   1.0, largest)));
}

/// Fits the aperture to the image, or for adjustPixelAspectRatio the pixels to the aperture.
/// Ref: UsdRenderSettingsBase aspectRatioConformPolicy.
Aperture conform(Context& ctx, const Aperture& authored) {
    scene::RenderSettings& settings = ctx.scene.settings;
    if (settings.height == 0) settings.height = height_of(settings, authored);
    const double image = settings.pixel_aspect_ratio * settings.width / settings.height;
    const bool is_wider = authored.width > authored.height * image;
    const Aperture by_height{authored.height * image, authored.height};
    const Aperture by_width{authored.width, authored.width / image};
    const std::string& policy = settings.aspect_conform;
    if (policy == "cropAperture") return is_wider ? by_height : by_width;
    if (policy == "adjustApertureWidth") return by_height;
    if (policy == "adjustApertureHeight") return by_width;
    if (policy == "adjustPixelAspectRatio") {
        settings.pixel_aspect_ratio =
            authored.width / authored.height * settings.height / settings.width;
        return authored;
    }
    if (policy != "expandAperture") {
        ctx.diagnostics.warn("unknown-conform-policy", {}, settings.name,
                             fmt::format("aspectRatioConformPolicy {} is unknown, expandAperture "
                                         "is used",
                                         policy));
    }
    return is_wider ? by_width : by_height;
}

/// Number of the camera, the fallback with a warning when it is not positive.
double positive(Context& ctx, Prim prim, std::string_view name, double fallback) {
    const Attribute attribute = prim.attribute(name);
    const double v = read_number(attribute, fallback, ctx.time);
    if (v > 0.0 && std::isfinite(v)) return v;
    ctx.warn("bad-camera-value", attribute, fmt::format("{} is {}, {} is used", name, v, fallback));
    return fallback;
}

/// Number of the camera, the fallback with a warning when it is not finite.
double finite(Context& ctx, Prim prim, std::string_view name, double fallback) {
    const Attribute attribute = prim.attribute(name);
    const double v = read_number(attribute, fallback, ctx.time);
    if (std::isfinite(v)) return v;
    ctx.warn("bad-camera-value", attribute, fmt::format("{} is {}, {} is used", name, v, fallback));
    return fallback;
}

constexpr int max_blades = 1024;

/// The opening between the blades: velatura:lens:blades, rotation, roundness.
void read_blades(Context& ctx, Prim prim, scene::Camera& camera) {
    const Attribute attribute = prim.attribute("velatura:lens:blades");
    const double blades = read_number(attribute, 0.0, ctx.time);
    if (blades == 0.0) return;
    if (!(blades >= 3.0 && blades <= max_blades && blades == std::floor(blades))) {
        ctx.warn("bad-camera-value", attribute,
                 fmt::format("velatura:lens:blades is {}, expected 0 or 3 to {}; the lens is round",
                             blades, max_blades));
        return;
    }
    camera.lens_blades = int(blades);
    camera.lens_rotation_deg = finite(ctx, prim, "velatura:lens:rotation", 0.0);
    const double roundness = finite(ctx, prim, "velatura:lens:roundness", 0.0);
    camera.lens_roundness = std::clamp(roundness, 0.0, 1.0);
    if (camera.lens_roundness != roundness)
        ctx.warn("bad-camera-value", prim.attribute("velatura:lens:roundness"),
                 fmt::format("velatura:lens:roundness is {}, {} is used", roundness,
                             camera.lens_roundness));
}

void read_lens(Context& ctx, Prim prim, double focal_length, scene::Camera& camera) {
    const double f_stop = finite(ctx, prim, "fStop", 0.0);
    const double focus = finite(ctx, prim, "focusDistance", 0.0);
    const bool is_disabled = ctx.scene.settings.disable_depth_of_field;
    if (!(f_stop > 0.0) || is_disabled) {
        if (prim.attribute("fStop").has_authored_value())
            ctx.note_zero(scene::Effect::DepthOfField, prim,
                          is_disabled ? "disableDepthOfField" : "fStop 0");
        return;
    }
    if (!(focus > 0.0)) {
        ctx.note_zero(scene::Effect::DepthOfField, prim, "no focusDistance");
        ctx.warn("no-focus-distance", prim.attribute("fStop"),
                 "fStop without a positive focusDistance, everything is in focus");
        return;
    }
    // Focal length is in tenths of scene units, the lens in scene units
    camera.lens_radius = 0.1 * focal_length / (2 * f_stop);
    camera.focus_distance = focus;
    read_blades(ctx, prim, camera);
}

/// Most segments of a camera's motion: there is but one camera, and its curve is the whole
/// image's.
constexpr size_t max_camera_segments = 64;

/// Of a shutter's time: authored samples between would be missed with fewer.
constexpr size_t fewest_camera_segments = 4;

/// How far the view may turn [rad] from where straight lines between keys lead, and its place stray
/// in parts of the way: a hundredth of a pixel of most images.
constexpr double view_straying = 1e-5;

/// Whether the camera at `m` looks from where it does at `straight`, in the directions of its axes.
bool is_alike(const Mat4d& m, const Mat4d& straight, double way) {
    for (int i = 0; i < 3; ++i) {
        const Vec3d a(m[i][0], m[i][1], m[i][2]), b(straight[i][0], straight[i][1], straight[i][2]);
        if (!(a.normalized().cross(b.normalized()).length() <= view_straying)) return false;
    }
    const Vec3d off(m[3][0] - straight[3][0], m[3][1] - straight[3][1], m[3][2] - straight[3][2]);
    return off.length() <= view_straying * way;
}

/// Length of the way through all keys.
double way_through(const std::vector<Mat4d>& keys) {
    double way = 0;
    for (size_t k = 1; k < keys.size(); ++k)
        way += Vec3d(keys[k][3][0] - keys[k - 1][3][0], keys[k][3][1] - keys[k - 1][3][1],
                     keys[k][3][2] - keys[k - 1][3][2])
                   .length();
    return way;
}

/// Gives the camera the keys of its motion, so many that it goes straight between.
void read_motion(Context& ctx, Prim prim, const Shutter& shutter, scene::Camera& camera) {
    const auto matrix_at = [&](double way) {
        const double time = shutter.open + way * (shutter.close - shutter.open);
        return relative_to(usd::stage::world_transform(prim, time), camera.world_position);
    };
    std::vector<Mat4d> keys;
    for (size_t segments = fewest_camera_segments; segments <= max_camera_segments; segments *= 2) {
        const double step = 1.0 / double(segments);
        keys.clear();
        for (size_t k = 0; k <= segments; ++k) keys.push_back(matrix_at(double(k) * step));
        const double way = way_through(keys);
        bool is_straight = true;
        for (size_t k = 0; k < segments && is_straight; ++k) {
            for (const double f : {0.25, 0.5, 0.75})
                is_straight = is_straight && is_alike(matrix_at((double(k) + f) * step),
                                                      keys[k] * (1 - f) + keys[k + 1] * f, way);
        }
        if (is_straight) break;
    }
    const auto is_usable = [](const Mat4d& m) { return is_finite(m) && determinant3(m) != 0.0; };
    if (!std::all_of(keys.begin(), keys.end(), is_usable)) {
        ctx.warn("bad-transform", prim,
                 "the camera's transform is singular or infinite while the shutter is open; the "
                 "camera is not blurred, and its transform at the frame time is used");
        return;
    }
    const auto stays = [&](const Mat4d& m) { return m == keys[0]; };
    if (std::all_of(keys.begin(), keys.end(), stays)) return;
    camera.motion_keys = std::move(keys);
}

/// How the shutter opens and closes: velatura:shutter:curve.
void read_shutter_curve(Context& ctx, Prim prim, scene::Camera& camera) {
    const Attribute attribute = prim.attribute("velatura:shutter:curve");
    if (!attribute.has_authored_value()) return;
    const auto curve = read_vector(attribute, 2, ctx.time);
    if (!curve || !((*curve)[0] >= 0.0 && (*curve)[0] <= (*curve)[1] && (*curve)[1] <= 1.0)) {
        ctx.warn("bad-camera-value", attribute,
                 "velatura:shutter:curve is not two ascending numbers from 0 to 1; the shutter "
                 "opens and closes at once");
        return;
    }
    camera.shutter_full = (*curve)[0];
    camera.shutter_falling = (*curve)[1];
}

/// At the default time nothing moves: there the shutter is of no consequence.
void read_shutter(Context& ctx, Prim prim, scene::Camera& camera) {
    const double open = finite(ctx, prim, "shutter:open", 0.0);
    const double close = finite(ctx, prim, "shutter:close", 0.0);
    if (close < open)
        ctx.warn(
            "bad-camera-value", prim.attribute("shutter:close"),
            fmt::format(
                "the shutter closes at {}, before it opens at {}; the shutter is treated as closed",
                close, open));
    if (!(close > open) || ctx.time.is_default() || ctx.scene.settings.disable_motion_blur) {
        const bool is_authored = prim.attribute("shutter:open").has_authored_value() ||
                                 prim.attribute("shutter:close").has_authored_value();
        const char* const why = !(close > open)         ? "the shutter is closed"
                                : ctx.time.is_default() ? "no motion at the default time"
                                                        : "motion blur is disabled";
        for (const scene::Effect blur : {scene::Effect::CameraBlur, scene::Effect::TransformBlur,
                                         scene::Effect::DeformationBlur})
            if (is_authored) ctx.note_zero(blur, prim, why);
        return;
    }
    ctx.shutter = Shutter{ctx.time.value() + open, ctx.time.value() + close};
    read_shutter_curve(ctx, prim, camera);
    if (const auto seen = motion::shutter_of(ctx, prim)) read_motion(ctx, prim, *seen, camera);
}

/// Tenths of a scene unit that lens and film are measured in. Ref: UsdGeomCamera, units (OpenUSD's
/// development branch of 2026).
double tenths_per_unit(Context& ctx, Prim prim) {
    const bool is_metric = read_text(prim.attribute("units"), "", ctx.time) == "millimeters";
    return is_metric ? 0.001 / ctx.stage.meters_per_unit() * 10 : 1.0;
}

/// What radiance is multiplied by. Ref: UsdGeomCamera "Camera Exposure Model" (OpenUSD 25.05),
/// ComputeLinearExposureScale.
double read_exposure(Context& ctx, Prim prim) {
    const double time = positive(ctx, prim, "exposure:time", 1.0);
    const double iso = positive(ctx, prim, "exposure:iso", 100.0);
    const double f_stop = positive(ctx, prim, "exposure:fStop", 1.0);
    const double responsivity = positive(ctx, prim, "exposure:responsivity", 1.0);
    return responsivity * time * (iso / 100.0) * std::exp2(finite(ctx, prim, "exposure", 0.0)) /
           (f_stop * f_stop);
}

void warn_camera_features(Context& ctx, Prim prim) {
    if (prim.attribute("clippingPlanes").value(ctx.time).array_size() > 0) {
        ctx.warn("unsupported-clipping-planes", prim.attribute("clippingPlanes"),
                 "clippingPlanes are not supported; nothing is clipped");
    }
}

}  // namespace

Result<scene::Camera> read_camera(Context& ctx, Prim prim) {
    scene::Camera camera;
    camera.name = prim.path_string();
    camera.provenance = ctx.provenance(prim);
    const Mat4d world = usd::stage::world_transform(prim, ctx.time);
    if (!is_finite(world) || determinant3(world) == 0.0) {
        return Error{"bad-camera",
                     fmt::format("camera <{}> has a singular or infinite transform", camera.name)};
    }
    camera.world_position = {world[3][0], world[3][1], world[3][2]};
    camera.render_from_camera = relative_to(world, camera.world_position);

    const std::string projection = read_text(prim.attribute("projection"), "perspective", ctx.time);
    const bool is_ortho = projection == "orthographic";
    if (is_ortho) camera.projection = scene::Camera::Projection::Orthographic;
    const double tenths = tenths_per_unit(ctx, prim);
    const Aperture aperture =
        conform(ctx, {tenths * positive(ctx, prim, "horizontalAperture", 20.955),
                      tenths * positive(ctx, prim, "verticalAperture", 15.2908)});
    const double offset_x = tenths * finite(ctx, prim, "horizontalApertureOffset", 0.0);
    const double offset_y = tenths * finite(ctx, prim, "verticalApertureOffset", 0.0);
    const double focal = tenths * positive(ctx, prim, "focalLength", 50.0);
    // Tenths of scene units cancel in a perspective window
    const double unit = is_ortho ? 0.1 : 1.0 / focal;
    camera.window_left = (offset_x - aperture.width / 2) * unit;
    camera.window_right = (offset_x + aperture.width / 2) * unit;
    camera.window_bottom = (offset_y - aperture.height / 2) * unit;
    camera.window_top = (offset_y + aperture.height / 2) * unit;
    const auto is_window = [](double low, double high) {
        return high > low && std::isfinite(high - low);
    };
    if (!is_window(camera.window_left, camera.window_right) ||
        !is_window(camera.window_bottom, camera.window_top)) {
        return Error{"bad-camera",
                     fmt::format("camera <{}> sees nothing: aperture {} x {}, focal "
                                 "length {}",
                                 camera.name, aperture.width, aperture.height, focal)};
    }
    read_lens(ctx, prim, focal, camera);
    read_shutter(ctx, prim, camera);

    if (const auto range = read_vector(prim.attribute("clippingRange"), 2, ctx.time)) {
        camera.clip_near = (*range)[0];
        camera.clip_far = (*range)[1];
    } else {
        camera.clip_near = 1.0;
        camera.clip_far = 1e6;
    }
    if (!(camera.clip_far > camera.clip_near)) {
        ctx.warn("bad-camera-value", prim.attribute("clippingRange"),
                 fmt::format("clippingRange ({}, {}) is empty, nothing is clipped",
                             camera.clip_near, camera.clip_far));
        camera.clip_near = camera.clip_far = 0.0;
    }
    camera.exposure_scale = read_exposure(ctx, prim);
    warn_camera_features(ctx, prim);
    return camera;
}

scene::Camera framing_camera(Context& ctx, const Box3d& world_bounds) {
    scene::Camera camera;
    const Aperture aperture = conform(ctx, {});
    camera.window_right = aperture.width / 2 / 50.0;
    camera.window_top = aperture.height / 2 / 50.0;
    camera.window_left = -camera.window_right;
    camera.window_bottom = -camera.window_top;
    const bool is_empty = world_bounds.isEmpty();
    const Vec3d center = is_empty ? Vec3d(0.0) : (world_bounds.min + world_bounds.max) / 2;
    double radius = is_empty ? 1.0 : (world_bounds.max - world_bounds.min).length() / 2;
    if (!(radius > 0.0)) radius = 1.0;
    // Far enough for the sphere around the box to touch the narrower side of the image
    const double half_window = std::min(camera.window_right, camera.window_top);
    const double distance = radius * std::sqrt(1 + half_window * half_window) / half_window;
    const bool is_z_up = ctx.stage.up_axis() == "Z";
    const Vec3d up = is_z_up ? Vec3d(0, 0, 1) : Vec3d(0, 1, 0);
    const Vec3d back = (is_z_up ? Vec3d(0.5, -1, 0.4) : Vec3d(0.5, 0.4, 1)).normalized();
    const Vec3d right = up.cross(back).normalized();
    const Vec3d above = back.cross(right);
    const Vec3d rows[3] = {right, above, back};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) camera.render_from_camera[i][j] = rows[i][j];
    camera.world_position = center + back * distance;
    return camera;
}

}  // namespace velatura::translate
