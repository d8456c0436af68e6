// SPDX-License-Identifier: Apache-2.0
#include "lights/light_filter.h"
#include "scene/effect_calls.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

namespace velatura::lights {
namespace {

/// What a light keeps of its power for choices, however dark its filters: no bound holds where a
/// pattern goes beyond what was guessed.
constexpr double min_peak = 1e-3;

std::unique_ptr<LightFilter> make(const scene::LightFilter& filter, const GoboLoader& load) {
    const bool inverted = filter.is_inverted;

    struct Maker {
        bool inverted;
        const GoboLoader& load;

        std::unique_ptr<LightFilter> operator()(const scene::IntensityFilter& shape) const {
            return make_intensity_filter(shape);
        }

        std::unique_ptr<LightFilter> operator()(const scene::RampFilter& shape) const {
            return make_ramp_filter(shape, inverted);
        }

        std::unique_ptr<LightFilter> operator()(const scene::RodFilter& shape) const {
            return make_rod_filter(shape, inverted);
        }

        std::unique_ptr<LightFilter> operator()(const scene::BarnDoorFilter& shape) const {
            return make_barn_door_filter(shape, inverted);
        }

        std::unique_ptr<LightFilter> operator()(const scene::GoboFilter& shape) const {
            return make_gobo_filter(shape, inverted, load(shape));
        }
    };

    return std::visit(Maker{inverted, load}, filter.shape);
}

class ConstantFilter final : public LightFilter {
  public:
    FilterEffect effect(const FilterSegment&) const override { return {}; }

    bool leaves_some() const override { return false; }
};

}  // namespace

std::unique_ptr<LightFilter> make_intensity_filter(const scene::IntensityFilter&) {
    return std::make_unique<ConstantFilter>();
}

FilterChain::FilterChain(const std::vector<scene::LightFilter>& filters,
                         const Mat4d& render_from_parent,
                         const GoboLoader& load) {
    for (const scene::LightFilter& filter : filters) {
        std::unique_ptr<LightFilter> made = make(filter, load);
        if (!made) continue;
        const double changed = double(luminance(filter.tint)) * double(made->max_pattern());
        const double largest = made->leaves_some() ? std::max(1.0, changed) : changed;
        peak_ *= 1.0 + (largest - 1.0) * double(filter.density);
        links_.push_back({(filter.parent_from_filter * render_from_parent).inverse(), filter.tint,
                          filter.saturation, filter.density, std::move(made)});
    }
    // Written so that NaN is caught
    if (!(peak_ > min_peak)) peak_ = min_peak;
}

Rgb FilterChain::apply(Rgb Le, const FilterSegment& segment) const {
    for (const Link& link : links_) {
        scene::count_call(scene::Effect::LightFilters);
        const FilterSegment local{transform_point(segment.p, link.filter_from_render),
                                  transform_direction(segment.wi, link.filter_from_render),
                                  segment.distance};
        const FilterEffect effect = link.filter->effect(local);
        const float share = effect.reach * link.density;
        if (!(share > 0.0f)) continue;
        if (link.saturation != 1.0f) {
            const float gray = luminance(Le), s = 1.0f + (link.saturation - 1.0f) * share;
            for (int c = 0; c < 3; ++c) Le[c] = std::max(gray + (Le[c] - gray) * s, 0.0f);
        }
        const Rgb factor = effect.pattern * link.tint;
        // Without a blend the factor is exact
        Le *= share < 1.0f ? Rgb(1.0f) + (factor - Rgb(1.0f)) * share : factor;
    }
    return Le;
}

}  // namespace velatura::lights
