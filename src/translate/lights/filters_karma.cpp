// SPDX-License-Identifier: Apache-2.0
// Light filters of Karma.
// Ref: sidefx.com/docs/houdini, "Karma Light Filter Gel" and "Karma Light Filter Barndoor".
#include "translate/lights/light_filters.h"

#include <algorithm>

namespace velatura::translate::lights {

void read_karma_gel(FilterSite& site) {
    scene::LightFilter& filter = site.add(scene::IntensityFilter());
    filter.tint = read_tint(site, 1.0, Rgb(1.0f));
}

void read_karma_barndoor(FilterSite& site) {
    FilterInputs& in = site.inputs;
    const auto flap = [&](const char* position, const char* edge) {
        const double reach = std::clamp(in.number({position}, 0.0), 0.0, 1.0);
        return Flap{reach, reach, std::max(in.number({edge}, 0.0), 0.0)};
    };
    const Rgb tint = read_tint(site, 1.0, Rgb(1.0f));
    const bool is_inverted = in.flag({"invert"}, false);
    scene::LightFilter* const filter =
        add_flaps(site, {flap("left", "leftedge"), flap("right", "rightedge"),
                         flap("top", "topedge"), flap("bottom", "bottomedge")});
    if (filter == nullptr) return;
    filter->tint = tint;
    filter->is_inverted = is_inverted;
}

}  // namespace velatura::translate::lights
