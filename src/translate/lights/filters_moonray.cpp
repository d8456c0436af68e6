// SPDX-License-Identifier: Apache-2.0
// Light filters of MoonRay.
// Ref: docs.openmoonray.org, "Light Filters"; dreamworksanimation/moonray, dso/lightfilter (names
// and defaults) and lib/rendering/pbr/lightfilter (what they do).
#include "translate/lights/light_filters.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace velatura::translate::lights {

namespace {

using scene::FilterProjection;

/// Every filter can be switched off.
bool is_on(FilterSite& site) {
    return site.inputs.flag({"on"}, true);
}

float read_density(FilterSite& site) {
    return std::clamp(float(site.inputs.number({"density"}, 1.0)), 0.0f, 1.0f);
}

/// Of knots of several types the first decides.
scene::RampFilter::Interpolation read_interpolation(FilterSite& site, const char* name) {
    using Interpolation = scene::RampFilter::Interpolation;
    const std::vector<float> types = site.inputs.numbers({name});
    if (types.empty()) return Interpolation::Linear;
    const int type = int(types.front());
    const bool is_one =
        std::all_of(types.begin(), types.end(), [&](float other) { return int(other) == type; });
    if (!is_one || type == 2 || type == 3 || type == 5)
        site.inputs.warn("unsupported-light-filter-input",
                         std::string(name) +
                             " of the light filter is not supported as it is authored; one type of "
                             "none, linear and smooth is used for all knots");
    if (type == 0) return Interpolation::Constant;
    return type == 4 || type == 5 || type == 6 ? Interpolation::Smooth : Interpolation::Linear;
}

}  // namespace

void read_moonray_intensity(FilterSite& site) {
    Rgb tint = read_tint(site, 1.0, Rgb(1.0f));
    site.inputs.expect({"light_path_selection"}, 0.0, "the filter acts on all light paths");
    if (site.inputs.flag({"invert"}, false))
        for (int c = 0; c < 3; ++c) tint[c] = tint[c] > 0.0f ? 1.0f / tint[c] : 0.0f;
    if (is_on(site)) site.add(scene::IntensityFilter()).tint = tint;
}

void read_moonray_barn(FilterSite& site) {
    FilterInputs& in = site.inputs;
    const bool is_physical = in.choice({"mode"}, {"analytical", "physical"}, 0) == 1;
    const bool is_perspective =
        in.choice({"projector_type"}, {"perspective", "orthographic"}, 0) == 0;
    const double distance = std::max(in.number({"projector_focal_distance"}, 30.0), 1e-6);
    // The opening of a perspective projection grows with its distance
    const double growth = is_perspective ? distance : 1.0;
    const double width = std::max(in.number({"projector_width"}, 1.0), 0.0) * growth;
    const double height = std::max(in.number({"projector_height"}, 1.0), 0.0) * growth;
    const double smaller = std::min(width, height);
    scene::BarnDoorFilter barn;
    barn.projection.kind = is_physical      ? FilterProjection::Kind::Segment
                           : is_perspective ? FilterProjection::Kind::Point
                                            : FilterProjection::Kind::Parallel;
    barn.projection.apex = float(distance);
    constexpr std::array before = {FilterProjection::Before::Black,
                                   FilterProjection::Before::Unfiltered,
                                   FilterProjection::Before::Extended};
    barn.projection.before =
        before[size_t(in.choice({"pre_barn_mode"}, {"black", "white", "default"}, 2))];
    in.ignore({"pre_barn_distance"});
    // Corners lie inside of the opening
    const double radius = 0.5 * smaller * std::clamp(in.number({"radius"}, 0.0), 0.0, 1.0);
    const auto grown = [&](const char* name) { return in.number({name}, 0.0) * growth; };
    barn.opening.lower = Vec3(float(radius - 0.5 * width - grown("size_left")),
                              float(radius - 0.5 * height - grown("size_bottom")), 0.0f);
    barn.opening.upper = Vec3(float(0.5 * width - radius + grown("size_right")),
                              float(0.5 * height - radius + grown("size_top")), 0.0f);
    barn.opening.radius = float(radius);
    barn.opening.edge = float(std::max(in.number({"edge"}, 0.0), 0.0) * smaller);
    const auto edge = [&](const char* name) {
        return std::max(float(in.number({name}, 1.0)), 0.0f);
    };
    barn.opening.edge_lower = Vec3(edge("edge_scale_left"), edge("edge_scale_bottom"), 1.0f);
    barn.opening.edge_upper = Vec3(edge("edge_scale_right"), edge("edge_scale_top"), 1.0f);
    const bool is_on_light = in.flag({"use_light_xform"}, true);
    const double turn = in.number({"rotation"}, 0.0) * pi_d / 180.0;
    const Rgb color = in.color({"color"}, Rgb(1.0f));
    const float density = read_density(site);
    const bool is_inverted = in.flag({"invert"}, false);
    if (!is_on(site)) return;
    scene::LightFilter& filter = site.add(barn);
    const Mat4d& base = is_on_light ? site.light.parent_from_light : site.parent_from_filter;
    // Counterclockwise as seen from the light, which looks along −z
    Mat4d rotation;
    rotation.setAxisAngle(Vec3d(0.0, 0.0, 1.0), turn);
    filter.parent_from_filter =
        rotation * Mat4d().setTranslation(Vec3d(0.0, 0.0, -distance)) * base;
    filter.tint = color;
    filter.density = density;
    filter.is_inverted = is_inverted;
}

