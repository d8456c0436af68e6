// SPDX-License-Identifier: Apache-2.0
#include "lights/emitters.h"
#include "lights/length_of.h"

#include <limits>
#include <utility>

namespace velatura::lights {
namespace {

/// A light behind filters. They change radiance by the segment between the point of the light and
/// the receiver, the same for every strategy; densities stay those of the light. Bounds and powers
/// stay those of the light but for the largest factor: a light that filters darken is chosen too
/// often, never too rarely to be found.
class FilteredEmitter final : public Emitter {
  public:
    FilteredEmitter(std::unique_ptr<Emitter> light, FilterChain filters)
        : light_(std::move(light)), filters_(std::move(filters)) {}

    std::optional<EmitterSample> sample(const Vec3d& p, const Vec2& u) const override {
        std::optional<EmitterSample> s = light_->sample(p, u);
        if (s) s->Le = filters_.apply(s->Le, {p, s->wi, s->distance});
        return s;
    }

    std::optional<EmitterHit> intersect(const Vec3d& o, const Vec3d& d) const override {
        std::optional<EmitterHit> hit = light_->intersect(o, d);
        if (hit) hit->Le = filters_.apply(hit->Le, {o, d, hit->t});
        return hit;
    }

    std::optional<EmitterPoint> sample_point(const Vec2& u,
                                             const std::optional<Vec3d>& facing) const override {
        return light_->sample_point(u, facing);
    }

    Rgb radiance_at(const EmitterPoint& point, const Vec3d& o, const Vec3d& d) const override {
        const Rgb Le = light_->radiance_at(point, o, d);
        if (is_black(Le)) return Le;
        const double distance = light_->is_infinite() ? std::numeric_limits<double>::infinity()
                                                      : length_of(point.p - o);
        return filters_.apply(Le, {o, d, distance});
    }

    double power(double scene_radius) const override {
        return light_->power(scene_radius) * filters_.peak();
    }

    double sampled_share() const override { return light_->sampled_share(); }

    bool is_infinite() const override { return light_->is_infinite(); }

    bool is_delta() const override { return light_->is_delta(); }

    Box3d bounds() const override { return light_->bounds(); }

    EmissionCone emission_cone() const override {
        EmissionCone cone = light_->emission_cone();
        cone.intensity *= filters_.peak();
        return cone;
    }

    const Emitter& unfiltered() const override { return *light_; }

  private:
    std::unique_ptr<Emitter> light_;
    FilterChain filters_;
};

}  // namespace

std::unique_ptr<Emitter> with_filters(std::unique_ptr<Emitter> light, FilterChain filters) {
    return std::make_unique<FilteredEmitter>(std::move(light), std::move(filters));
}

}  // namespace velatura::lights
