// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "lights/environment_image.h"
#include "scene/light_filter.h"

#include <functional>
#include <memory>
#include <vector>

namespace velatura::lights {

/// The way from a receiver to a point of a light.
struct FilterSegment {
    Vec3d p;              ///< receiver
    Vec3d wi;             ///< p + wi · distance is the point of the light; unit in render space
    double distance = 0;  ///< [scene units]; infinity for lights at infinity
};

/// What a filter does to the light of a segment.
struct FilterEffect {
    Rgb pattern = Rgb(1.0f);  ///< multiplies the radiance, with the filter's tint
    float reach = 1.0f;       ///< [0, 1], how much of that acts
};

/// One light filter, ready to be evaluated. Segments are in filter space; their distance stays that
/// of render space.
class LightFilter {
  public:
    virtual ~LightFilter() = default;
    virtual FilterEffect effect(const FilterSegment& segment) const = 0;

    /// Luminance that no pattern exceeds by much.
    virtual float max_pattern() const { return 1.0f; }

    /// True when segments exist that the filter leaves alone.
    virtual bool leaves_some() const { return true; }
};

/// Reads the texture of a gobo; null with a message where that fails.
using GoboLoader =
    std::function<std::shared_ptr<const EnvironmentImage>(const scene::GoboFilter& gobo)>;

/// One maker per kind: `is_inverted` of the filter is their part, tint, saturation and density are
/// FilterChain's. Null: the filter does nothing.
std::unique_ptr<LightFilter> make_intensity_filter(const scene::IntensityFilter& shape);
std::unique_ptr<LightFilter> make_ramp_filter(const scene::RampFilter& shape, bool is_inverted);
std::unique_ptr<LightFilter> make_rod_filter(const scene::RodFilter& shape, bool is_inverted);
std::unique_ptr<LightFilter> make_barn_door_filter(const scene::BarnDoorFilter& shape,
                                                   bool is_inverted);
std::unique_ptr<LightFilter> make_gobo_filter(const scene::GoboFilter& shape,
                                              bool is_inverted,
                                              std::shared_ptr<const EnvironmentImage> image);

/// Filters of one light, one behind the other.
class FilterChain {
  public:
    /// Changes nothing.
    FilterChain() = default;
    /// Args: render_from_parent: see scene::LightFilter::parent_from_filter.
    FilterChain(const std::vector<scene::LightFilter>& filters,
                const Mat4d& render_from_parent,
                const GoboLoader& load);

    bool is_empty() const { return links_.empty(); }

    /// Radiance that arrives at the receiver of what the light emits towards it.
    Rgb apply(Rgb Le, const FilterSegment& segment) const;

    /// About the largest factor of the luminance, for choices among lights; > 0.
    double peak() const { return peak_; }

  private:
    struct Link {
        Mat4d filter_from_render;
        Rgb tint;
        float saturation, density;
        std::unique_ptr<LightFilter> filter;
    };

    std::vector<Link> links_;
    double peak_ = 1.0;
};

}  // namespace velatura::lights
