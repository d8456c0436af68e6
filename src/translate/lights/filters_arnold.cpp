// SPDX-License-Identifier: Apache-2.0
// Light filters of Arnold, as arnold-usd writes them.
// Ref: Arnold User Guide, "Light Filters"; Autodesk/arnold-usd, render_delegate/light.cpp and tests
// 0230 and 1906; GafferHQ, GafferArnoldUI, visualiser of barn doors.
#include "translate/lights/light_filters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::translate::lights {

void read_arnold_barndoor(FilterSite& site) {
    FilterInputs& in = site.inputs;
    const auto position = [&](const char* name, double open) {
        return std::abs(in.number({name}, open) - open);
    };
    const auto edge = [&](const char* name) { return std::max(in.number({name}, 0.0), 0.0); };
    add_flaps(site,
              {.left = {position("barndoor_left_top", 0.0), position("barndoor_left_bottom", 0.0),
                        edge("barndoor_left_edge")},
               .right = {position("barndoor_right_top", 1.0),
                         position("barndoor_right_bottom", 1.0), edge("barndoor_right_edge")},
               .top = {position("barndoor_top_left", 0.0), position("barndoor_top_right", 0.0),
                       edge("barndoor_top_edge")},
               .bottom = {position("barndoor_bottom_left", 1.0),
                          position("barndoor_bottom_right", 1.0), edge("barndoor_bottom_edge")}});
}

void read_arnold_gobo(FilterSite& site) {
    FilterInputs& in = site.inputs;
    const std::optional<FilterTexture> map = in.texture({"slidemap"});
    const int mode = in.choice({"filter_mode"}, {"blend", "replace", "add", "sub", "mix"}, 0);
    if (mode > 0)
        in.warn("unsupported-light-filter-input",
                "filter_mode of the light filter is not supported; the light is multiplied, as by "
                "blend");
    in.expect({"density"}, 0.0, "the texture acts with its full strength");
    using Outside = scene::GoboFilter::Outside;
    const auto wrap = [&](const char* name) {
        constexpr Outside modes[] = {Outside::Clamp, Outside::Repeat, Outside::Fill};
        return modes[in.choice({name}, {"clamp", "periodic", "black"}, 0)];
    };
    scene::GoboFilter gobo;
    gobo.outside = wrap("swrap");
    if (wrap("twrap") != gobo.outside)
        in.warn("unsupported-light-filter-input",
                "twrap of the light filter is not that of swrap; swrap is used for both");
    gobo.uv_scale = {float(in.number({"sscale"}, 1.0)), float(in.number({"tscale"}, 1.0))};
    gobo.uv_offset = in.pair({"offset"}, Vec2(0.0f));
    gobo.rotation_deg = float(in.number({"rotate"}, 0.0));
    if (!map) {
        site.add(scene::IntensityFilter()).tint = in.color({"slidemap"}, Rgb(1.0f));
        return;
    }
    if (!(site.light.cone_angle_deg < 90.0f)) {
        in.warn("unsupported-light-filter",
                fmt::format("the gobo needs a spot light, with a cone below 90 degrees "
                            "(shaping:cone:angle); <{}> is rendered without it",
                            site.light.prim.path_string()));
        return;
    }
    gobo.texture_file = map->file;
    gobo.texture_colors = map->colors;
    gobo.projection = {scene::FilterProjection::Kind::Point, 1.0f,
                       scene::FilterProjection::Before::Extended};
    gobo.width = gobo.height =
        float(2.0 * std::tan(double(site.light.cone_angle_deg) * pi_d / 180.0));
    site.add(gobo).parent_from_filter = spot_plane(site.light, 1.0);
}

void read_arnold_blocker(FilterSite& site) {
    FilterInputs& in = site.inputs;
    const int shape = in.choice({"geometry_type"}, {"box", "sphere", "plane", "cylinder"}, 0);
    const float roundness = std::clamp(float(in.number({"roundness"}, 0.0)), 0.0f, 1.0f);
    const char* const hard = "the edges of the region are hard";
    in.expect({"width_edge"}, 0.0, hard);
    in.expect({"height_edge"}, 0.0, hard);
    in.expect({"ramp"}, 0.0, "the region has the same density everywhere");
    in.ignore({"axis"});
    const std::optional<Mat4d> matrix = in.matrix({"geometry_matrix"});
    const double density = std::clamp(in.number({"density"}, 1.0), 0.0, 1.0);
    const Rgb color = in.color({"shader"}, Rgb(0.0f));
    if (shape >= 2) {
        in.warn("unsupported-light-filter",
                fmt::format("light blockers of geometry_type plane and cylinder are not supported; "
                            "<{}> is rendered without it",
                            site.light.prim.path_string()));
        return;
    }
    // A cube or a ball of size 1
    scene::RodFilter rod;
    rod.box.radius = shape == 1 ? 0.5f : 0.5f * roundness;
    rod.box.lower = Vec3(rod.box.radius - 0.5f);
    rod.box.upper = -rod.box.lower;
    scene::LightFilter& filter = site.add(rod);
    filter.tint = color;
    filter.density = float(density);
    if (matrix && std::abs(determinant3(*matrix)) > 0.0)
        filter.parent_from_filter = parent_from_world(site.ctx, site.light, *matrix);
}

void read_arnold_decay(FilterSite& site) {
    FilterInputs& in = site.inputs;
    const auto range = [&](const char* use, const char* start,
                           const char* end) -> std::optional<Vec2> {
        const Vec2 out(float(in.number({start}, 0.0)), float(in.number({end}, 0.0)));
        if (!in.flag({use}, false)) return std::nullopt;
        return out;
    };
    add_decay(site, range("use_near_atten", "near_start", "near_end"),
              range("use_far_atten", "far_start", "far_end"),
              scene::RampFilter::Interpolation::Smooth);
}

}  // namespace velatura::translate::lights
