// SPDX-License-Identifier: Apache-2.0
#include "translate/lights/light_inputs.h"

#include "base/asset_bytes.h"
#include "translate/color/color_space.h"
#include "translate/context/values.h"
#include "translate/lights/ies_file.h"
#include "translate/lights/lights.h"
#include "translate/materials/shader_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace velatura::translate::lights {

namespace {

/// State of this module: IES profiles that were read, null where that failed.
struct KnownProfiles {
    std::unordered_map<std::string, std::shared_ptr<const scene::IesProfile>> by_file;
};

/// Null: there is none. Lights that name the same file share it.
std::shared_ptr<const scene::IesProfile> read_ies(Context& ctx, const Attribute& file) {
    const std::string authored = read_text(file, "", ctx.time);
    if (authored.empty()) return nullptr;
    const std::string name = file.resolved_asset_path(ctx.time);
    auto& profiles = ctx.state<KnownProfiles>().by_file;
    if (const auto known = profiles.find(name); known != profiles.end()) return known->second;
    const auto fail = [&](const Error& error) {
        ctx.diagnostics.error(
            "ies-unreadable", file.loc(), file.prim().path_string(),
            fmt::format("IES profile \"{}\": {}; the light is rendered without it", authored,
                        error.message));
        return profiles[name] = nullptr;
    };
    if (name.empty()) return fail({"file-not-found", "file not found"});
    const Result<AssetBytesPtr> bytes = open_asset_bytes(name);
    if (!bytes) return fail(bytes.error());
    Result<scene::IesProfile> profile = parse_ies((*bytes)->bytes());
    if (!profile) return fail(profile.error());
    return profiles[name] = std::make_shared<const scene::IesProfile>(*std::move(profile));
}

/// What lights had without `inputs:` before USD 21.02, and OpenUSD reads no more.
constexpr std::array light_names = {"intensity",
                                    "exposure",
                                    "diffuse",
                                    "specular",
                                    "normalize",
                                    "color",
                                    "enableColorTemperature",
                                    "colorTemperature",
                                    "shaping:focus",
                                    "shaping:focusTint",
                                    "shaping:cone:angle",
                                    "shaping:cone:softness",
                                    "shaping:ies:file",
                                    "shaping:ies:angleScale",
                                    "shaping:ies:normalize",
                                    "shadow:enable",
                                    "shadow:color",
                                    "shadow:distance",
                                    "shadow:falloff",
                                    "shadow:falloffGamma",
                                    "texture:file",
                                    "texture:format"};

/// The same of lights that are no geometry of another kind.
constexpr std::array shape_names = {"radius", "width", "height", "length", "angle"};

void warn_old_names(Context& ctx, Prim prim) {
    const auto warn = [&](const char* name) {
        const Attribute old = prim.attribute(name);
        if (!old.is_authored()) return;
        ctx.warn(
            "old-light-attribute", old,
            fmt::format("{0} of a light is ignored, as by OpenUSD since 21.02; expected inputs:{0}",
                        name));
    };
    for (const char* name : light_names) warn(name);
    if (is_light_type(prim.type_name().view()) || prim.type_name() == "PortalLight")
        for (const char* name : shape_names) warn(name);
}

}  // namespace

Attribute light_input(Context& ctx, Prim prim, std::string_view name) {
    const Attribute own = prim.attribute("inputs:" + std::string(name));
    if (!own.has_authored_connections()) return own;
    const materials::ShaderSource source = materials::shader_source(ctx, own);
    if (!source.shader) return source.value.is_valid() ? source.value : own;
    ctx.warn("unsupported-light-shader", own,
             fmt::format("inputs:{} is connected to <{}>, but a light can only read interface "
                         "inputs; {} is used",
                         name, source.shader.path_string(),
                         own.has_authored_value() ? "its own value" : "its default"));
    return own;
}

double default_intensity(std::string_view type) {
    return type == "DistantLight" ? 50000.0 : 1.0;
}

double input_number(Context& ctx, Prim prim, std::string_view name, double fallback) {
    return read_number(light_input(ctx, prim, name), fallback, ctx.time);
}

