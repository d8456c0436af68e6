// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/light_filter.h"
#include "translate/context/context.h"
#include "translate/lights/filter_inputs.h"

#include <optional>
#include <utility>
#include <vector>

namespace velatura::translate::lights {

/// The filters of a light, in the order in which they act: targets of `light:filters`, those that
/// `primvars:arnold:shaders` connects, for Houdini's barn doors the light itself. They need not be
/// of a kind that is known.
std::vector<Prim> filter_prims(Context& ctx, Prim light);

/// Whether the prim is a light filter by its type, of whatever renderer: who reads it checks its
/// attributes.
bool is_light_filter(Prim prim);

/// What a light tells its filters.
struct FilteredLight {
    Prim prim;
    Mat4d parent_from_light;     ///< see scene::LightFilter::parent_from_filter
    float cone_angle_deg = 180;  ///< half angle; 180: no cone
};

/// Translates the filters of the light. Those of kinds that are not known are left out with a
/// warning.
std::vector<scene::LightFilter> read_filters(Context& ctx, const FilteredLight& light);

/// A filter that is being read.
struct FilterSite {
    Context& ctx;
    const FilteredLight& light;
    FilterInputs& inputs;
    Mat4d parent_from_filter;
    std::vector<scene::LightFilter>& out;

    /// Appends a filter of that shape, at parent_from_filter.
    scene::LightFilter& add(scene::FilterShape shape) const {
        scene::LightFilter filter;
        filter.name = inputs.filter().path_string();
        filter.parent_from_filter = parent_from_filter;
        filter.shape = std::move(shape);
        out.push_back(std::move(filter));
        return out.back();
    }
};

// One reader per kind and renderer; light_filters.cpp has the table

void read_ri_intensity(FilterSite& site);
void read_ri_barn(FilterSite& site);
void read_ri_rod(FilterSite& site);
void read_ri_ramp(FilterSite& site);
void read_ri_cookie(FilterSite& site);

void read_arnold_barndoor(FilterSite& site);
void read_arnold_gobo(FilterSite& site);
void read_arnold_blocker(FilterSite& site);
void read_arnold_decay(FilterSite& site);

void read_moonray_intensity(FilterSite& site);
void read_moonray_barn(FilterSite& site);
void read_moonray_rod(FilterSite& site);
void read_moonray_ramp(FilterSite& site);
void read_moonray_decay(FilterSite& site);
void read_moonray_cookie(FilterSite& site);

void read_karma_gel(FilterSite& site);
void read_karma_barndoor(FilterSite& site);

// What the readers share

/// What stands at `world` in the namespace, in the space that the light is in: a light that an
/// instance places takes its filters along.
Mat4d parent_from_world(Context& ctx, const FilteredLight& light, const Mat4d& world);

/// Up to two ramps that fade the light in and out by distance from the light.
void add_decay(FilterSite& site,
               const std::optional<Vec2>& near,
               const std::optional<Vec2>& far,
               scene::RampFilter::Interpolation interpolation);

/// Tint of what lets through intensity · 2^exposure · color.
Rgb read_tint(FilterSite& site, double default_intensity, const Rgb& default_color);

/// Flaps in front of a spot light, as parts of the square around its cone: how far each end of a
/// side's flap reaches in, and the width of its soft edge, which lies inside of the flap.
struct Flap {
    double first = 0.0, second = 0.0;  ///< left and right end, or top and bottom end
    double edge = 0.0;

    bool is_open() const { return first <= 0.0 && second <= 0.0 && edge <= 0.0; }
};

struct Flaps {
    Flap left, right, top, bottom;
};

/// Null, with a warning, when the light has no cone below 90 degrees.
scene::LightFilter* add_flaps(FilterSite& site, const Flaps& flaps);

/// The matrix by which filters look along a spot light's −Z from one unit before it, with the
/// apex of FilterProjection::Point in the light.
Mat4d spot_plane(const FilteredLight& light, double distance);

}  // namespace velatura::translate::lights
