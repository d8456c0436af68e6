// SPDX-License-Identifier: Apache-2.0
#include "lights/filter_shapes.h"

namespace velatura::lights {
namespace {

class RodLightFilter final : public LightFilter {
  public:
    RodLightFilter(const scene::RodFilter& rod, bool is_inverted)
        : box_(rod.box), is_inverted_(is_inverted) {}

    FilterEffect effect(const FilterSegment& segment) const override {
        const double inside = coverage(box_, segment.p);
        return {Rgb(1.0f), float(is_inverted_ ? 1.0 - inside : inside)};
    }

  private:
    scene::RoundedBox box_;
    bool is_inverted_;
};

}  // namespace

std::unique_ptr<LightFilter> make_rod_filter(const scene::RodFilter& shape, bool is_inverted) {
    return std::make_unique<RodLightFilter>(shape, is_inverted);
}

}  // namespace velatura::lights