Vec3d read_radiance(Context& ctx, Prim prim, double default_intensity) {
    const double intensity = input_number(ctx, prim, "intensity", default_intensity);
    const double exposure = input_number(ctx, prim, "exposure", 0.0);
    Vec3d Le = color::read_light_color(ctx, light_input(ctx, prim, "color")).value_or(Vec3d(1.0));
    if (read_bool(light_input(ctx, prim, "enableColorTemperature"), false, ctx.time)) {
        const double kelvin = input_number(ctx, prim, "colorTemperature", 6500.0);
        if (kelvin < 1000.0 || kelvin > 10000.0) {
            ctx.warn("color-temperature-clamped", light_input(ctx, prim, "colorTemperature"),
                     fmt::format("colorTemperature {} K is outside [1000, 10000] and is clamped",
                                 kelvin));
        }
        Le *= color::blackbody_color(ctx, kelvin);
    }
    return Le * (intensity * std::exp2(exposure));
}

bool is_good_radiance(Context& ctx, Prim prim, const Vec3d& Le) {
    const bool is_good =
        Le.x >= 0.0 && Le.y >= 0.0 && Le.z >= 0.0 && velatura::is_finite(to_float(Le));
    if (!is_good)
        ctx.warn(
            "bad-light-value", prim,
            fmt::format(
                "emission ({:.6g}, {:.6g}, {:.6g}) is negative or not finite; the light is skipped",
                Le.x, Le.y, Le.z));
    return is_good;
}

scene::Shaping read_shaping(Context& ctx, Prim prim) {
    const Attribute angle = light_input(ctx, prim, "shaping:cone:angle");
    const Attribute focus = light_input(ctx, prim, "shaping:focus");
    scene::Shaping shaping;
    shaping.cone_softness =
        std::clamp(float(input_number(ctx, prim, "shaping:cone:softness", 0.0)), 0.0f, 1.0f);
    shaping.focus = float(read_number(focus, 0.0, ctx.time));
    if (const auto tint = color::read_light_color(ctx, light_input(ctx, prim, "shaping:focusTint")))
        shaping.focus_tint = to_float(*tint);
    if (angle.has_authored_value() || shaping.cone_softness > 0.0f)
        shaping.cone_angle_deg = float(read_number(angle, 90.0, ctx.time));
    const bool has_cone = shaping.cone_angle_deg * (1.0f - shaping.cone_softness) < 180.0f;
    shaping.is_active = has_cone || shaping.focus > 0.0f;
    if (!shaping.is_active && (angle.has_authored_value() || focus.has_authored_value()))
        ctx.note_zero(scene::Effect::LightShaping, prim, "no cone below 180 degrees, focus 0");
    shaping.ies = read_ies(ctx, light_input(ctx, prim, "shaping:ies:file"));
    if (!shaping.ies) return shaping;
    shaping.ies_angle_scale = float(input_number(ctx, prim, "shaping:ies:angleScale", 0.0));
    shaping.ies_normalize =
        read_bool(light_input(ctx, prim, "shaping:ies:normalize"), false, ctx.time);
    return shaping;
}

scene::LightLinks read_shadow(Context& ctx, Prim light) {
    scene::LightLinks links;
    const auto number = [&](const char* name, double fallback, double min) {
        const Attribute attribute = light_input(ctx, light, name);
        const double value = read_number(attribute, fallback, ctx.time);
        // Written so that NaN is caught
        if (value >= min && value <= double(std::numeric_limits<float>::max())) return value;
        ctx.warn("bad-light-value", attribute,
                 fmt::format("{} {:.6g} is out of range, {} is used", name, value, fallback));
        return fallback;
    };
    const double lowest = -double(std::numeric_limits<float>::max());
    const double distance = number("shadow:distance", -1.0, lowest);
    if (distance >= 0.0) {
        links.shadow_distance = float(distance);
        const double falloff = number("shadow:falloff", -1.0, lowest);
        links.shadow_falloff = float(std::clamp(falloff, 0.0, distance));
        if (falloff > 0.0)
            links.shadow_falloff_gamma = float(number("shadow:falloffGamma", 1.0, 0.0));
    }
    const Attribute color = light_input(ctx, light, "shadow:color");
    if (const auto rgb = color::read_light_color(ctx, color)) {
        const Rgb value = to_float(*rgb);
        if (value.x >= 0.0f && value.y >= 0.0f && value.z >= 0.0f && velatura::is_finite(value))
            links.shadow_color = value;
        else
            ctx.warn("bad-light-value", color,
                     "shadow:color is negative or not finite, shadows are black");
    }
    if (!links.has_custom_shadows() &&
        (light_input(ctx, light, "shadow:distance").has_authored_value() ||
         color.has_authored_value()))
        ctx.note_zero(scene::Effect::ShadowControls, light, "shadows of any reach, black");
    return links;
}

void warn_light_features(Context& ctx, Prim prim) {
    warn_old_names(ctx, prim);
}

}  // namespace velatura::translate::lights
