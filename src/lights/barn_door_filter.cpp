// SPDX-License-Identifier: Apache-2.0
#include "lights/filter_shapes.h"

#include <optional>

namespace velatura::lights {
namespace {

class BarnDoorLightFilter final : public LightFilter {
  public:
    BarnDoorLightFilter(const scene::BarnDoorFilter& doors, bool is_inverted)
        : doors_(doors), is_inverted_(is_inverted) {}

    FilterEffect effect(const FilterSegment& segment) const override {
        const std::optional<PlaneCrossing> at = plane_crossing(doors_.projection, segment);
        if (!at) return {Rgb(1.0f), 0.0f};
        if (at->is_black) return {Rgb(0.0f), 1.0f};
        const float lit = float(coverage(opening_at(at->point), {at->point.x, at->point.y, 0.0}));
        return {Rgb(is_inverted_ ? 1.0f - lit : lit), 1.0f};
    }

  private:
    /// The opening, as its turned sides leave it in the row and column of the point.
    scene::RoundedBox opening_at(const Vec2d& p) const {
        scene::RoundedBox opening = doors_.opening;
        for (int i = 0; i < 2; ++i) {
            const auto other = float(p[1 - i]);
            opening.lower[i] += doors_.slope_lower[i] * other;
            opening.upper[i] += doors_.slope_upper[i] * other;
        }
        return opening;
    }

    scene::BarnDoorFilter doors_;
    bool is_inverted_;
};

}  // namespace

std::unique_ptr<LightFilter> make_barn_door_filter(const scene::BarnDoorFilter& shape,
                                                   bool is_inverted) {
    return std::make_unique<BarnDoorLightFilter>(shape, is_inverted);
}

}  // namespace velatura::lights
