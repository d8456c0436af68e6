// SPDX-License-Identifier: Apache-2.0
#include "translate/lights/light_filters.h"

#include "translate/context/instance_source.h"
#include "translate/context/values.h"
#include "translate/materials/shader_inputs.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <variant>

namespace velatura::translate::lights {

namespace {

using FilterReader = void (*)(FilterSite&);

/// Houdini's barn doors are attributes of the light.
constexpr std::string_view houdini_doors = "houdini:barndoor";

void read_houdini_doors(FilterSite& site);

/// What a filter goes by, and who reads it. Prim types, shader ids, and classes of MoonRay alike.
struct Kind {
    std::string_view id;
    FilterReader read;
};

constexpr std::array kinds = {
    Kind{"PxrIntMultLightFilter", read_ri_intensity},
    Kind{"PxrBarnLightFilter", read_ri_barn},
    Kind{"PxrRodLightFilter", read_ri_rod},
    Kind{"PxrBlockerLightFilter", read_ri_rod},
    Kind{"PxrRampLightFilter", read_ri_ramp},
    Kind{"PxrCookieLightFilter", read_ri_cookie},
    Kind{"PxrGoboLightFilter", read_ri_cookie},
    Kind{"barndoor", read_arnold_barndoor},
    Kind{"ArnoldBarndoor", read_arnold_barndoor},
    Kind{"gobo", read_arnold_gobo},
    Kind{"ArnoldGobo", read_arnold_gobo},
    Kind{"light_blocker", read_arnold_blocker},
    Kind{"ArnoldLightBlocker", read_arnold_blocker},
    Kind{"light_decay", read_arnold_decay},
    Kind{"ArnoldLightDecay", read_arnold_decay},
    Kind{"IntensityLightFilter", read_moonray_intensity},
    Kind{"BarnDoorLightFilter", read_moonray_barn},
    Kind{"RodLightFilter", read_moonray_rod},
    Kind{"ColorRampLightFilter", read_moonray_ramp},
    Kind{"DecayLightFilter", read_moonray_decay},
    Kind{"CookieLightFilter", read_moonray_cookie},
    Kind{"kma_lfilter_gel", read_karma_gel},
    Kind{"kma_lfilter_barndoor", read_karma_barndoor},
    Kind{houdini_doors, read_houdini_doors},
};

const Kind* find_kind(std::string_view id) {
    if (id.starts_with("arnold:")) id.remove_prefix(7);
    const auto at =
        std::find_if(kinds.begin(), kinds.end(), [&](const Kind& kind) { return kind.id == id; });
    return at == kinds.end() ? nullptr : &*at;
}

/// Who says what the filter is, and has its parameters.
struct Identity {
    Prim owner;
    std::string id;
};

bool has_houdini_doors(Context& ctx, Prim light) {
    for (const char* side : {"left", "right", "top", "bottom"})
        if (read_number(light.attribute(std::string("barndoor") + side), 0.0, ctx.time) > 0.0)
            return true;
    return false;
}

/// Of the relationship, by its name of today or before USD 21.02.
std::vector<usd::layer::Path> filter_targets(Prim light) {
    std::vector<usd::layer::Path> paths;
    for (const char* name : {"light:filters", "filters"})
        for (const auto& path : light.relationship(name).forwarded_targets()) paths.push_back(path);
    return paths;
}

/// Attributes that hold an id, the general one first.
constexpr std::array id_attributes = {"lightFilter:shaderId",
                                      "ri:lightFilter:shaderId",
                                      "arnold:lightFilter:shaderId",
                                      "moonray:lightFilter:shaderId",
                                      "karma:lightFilter:shaderId",
                                      "moonray:class",
                                      "info:id"};

Identity identify(Context& ctx, Prim filter, Prim light) {
    if (filter == light) return {filter, std::string(houdini_doors)};
    std::string unknown;
    for (const char* name : id_attributes) {
        const std::string id = read_text(filter.attribute(name), "", ctx.time);
        if (find_kind(id) != nullptr) return {filter, id};
        if (unknown.empty()) unknown = id;
    }
    const std::string& type = filter.type_name().str();
    if (find_kind(type) != nullptr) return {filter, type};
    // A container, which shows the output of a shader
    for (const usd::layer::Token& name : filter.property_names()) {
        if (!name.view().starts_with("outputs:")) continue;
        const Attribute output = filter.attribute(name.view());
        if (!output.has_authored_connections()) continue;
        const Prim shader = materials::shader_source(ctx, output).shader;
        const std::string id =
            shader ? read_text(shader.attribute("info:id"), "", ctx.time) : std::string();
        if (find_kind(id) != nullptr) return {shader, id};
        if (unknown.empty()) unknown = id;
    }
    return {filter, unknown.empty() ? type : unknown};
}

bool is_sound(const Rgb& color) {
    return is_finite(color) && color.x >= 0.0f && color.y >= 0.0f && color.z >= 0.0f;
}

/// Whether the light behind the filter has radiances that are numbers.
bool has_sound_colors(const scene::LightFilter& filter) {
    if (!is_sound(filter.tint) || !std::isfinite(filter.saturation)) return false;
    if (const auto* ramp = std::get_if<scene::RampFilter>(&filter.shape))
        return std::all_of(ramp->colors.begin(), ramp->colors.end(), is_sound) &&
               std::all_of(ramp->knots.begin(), ramp->knots.end(),
                           [](float knot) { return std::isfinite(knot); });
    const auto* gobo = std::get_if<scene::GoboFilter>(&filter.shape);
    return !gobo || is_sound(gobo->fill);
}

void read_filter(Context& ctx,
                 Prim filter,
                 const FilteredLight& light,
                 std::vector<scene::LightFilter>& out) {
    const Identity identity = identify(ctx, filter, light.prim);
    const Kind* const kind = find_kind(identity.id);
    if (kind == nullptr) {
        ctx.note_not_simulated(scene::Effect::LightFilters, filter, identity.id);
        ctx.warn("unsupported-light-filter", filter,
                 fmt::format("light filter {} is not supported; <{}> is rendered without it",
                             identity.id, light.prim.path_string()));
        return;
    }
    const Mat4d matrix =
        parent_from_world(ctx, light, usd::stage::world_transform(filter, ctx.time));
    const double determinant = determinant3(matrix);
    // Written so that NaN is caught
    if (!is_finite(matrix) || !(std::abs(determinant) > 0.0)) {
        ctx.warn("bad-transform", filter,
                 fmt::format("transform is singular or infinite; <{}> is rendered without the "
                             "light filter",
                             light.prim.path_string()));
        return;
    }
    FilterInputs inputs(ctx, filter, identity.owner);
    FilterSite site{ctx, light, inputs, matrix, out};
    const size_t before = out.size();
    kind->read(site);
    const bool is_sound =
        std::all_of(out.begin() + std::ptrdiff_t(before), out.end(), has_sound_colors);
    if (!is_sound) {
        out.resize(before);
        ctx.warn("bad-light-filter", filter,
                 fmt::format("a color, intensity or knot of the light filter is negative, infinite "
                             "or not a number; <{}> is rendered without it",
                             light.prim.path_string()));
    }
    // Of a light, everything else is its own
    if (!(filter == light.prim)) inputs.warn_rest();
}

void read_houdini_doors(FilterSite& site) {
    const auto flap = [&](const char* position, const char* edge) {
        const double in = std::clamp(site.inputs.number({position}, 0.0), 0.0, 1.0);
        return Flap{in, in, std::max(site.inputs.number({edge}, 0.0), 0.0)};
    };
    add_flaps(
        site,
        {flap("barndoorleft", "barndoorleftedge"), flap("barndoorright", "barndoorrightedge"),
         flap("barndoortop", "barndoortopedge"), flap("barndoorbottom", "barndoorbottomedge")});
}

}  // namespace

bool is_light_filter(Prim prim) {
    const std::string_view type = prim.type_name().view();
    return type.ends_with("LightFilter") || (!type.empty() && find_kind(type) != nullptr);
}

std::vector<Prim> filter_prims(Context& ctx, Prim light) {
    std::vector<Prim> prims;
    if (has_houdini_doors(ctx, light)) prims.push_back(light);
    for (const auto& path : filter_targets(light))
        if (const Prim filter = ctx.stage.prim_at(path); filter && !(filter == light))
            prims.push_back(filter);
    // Arnold: outputs filters:i1, filters:i2 … of a node graph
    const std::string graph = read_text(light.attribute("primvars:arnold:shaders"), "", ctx.time);
    const Prim shaders = graph.starts_with('/') ? ctx.stage.prim_at(graph) : Prim();
    if (!shaders) return prims;
    for (const usd::layer::Token& name : shaders.property_names()) {
        if (!name.view().starts_with("outputs:filters") &&
            !name.view().starts_with("outputs:light_filter"))
            continue;
        const Prim shader = materials::shader_source(ctx, shaders.attribute(name.view())).shader;
        if (shader) prims.push_back(shader);
    }
    return prims;
}

std::vector<scene::LightFilter> read_filters(Context& ctx, const FilteredLight& light) {
    for (const auto& path : filter_targets(light.prim)) {
        const Prim filter = ctx.stage.prim_at(path);
        if (!filter || filter == light.prim)
            ctx.warn(
                "bad-light-filter", light.prim,
                fmt::format("light filter <{}> {}; the light is rendered without it",
                            path.to_string(), filter ? "is the light itself" : "does not exist"));
    }
    std::vector<scene::LightFilter> filters;
    for (const Prim filter : filter_prims(ctx, light.prim))
        read_filter(ctx, filter, light, filters);
    return filters;
}

Mat4d spot_plane(const FilteredLight& light, double distance) {
    return Mat4d().setTranslation(Vec3d(0.0, 0.0, -distance)) * light.parent_from_light;
}

scene::LightFilter* add_flaps(FilterSite& site, const Flaps& flaps) {
    if (!(site.light.cone_angle_deg < 90.0f)) {
        site.inputs.warn("unsupported-light-filter",
                         fmt::format("barn doors of a spot light need a cone below 90 degrees "
                                     "(shaping:cone:angle); <{}> is rendered without them",
                                     site.light.prim.path_string()));
        return nullptr;
    }
    const double half = std::tan(double(site.light.cone_angle_deg) * pi_d / 180.0);
    scene::BarnDoorFilter doors;
    doors.projection = {scene::FilterProjection::Kind::Point, 1.0f,
                        scene::FilterProjection::Before::Extended};
    doors.opening.lower.z = doors.opening.upper.z = 0.0f;
    doors.opening.edge = 1.0f;
    constexpr float open = std::numeric_limits<float>::infinity();
    // Flaps cover what is beyond a line between their ends; an edge fades on the lit side of it
    const auto set = [&](int axis, const Flap& low, const Flap& high) {
        const auto side = [&](const Flap& flap, float sign, float& bound, float& slope,
                              float& width) {
            width = float(2.0 * half * flap.edge);
            bound = sign * open;
            if (flap.is_open()) return;
            bound = sign * (float(half * (1.0 - flap.first - flap.second)) - width);
            // The first end of a flap is on the left, or at the top
            const double growth = axis == 0 ? flap.first - flap.second : flap.second - flap.first;
            slope = -sign * float(growth);
        };
        side(low, -1.0f, doors.opening.lower[axis], doors.slope_lower[axis],
             doors.opening.edge_lower[axis]);
        side(high, 1.0f, doors.opening.upper[axis], doors.slope_upper[axis],
             doors.opening.edge_upper[axis]);
    };
    set(0, flaps.left, flaps.right);
    set(1, flaps.bottom, flaps.top);
    scene::LightFilter& filter = site.add(doors);
    filter.parent_from_filter = spot_plane(site.light, 1.0);
    return &filter;
}

Mat4d parent_from_world(Context& ctx, const FilteredLight& light, const Mat4d& world) {
    const Mat4d world_from_light = usd::stage::world_transform(light.prim, ctx.time);
    if (light.parent_from_light == relative_to(world_from_light, ctx.origin))
        return relative_to(world, ctx.origin);
    return world * world_from_light.inverse() * light.parent_from_light;
}

void add_decay(FilterSite& site,
               const std::optional<Vec2>& near,
               const std::optional<Vec2>& far,
               scene::RampFilter::Interpolation interpolation) {
    const auto fade = [&](const Vec2& range, float first, float last) {
        scene::RampFilter ramp;
        ramp.begin = range.x;
        ramp.end = std::max(range.x, range.y);
        ramp.knots = {0.0f, 1.0f};
        ramp.colors = {Rgb(first), Rgb(last)};
        ramp.interpolation = interpolation;
        site.add(std::move(ramp));
    };
    if (near) fade(*near, 0.0f, 1.0f);
    if (far) fade(*far, 1.0f, 0.0f);
}

Rgb read_tint(FilterSite& site, double default_intensity, const Rgb& default_color) {
    const double intensity = std::max(site.inputs.number({"intensity"}, default_intensity), 0.0);
    const double gain = intensity * std::exp2(site.inputs.number({"exposure"}, 0.0));
    return site.inputs.color({"color", "tint"}, default_color) * float(gain);
}

}  // namespace velatura::translate::lights