void read_moonray_rod(FilterSite& site) {
    FilterInputs& in = site.inputs;
    scene::RodFilter rod;
    const auto half = [&](const char* name) {
        return 0.5f * std::max(float(in.number({name}, 1.0)), 0.0f);
    };
    rod.box.upper = Vec3(half("width"), half("height"), half("depth"));
    rod.box.lower = -rod.box.upper;
    rod.box.radius = std::max(float(in.number({"radius"}, 0.0)), 0.0f);
    rod.box.edge = std::max(float(in.number({"edge"}, 0.0)), 0.0f);
    const Rgb tint = read_tint(site, 1.0, Rgb(0.0f));
    const float density = read_density(site);
    const bool is_inverted = in.flag({"invert"}, false);
    const std::vector<float> linear = {0.0f, 1.0f};
    const auto is_given = [&](const char* name) {
        const std::vector<float> values = in.numbers({name});
        return !values.empty() && values != linear;
    };
    const bool has_in = is_given("ramp_in_distances"), has_out = is_given("ramp_out_distances");
    if (has_in || has_out)
        in.warn("unsupported-light-filter-input",
                "the ramp over the edge of the light filter is not supported; its edge is a smooth "
                "step");
    in.ignore({"ramp_interpolation_types"});
    if (!is_on(site)) return;
    scene::LightFilter& filter = site.add(rod);
    filter.tint = tint;
    filter.density = density;
    filter.is_inverted = is_inverted;
}

void read_moonray_ramp(FilterSite& site) {
    FilterInputs& in = site.inputs;
    using Measure = scene::RampFilter::Measure;
    scene::RampFilter ramp;
    ramp.begin = float(in.number({"begin_distance"}, 0.0));
    ramp.end = float(in.number({"end_distance"}, 1.0));
    ramp.measure = in.choice({"mode"}, {"radial", "directional"}, 0) == 0 ? Measure::FromPoint
                                                                          : Measure::AlongAxis;
    in.expect({"wrap_mode"}, 0.0, "the ramp ends at its origin");
    ramp.knots = in.numbers({"distances"});
    ramp.colors = in.colors({"colors"});
    if (ramp.knots.empty()) ramp.knots = {0.0f, 1.0f};
    if (ramp.colors.empty()) ramp.colors = {Rgb(1.0f), Rgb(0.0f)};
    ramp.interpolation = read_interpolation(site, "interpolation_types");
    const bool has_own_place = in.flag({"use_xform"}, false);
    const Rgb tint = Rgb(float(std::max(in.number({"intensity"}, 1.0), 0.0)));
    const float density = read_density(site);
    if (!is_on(site)) return;
    if (ramp.knots.size() != ramp.colors.size() ||
        !std::is_sorted(ramp.knots.begin(), ramp.knots.end())) {
        in.warn("bad-light-filter",
                "distances and colors of the light filter are not equally many, or descend; the "
                "light is rendered without the filter");
        return;
    }
    scene::LightFilter& filter = site.add(std::move(ramp));
    if (!has_own_place) filter.parent_from_filter = site.light.parent_from_light;
    filter.tint = tint;
    filter.density = density;
}

void read_moonray_decay(FilterSite& site) {
    FilterInputs& in = site.inputs;
    const bool has_near = in.flag({"falloff_near"}, false),
               has_far = in.flag({"falloff_far"}, false);
    const Vec2 near(float(in.number({"near_start"}, 0.0)), float(in.number({"near_end"}, 0.0)));
    Vec2 far(float(in.number({"far_start"}, 0.0)), float(in.number({"far_end"}, 0.0)));
    // As in MoonRay the light fades out once it has faded in
    if (has_near) far.x = std::max({far.x, near.x, near.y});
    if (!is_on(site)) return;
    add_decay(site, has_near ? std::optional(near) : std::nullopt,
              has_far ? std::optional(far) : std::nullopt,
              scene::RampFilter::Interpolation::Linear);
}

void read_moonray_cookie(FilterSite& site) {
    FilterInputs& in = site.inputs;
    const double focal = std::max(in.number({"projector_focal"}, 30.0), 1e-6);
    const double aperture = std::max(in.number({"projector_film_width_aperture"}, 24.0), 1e-6);
    in.expect({"projector_type"}, 0.0, "the texture is projected in perspective");
    in.expect({"projector_pixel_aspect_ratio"}, 1.0, "the texture is projected as a square");
    in.expect({"blur_near_value"}, 0.0, "the texture is projected sharp");
    in.expect({"blur_mid_value"}, 0.0, "the texture is projected sharp");
    in.expect({"blur_far_value"}, 0.0, "the texture is projected sharp");
    in.ignore({"blur_near_distance", "blur_midpoint", "blur_far_distance", "blur_type"});
    const int outside = in.choice({"outside_projection"}, {"black", "white", "default"}, 0);
    const std::optional<FilterTexture> map = in.texture({"texture_map"});
    const float density = read_density(site);
    const bool is_inverted = in.flag({"invert"}, false);
    if (!is_on(site)) return;
    if (!map) {
        in.warn("bad-light-filter",
                "light filter without a texture map that reads an image; the light is rendered "
                "without the filter");
        return;
    }
    scene::GoboFilter cookie;
    // Behind the projector is outside
    cookie.projection = {FilterProjection::Kind::Point, 1.0f, FilterProjection::Before::Extended};
    cookie.width = cookie.height = float(aperture / focal);
    cookie.outside =
        outside == 2 ? scene::GoboFilter::Outside::Repeat : scene::GoboFilter::Outside::Fill;
    cookie.fill = Rgb(outside == 1 ? 1.0f : 0.0f);
    cookie.texture_file = map->file;
    cookie.texture_colors = map->colors;
    scene::LightFilter& filter = site.add(cookie);
    filter.parent_from_filter =
        Mat4d().setTranslation(Vec3d(0.0, 0.0, -1.0)) * site.parent_from_filter;
    filter.density = density;
    filter.is_inverted = is_inverted;
}

}  // namespace velatura::translate::lights
