// SPDX-License-Identifier: Apache-2.0
// Light filters of RenderMan: the attributes of UsdRi's old schemas, of UsdRiPxr and of the
// shaders. Ref: rmanwiki.pixar.com, "Light Filters"; OpenUSD, hdPrman lightFilterUtils.cpp and
// usdRi/schema.usda; outlines of barn and rod: GafferHQ, GafferRenderManUI BarnVisualiser.cpp.
#include "translate/lights/light_filters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

namespace velatura::translate::lights {

namespace {

using scene::FilterProjection;

/// Density, inversion, intensity and saturation; warns of what is not simulated.
void read_ri_multiplier(FilterSite& site, scene::LightFilter& filter, double default_intensity) {
    FilterInputs& in = site.inputs;
    filter.tint = read_tint(site, default_intensity, Rgb(1.0f));
    filter.density = float(std::clamp(in.number({"density"}, 1.0), 0.0, 1.0));
    filter.is_inverted = in.flag({"invert"}, false);
    filter.saturation =
        float(std::max(in.number({"saturation", "color:saturation", "colorSaturation"}, 1.0), 0.0));
    in.expect({"diffuse"}, 1.0, "the filter acts alike on diffuse and specular lobes");
    in.expect({"specular"}, 1.0, "the filter acts alike on diffuse and specular lobes");
    const int mode = in.choice({"combineMode"}, {"mult", "max", "min", "screen", "multiply"}, 0);
    if (mode != 0 && mode != 4)
        in.warn("unsupported-light-filter-input",
                "combineMode of the light filter is not supported; filters are multiplied");
    in.ignore({"coordsys", "coordSys", "notes"});
}

/// Sides, corners and edges of barn doors and rods.
scene::RoundedBox read_ri_box(FilterSite& site, bool has_depth) {
    FilterInputs& in = site.inputs;
    scene::RoundedBox box;
    const auto number = [&](FilterInputs::Names names, double fallback) {
        return float(in.number(names, fallback));
    };
    const Vec3 half(0.5f * std::max(number({"width"}, 1.0), 0.0f),
                    0.5f * std::max(number({"height"}, 1.0), 0.0f),
                    has_depth ? 0.5f * std::max(number({"depth"}, 1.0), 0.0f) : 0.0f);
    box.lower = -half - Vec3(number({"left", "refine:left"}, 0.0),
                             number({"bottom", "refine:bottom"}, 0.0), 0.0f);
    box.upper = half + Vec3(number({"right", "refine:right"}, 0.0),
                            number({"top", "refine:top"}, 0.0), 0.0f);
    box.radius = std::max(number({"radius"}, 0.0), 0.0f);
    box.edge = std::max(number({"edge", "edgeThickness"}, 0.0), 0.0f);
    const auto scale = [&](FilterInputs::Names names) {
        return std::max(number(names, 1.0), 1e-6f);
    };
    box.scale =
        Vec3(scale({"scaleWidth", "scale:width"}), scale({"scaleHeight", "scale:height"}), 1.0f);
    box.edge_lower = Vec3(scale({"leftEdge", "edgeScale:left"}),
                          scale({"bottomEdge", "edgeScale:bottom"}), 1.0f);
    box.edge_upper =
        Vec3(scale({"rightEdge", "edgeScale:right"}), scale({"topEdge", "edgeScale:top"}), 1.0f);
    if (!has_depth) return box;
    // The front is on the side of +z
    box.lower.z -= number({"back", "refine:back"}, 0.0);
    box.upper.z += number({"front", "refine:front"}, 0.0);
    box.scale.z = scale({"scaleDepth", "scale:depth"});
    box.edge_lower.z = scale({"backEdge", "edgeScale:back"});
    box.edge_upper.z = scale({"frontEdge", "edgeScale:front"});
    return box;
}

/// False with a warning when the projection has no apex.
bool read_ri_projection(FilterSite& site, bool is_analytic, FilterProjection& projection) {
    FilterInputs& in = site.inputs;
    const bool is_parallel = in.flag({"directional", "analytic:directional"}, false);
    const double apex = in.number({"apex", "analytic:apex"}, 0.0);
    in.ignore({"densityNear", "densityNearDist", "analytic:density:nearDistance", "densityFar",
               "densityFarDist", "analytic:density:farDistance", "densityNearVal",
               "analytic:density:nearValue", "densityFarVal", "analytic:density:farValue",
               "densityMidpoint", "densityMidVal", "analytic:density:midpoint",
               "analytic:density:midValue"});
    if (!is_analytic) {
        in.ignore({"shearX", "analytic:shearX", "shearY", "analytic:shearY", "useLightDirection",
                   "analytic:useLightDirection", "densityPow", "analytic:density:exponent"});
        return true;
    }
    in.expect({"shearX", "analytic:shearX"}, 0.0, "the projection is straight");
    in.expect({"shearY", "analytic:shearY"}, 0.0, "the projection is straight");
    in.expect({"useLightDirection", "analytic:useLightDirection"}, 0.0,
              "the projection follows the filter");
    in.expect({"densityPow", "analytic:density:exponent"}, 0.0,
              "the density is the same at all distances");
    projection.kind =
        is_parallel ? FilterProjection::Kind::Parallel : FilterProjection::Kind::Point;
    projection.apex = float(apex);
    if (is_parallel || apex > 0.0) return true;
    in.warn("bad-light-filter",
            "analytic projection of the light filter has no apex, which has to be above 0; the "
            "light is rendered without the filter");
    return false;
}

/// A spline, whatever its basis, as its knots say.
struct Spline {
    std::vector<float> knots;
    scene::RampFilter::Interpolation interpolation = scene::RampFilter::Interpolation::Linear;
};

Spline read_ri_knots(FilterSite& site,
                     FilterInputs::Names knots,
                     FilterInputs::Names interpolation,
                     size_t count) {
    Spline spline{site.inputs.numbers(knots)};
    using Interpolation = scene::RampFilter::Interpolation;
    const int basis = site.inputs.choice(
        interpolation, {"linear", "constant", "catmull-rom", "bspline", "catmullRom", "smooth"}, 0);
    if (basis == 1) spline.interpolation = Interpolation::Constant;
    if (basis >= 2) spline.interpolation = Interpolation::Smooth;
    if (basis >= 2 && basis <= 4)
        site.inputs.warn("unsupported-light-filter-input",
                         "cubic ramp of the light filter is not supported; a smooth step between "
                         "its knots is used");
    const bool is_ramp =
        spline.knots.size() == count && std::is_sorted(spline.knots.begin(), spline.knots.end());
    if (!is_ramp && (count > 0 || !spline.knots.empty()))
        site.inputs.warn(
            "bad-light-filter",
            fmt::format("a ramp of the light filter has {} knots and {} values, or its "
                        "knots do not ascend; it is rendered from 1 to 0",
                        spline.knots.size(), count));
    if (!is_ramp) spline.knots.clear();
    return spline;
}

}  // namespace

void read_ri_intensity(FilterSite& site) {
    scene::LightFilter& filter = site.add(scene::IntensityFilter());
    read_ri_multiplier(site, filter, 1.0);
    if (!filter.is_inverted) return;
    for (int c = 0; c < 3; ++c) filter.tint[c] = filter.tint[c] > 0.0f ? 1.0f / filter.tint[c] : 0;
}

void read_ri_barn(FilterSite& site) {
    FilterInputs& in = site.inputs;
    scene::BarnDoorFilter barn;
    const bool is_analytic = in.choice({"barnMode"}, {"physical", "analytic"}, 0) == 1;
    if (!read_ri_projection(site, is_analytic, barn.projection)) return;
    const int before = in.choice({"preBarn", "preBarnEffect"}, {"noEffect", "cone", "noLight"}, 0);
    barn.projection.before = FilterProjection::Before(before);
    barn.opening = read_ri_box(site, false);
    read_ri_multiplier(site, site.add(barn), 1.0);
}

void read_ri_rod(FilterSite& site) {
    scene::RodFilter rod;
    rod.box = read_ri_box(site, true);
    // What it holds is dark unless something else is said
    read_ri_multiplier(site, site.add(rod), 0.0);
}

void read_ri_ramp(FilterSite& site) {
    FilterInputs& in = site.inputs;
    scene::RampFilter ramp;
    ramp.measure = scene::RampFilter::Measure(in.choice(
        {"rampType", "rampMode"}, {"distanceToLight", "linear", "spherical", "radial"}, 0));
    ramp.begin = float(in.number({"beginDist", "beginDistance"}, 0.0));
    ramp.end = float(in.number({"endDist", "endDistance"}, 10.0));
    in.ignore({"ramp", "colorRamp", "falloff"});
    const std::vector<float> values =
        in.numbers({"ramp_Floats", "falloff_Floats", "falloff:floats"});
    const std::vector<Rgb> colors = in.colors({"colorRamp_Colors", "colorRamp:colors"});
    const Spline of_values = read_ri_knots(
        site, {"ramp_Knots", "falloff_Knots", "falloff:knots"},
        {"ramp_Interpolation", "falloff_Interpolation", "falloff:interpolation"}, values.size());
    const Spline of_colors =
        read_ri_knots(site, {"colorRamp_Knots", "colorRamp:knots"},
                      {"colorRamp_Interpolation", "colorRamp:interpolation"}, colors.size());
    const bool has_colors = !of_colors.knots.empty();
    // Without any ramp: from all light to none
    ramp.knots = of_values.knots;
    ramp.interpolation = of_values.interpolation;
    for (const float value : values) ramp.colors.push_back(Rgb(std::max(value, 0.0f)));
    if (ramp.knots.empty()) {
        ramp.knots = {0.0f, 1.0f};
        ramp.colors = {Rgb(1.0f), Rgb(has_colors ? 1.0f : 0.0f)};
    }
    const bool has_both = has_colors && !of_values.knots.empty();
    scene::RampFilter colored = ramp;
    if (has_colors) {
        colored.knots = of_colors.knots;
        colored.colors = colors;
        colored.interpolation = of_colors.interpolation;
    }
    scene::LightFilter& first = site.add(has_colors ? colored : ramp);
    read_ri_multiplier(site, first, 1.0);
    if (!has_both) return;
    const scene::LightFilter shared = first;
    scene::LightFilter& second = site.add(ramp);
    second.density = shared.density;
    second.is_inverted = shared.is_inverted;
    if (shared.density < 1.0f || shared.is_inverted)
        in.warn("unsupported-light-filter-input",
                "density and invert act on the ramp and on the color ramp of the light filter, one "
                "after the other");
}

void read_ri_cookie(FilterSite& site) {
    FilterInputs& in = site.inputs;
    scene::GoboFilter cookie;
    const bool is_analytic = in.choice({"cookieMode"}, {"physical", "analytic"}, 0) == 1;
    if (!read_ri_projection(site, is_analytic, cookie.projection)) return;
    cookie.projection.before = FilterProjection::Before::Black;
    const std::optional<FilterTexture> map = in.texture({"map", "texture:map"});
    if (!map) {
        in.warn("bad-light-filter",
                "light filter without a map; the light is rendered without the filter");
        return;
    }
    cookie.texture_file = map->file;
    cookie.texture_colors = map->colors;
    cookie.width = std::max(float(in.number({"width"}, 1.0)), 1e-6f);
    cookie.height = std::max(float(in.number({"height"}, 1.0)), 1e-6f);
    cookie.fill = in.color({"fillColor", "texture:fillColor"}, Rgb(0.0f));
    cookie.outside = scene::GoboFilter::Outside(
        in.choice({"tileMode", "texture:wrapMode"}, {"off", "clamp", "repeat"}, 0));
    cookie.uv_scale = {float(in.number({"scaleU", "texture:scaleU"}, 1.0)),
                       float(in.number({"scaleV", "texture:scaleV"}, 1.0))};
    cookie.uv_offset = {float(in.number({"offsetU", "texture:offsetU"}, 0.0)),
                        float(in.number({"offsetV", "texture:offsetV"}, 0.0))};
    in.expect({"invertU", "texture:invertU"}, 0.0, "the texture is not mirrored");
    in.expect({"invertV", "texture:invertV"}, 0.0, "the texture is not mirrored");
    in.expect({"blur", "analytic:blur:amount"}, 0.0, "the texture is projected sharp");
    in.expect({"contrast", "color:contrast"}, 1.0, "the contrast of the texture is kept");
    in.ignore(
        {"premultipliedAlpha", "midpoint", "color:midpoint", "whitepoint", "color:whitepoint"});
    read_ri_multiplier(site, site.add(cookie), 1.0);
}

}  // namespace velatura::translate::lights
