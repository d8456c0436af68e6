// SPDX-License-Identifier: Apache-2.0
#include "translate/lights/lights.h"

#include "translate/color/color_space.h"
#include "translate/context/instance_source.h"
#include "translate/context/values.h"
#include "translate/lights/light_area.h"
#include "translate/lights/light_filters.h"
#include "translate/lights/light_groups.h"
#include "translate/lights/light_inputs.h"
#include "translate/lights/mesh_lights.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::translate::lights {

namespace {

using scene::LightKind;

std::optional<LightKind> light_kind(std::string_view type) {
    if (type == "DistantLight") return LightKind::Distant;
    if (type == "DomeLight" || type == "DomeLight_1") return LightKind::Dome;
    if (type == "RectLight") return LightKind::Rect;
    if (type == "DiskLight") return LightKind::Disk;
    if (type == "SphereLight") return LightKind::Sphere;
    if (type == "CylinderLight") return LightKind::Cylinder;
    return std::nullopt;
}

/// World-space size that `normalize` divides by; 0 = the shape has no area.
double world_size(const scene::Light& light, const Vec3d& sizes, const Mat4d& m) {
    switch (light.kind) {
        case LightKind::Rect:
            return rect_area(sizes.x, sizes.y, m);
        case LightKind::Disk:
            return disk_area(sizes.x, m);
        case LightKind::Sphere:
            return sphere_area(sizes.x, m);
        case LightKind::Cylinder:
            return cylinder_area(sizes.x, sizes.y, m);
        case LightKind::Distant:
            return distant_divisor(sizes.x);
        case LightKind::Dome:
            return 1.0;
    }
    return 1.0;
}

/// Sizes in light space, in double, also stored in the light: (width, height), (radius, length) or
/// (angle).
Vec3d read_sizes(Context& ctx, Prim prim, scene::Light& light) {
    Vec3d sizes(0.0);
    switch (light.kind) {
        case LightKind::Rect:
            sizes = {input_number(ctx, prim, "width", 1.0), input_number(ctx, prim, "height", 1.0),
                     0};
            light.width = float(sizes.x);
            light.height = float(sizes.y);
            break;
        case LightKind::Cylinder:
            sizes = {input_number(ctx, prim, "radius", 0.5), input_number(ctx, prim, "length", 1.0),
                     0};
            light.radius = float(sizes.x);
            light.length = float(sizes.y);
            break;
        case LightKind::Disk:
        case LightKind::Sphere:
            sizes.x = input_number(ctx, prim, "radius", 0.5);
            light.radius = float(sizes.x);
            break;
        case LightKind::Distant:
            sizes.x = input_number(ctx, prim, "angle", 0.53);
            light.angle_deg = float(sizes.x);
            break;
        case LightKind::Dome:
            break;
    }
    return sizes;
}

/// Whether the light is a point or line: of radius 0, and authored as one. Exporters write that for
/// the point lights of their programs, normalized or not, and renderers give it a power.
bool is_point_or_line(Context& ctx, Prim prim, const scene::Light& light, const Vec3d& sizes) {
    const bool is_line = light.kind == LightKind::Cylinder;
    if ((light.kind != LightKind::Sphere && !is_line) || sizes.x != 0.0) return false;
    return read_bool(prim.attribute(is_line ? "treatAsLine" : "treatAsPoint"), false, ctx.time);
}

/// A point light (radius 0) that is normalized has a power without a size: gives it 1/1024 of its
/// distance from the camera, a size that follows the scene's scale.
bool give_extent(Context& ctx, Prim prim, scene::Light& light, Vec3d& sizes) {
    const Mat4d& m = light.render_from_light;
    const double distance = Vec3d(m[3][0], m[3][1], m[3][2]).length();
    const bool is_round = light.kind == LightKind::Sphere || light.kind == LightKind::Disk ||
                          light.kind == LightKind::Cylinder;
    const double scale =
        std::sqrt(std::max(m[0][0] * m[0][0] + m[0][1] * m[0][1] + m[0][2] * m[0][2],
                           m[1][0] * m[1][0] + m[1][1] * m[1][1] + m[1][2] * m[1][2]));
    if (!is_round || sizes.x != 0.0 || !(distance > 0.0) || !(scale > 0.0)) return false;
    sizes.x = distance / 1024 / scale;
    light.radius = float(sizes.x);
    ctx.warn(
        "light-without-size", light_input(ctx, prim, "radius"),
        fmt::format("radius 0: the light is normalized, with a radius of {:.6g} (1/1024 of the "
                    "distance from the camera)",
                    sizes.x));
    return true;
}

/// Rotation that puts a Y pole on Z, longitude 0 from +Z to −Y. Ref: UsdLuxDomeLight_1
/// poleAxis.
Mat4d z_pole() {
    return Mat4d(1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1);
}

/// Portals stand in the namespace, wherever an instance has put their dome: they only guide.
void read_portals(Context& ctx, Prim prim, scene::Light& light) {
    for (const auto& path : prim.relationship("portals").forwarded_targets()) {
        const Prim portal = ctx.stage.prim_at(path);
        if (!portal || portal.type_name().str() != "PortalLight") {
            ctx.warn(
                "bad-portal", prim,
                fmt::format("portal <{}> is not a PortalLight; it is skipped", path.to_string()));
            continue;
        }
        const Vec3d size(input_number(ctx, portal, "width", 1.0),
                         input_number(ctx, portal, "height", 1.0), 1.0);
        const Mat4d world = usd::stage::world_transform(portal, ctx.time);
        light.render_from_portals.push_back(Mat4d().setScale(size) *
                                            relative_to(world, ctx.origin));
    }
}

/// UsdLux has no sourceColorSpace: the space is that of the file's attribute, else auto.
void read_light_texture(Context& ctx, Prim prim, const Attribute& file, scene::Light& light) {
    light.texture_file = file.resolved_asset_path(ctx.time);
    light.texture_colors =
        color::texel_colors_of(ctx, {prim.attribute("inputs:texture:file"), file},
                               color::Meaning::Color)
            .value_or(
                color::unmarked_texels(ctx, scene::SourceColorSpace::Auto, color::Meaning::Color));
}

void read_dome(Context& ctx, Prim prim, scene::Light& light) {
    const std::string format =
        read_text(light_input(ctx, prim, "texture:format"), "automatic", ctx.time);
    if (format == "latlong") {
        light.dome_format = scene::DomeFormat::LatLong;
    } else if (format == "mirroredBall") {
        light.dome_format = scene::DomeFormat::MirrorBall;
    } else if (format == "angular") {
        light.dome_format = scene::DomeFormat::Angular;
    } else if (format == "cubeMapVerticalCross") {
        light.dome_format = scene::DomeFormat::CubeMapVerticalCross;
    } else if (format != "automatic") {
        ctx.warn("unsupported-light-input", light_input(ctx, prim, "texture:format"),
                 fmt::format("texture format {} is unknown, automatic is used", format));
    }
    if (prim.type_name() == "DomeLight_1") {
        const std::string pole = read_text(prim.attribute("poleAxis"), "scene", ctx.time);
        if (pole == "Z" || (pole == "scene" && ctx.stage.up_axis() == "Z")) {
            light.render_from_light = z_pole() * light.render_from_light;
            for (Mat4d& key : light.later_render_from_light) key = z_pole() * key;
        }
    }
    read_portals(ctx, prim, light);
}

Vec3d world_position(const Mat4d& m) {
    return {m[3][0], m[3][1], m[3][2]};
}

/// Of what is at infinity only turns count; without any it stays.
void keep_turns(const Mat4d& first, std::vector<Mat4d>& later) {
    for (Mat4d& key : later)
        for (int k = 0; k < 3; ++k) key[3][k] = first[3][k];
    if (std::all_of(later.begin(), later.end(), [&](const Mat4d& m) { return m == first; }))
        later.clear();
}

}  // namespace

