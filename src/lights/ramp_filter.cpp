// SPDX-License-Identifier: Apache-2.0
#include "lights/filter_shapes.h"
#include "lights/length_of.h"

#include <algorithm>
#include <cmath>

namespace velatura::lights {
namespace {

/// Color of a ramp at x; the outer knots hold beyond.
Rgb ramp_color(const scene::RampFilter& ramp, double x) {
    const auto& knots = ramp.knots;
    const auto above = std::upper_bound(knots.begin(), knots.end(), x,
                                        [](double a, float b) { return a < double(b); });
    if (above == knots.begin()) return ramp.colors.front();
    if (above == knots.end()) return ramp.colors.back();
    const size_t i = size_t(above - knots.begin());
    if (ramp.interpolation == scene::RampFilter::Interpolation::Constant) return ramp.colors[i - 1];
    const double width = double(knots[i]) - double(knots[i - 1]);
    double t = (x - double(knots[i - 1])) / width;
    if (ramp.interpolation == scene::RampFilter::Interpolation::Smooth) t *= t * (3.0 - 2.0 * t);
    return ramp.colors[i - 1] + (ramp.colors[i] - ramp.colors[i - 1]) * float(t);
}

class RampLightFilter final : public LightFilter {
  public:
    RampLightFilter(const scene::RampFilter& ramp, bool is_inverted)
        : ramp_(ramp), is_inverted_(is_inverted) {}

    FilterEffect effect(const FilterSegment& segment) const override {
        const double d = distance(segment), begin = double(ramp_.begin);
        const double width = double(ramp_.end) - begin;
        const double x = width > 0.0 ? (d - begin) / width : (d < begin ? 0.0 : 1.0);
        const Rgb color = ramp_color(ramp_, x);
        return {is_inverted_ ? inverted(color) : color, 1.0f};
    }

    float max_pattern() const override {
        float most = 0.0f;
        for (const Rgb& color : ramp_.colors)
            most = std::max(most, luminance(is_inverted_ ? inverted(color) : color));
        return most;
    }

    bool leaves_some() const override { return false; }

  private:
    double distance(const FilterSegment& segment) const {
        using Measure = scene::RampFilter::Measure;
        const Vec3d& p = segment.p;
        switch (ramp_.measure) {
            case Measure::ToLight:
                return segment.distance;
            case Measure::AlongAxis:
                return -p.z;
            case Measure::FromPoint:
                return length_of(p);
            case Measure::FromAxis:
                return std::hypot(p.x, p.y);
        }
        return 0.0;
    }

    scene::RampFilter ramp_;
    bool is_inverted_;
};

}  // namespace

std::unique_ptr<LightFilter> make_ramp_filter(const scene::RampFilter& shape, bool is_inverted) {
    if (shape.knots.empty() || shape.knots.size() != shape.colors.size()) return nullptr;
    return std::make_unique<RampLightFilter>(shape, is_inverted);
}

}  // namespace velatura::lights