bool is_light_type(std::string_view type) {
    return light_kind(type).has_value();
}

bool has_place(std::string_view type) {
    const std::optional<LightKind> kind = light_kind(type);
    return kind && *kind != LightKind::Dome && *kind != LightKind::Distant;
}

double reach_of_light(Context& ctx, Prim prim) {
    scene::Light light;
    light.kind = light_kind(prim.type_name().view()).value_or(LightKind::Dome);
    const Vec3d sizes = read_sizes(ctx, prim, light);
    return light.kind == LightKind::Cylinder ? std::hypot(sizes.x, 0.5 * sizes.y)
           : light.kind == LightKind::Rect   ? 0.5 * std::hypot(sizes.x, sizes.y)
                                             : std::abs(sizes.x);
}

bool is_any_light(Prim prim) {
    const std::string_view type = prim.type_name().view();
    return is_light_type(type) || type == "GeometryLight" || type == "PortalLight" ||
           type == "PluginLight" || is_geometry_light(prim) || prim.has_api("VolumeLightAPI");
}

bool read_light(Context& ctx,
                const LightSite& site,
                const Mat4d& render_from_light,
                std::vector<Mat4d> later,
                uint32_t place) {
    const Prim prim = site.prim;
    const auto kind = light_kind(prim.type_name().view());
    if (!kind) return false;
    scene::Light light;
    light.kind = *kind;
    light.name = prim.path_string();
    light.render_from_light = render_from_light;
    if (!has_place(prim.type_name().view())) keep_turns(render_from_light, later);
    light.later_render_from_light = std::move(later);
    const bool is_area = light.kind != LightKind::Dome && light.kind != LightKind::Distant;
    if (!is_finite(render_from_light) || !keeps_a_surface(render_from_light) ||
        !is_finite(to_float(world_position(render_from_light)))) {
        ctx.warn("bad-transform", prim, "transform is singular or infinite; the light is skipped");
        return false;
    }
    Vec3d sizes = read_sizes(ctx, prim, light);
    Vec3d Le = read_radiance(ctx, prim, default_intensity(prim.type_name().view()));
    const bool is_normalized = read_bool(light_input(ctx, prim, "normalize"), false, ctx.time) ||
                               is_point_or_line(ctx, prim, light, sizes);
    double size = world_size(light, sizes, render_from_light);
    if (is_area && !(size > 0.0) && is_normalized && give_extent(ctx, prim, light, sizes))
        size = world_size(light, sizes, render_from_light);
    if (is_area && !(size > 0.0)) {
        ctx.warn("light-without-size", prim, "light has no area and emits nothing; it is skipped");
        return false;
    }
    if (is_normalized && light.kind != LightKind::Dome) Le /= size;
    // The divisor 1 of a distant light without extent stands for irradiance, normalized or not
    if (!is_good_radiance(ctx, prim, Le)) return false;
    light.Le = Rgb(float(Le.x), float(Le.y), float(Le.z));
    light.shaping = read_shaping(ctx, prim);
    if ((light.shaping.is_active || light.shaping.ies) && !is_area) {
        ctx.warn("unsupported-light-input", prim,
                 "shaping of a dome or distant light is not supported; it is ignored");
        light.shaping = scene::Shaping();
    }
    if (light.kind == LightKind::Dome) read_dome(ctx, prim, light);
    const Attribute texture = light_input(ctx, prim, "texture:file");
    if (!read_text(texture, "", ctx.time).empty()) {
        if (light.kind == LightKind::Rect || light.kind == LightKind::Dome)
            read_light_texture(ctx, prim, texture, light);
        else
            ctx.warn("unsupported-light-input", texture,
                     "only rect and dome lights can have a texture; it is ignored");
    }
    light.diffuse_multiplier = float(input_number(ctx, prim, "diffuse", 1.0));
    light.specular_multiplier = float(input_number(ctx, prim, "specular", 1.0));
    if (light.diffuse_multiplier == 1.0f && light.specular_multiplier == 1.0f &&
        (light_input(ctx, prim, "diffuse").has_authored_value() ||
         light_input(ctx, prim, "specular").has_authored_value()))
        ctx.note_zero(scene::Effect::LobeMultipliers, prim, "inputs:diffuse and inputs:specular 1");
    light.filters = read_filters(ctx, {prim, render_from_light, light.shaping.cone_angle_deg});
    light.links = read_shadow(ctx, prim);
    warn_light_features(ctx, prim);
    light.group = join_light_group(ctx, prim);
    light.provenance = ctx.provenance(prim);
    ctx.scene.lights.push_back(std::move(light));
    ctx.state<CollectedLights>().placed.push_back({prim, place});
    return true;
}

}  // namespace velatura::translate::lights
