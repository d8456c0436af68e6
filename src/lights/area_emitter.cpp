// SPDX-License-Identifier: Apache-2.0
#include "lights/emitters.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::lights {
namespace {

/// Points to a side of the grid by which areas are found. Where points are uniform by area every
/// one of them tells all.
constexpr int area_steps = 8;

/// A light whose points are chosen by area, whoever looks: the classic way, to compare with. Points
/// that face away and points beyond another side of the light count as samples of value zero.
class AreaEmitter final : public Emitter {
  public:
    explicit AreaEmitter(std::unique_ptr<Emitter> shape) : shape_(std::move(shape)) {}

    std::optional<EmitterSample> sample(const Vec3d& p, const Vec2& u) const override {
        const std::optional<EmitterPoint> point = shape_->sample_point(u, std::nullopt);
        if (!point) return std::nullopt;
        const Vec3d to_light = point->p - p;
        EmitterSample s;
        s.distance = std::sqrt(to_light.dot(to_light));
        if (!(s.distance > 0.0)) return std::nullopt;
        s.wi = to_light / s.distance;
        s.Le = shape_->radiance_at(*point, p, s.wi);
        if (is_black(s.Le)) return std::nullopt;
        s.pdf = point->pdf * s.distance * s.distance / std::abs(point->n.dot(s.wi));
        return s;
    }

    /// The density stays out: lights sampled like this have no rival, see LightSetOptions::by_area.
    std::optional<EmitterHit> intersect(const Vec3d& o, const Vec3d& d) const override {
        std::optional<EmitterHit> hit = shape_->intersect(o, d);
        if (hit) hit->pdf = 0.0;
        return hit;
    }

    std::optional<EmitterPoint> sample_point(const Vec2& u,
                                             const std::optional<Vec3d>& facing) const override {
        return shape_->sample_point(u, facing);
    }

    Rgb radiance_at(const EmitterPoint& point, const Vec3d& o, const Vec3d& d) const override {
        return shape_->radiance_at(point, o, d);
    }

    double power(double scene_radius) const override { return shape_->power(scene_radius); }

    Box3d bounds() const override { return shape_->bounds(); }

    EmissionCone emission_cone() const override { return shape_->emission_cone(); }

  private:
    std::unique_ptr<Emitter> shape_;
};

}  // namespace

std::unique_ptr<Emitter> sampled_by_area(std::unique_ptr<Emitter> emitter) {
    const bool has_area =
        !emitter->is_infinite() && emitter->sample_point(Vec2(0.5f), std::nullopt);
    return has_area ? std::make_unique<AreaEmitter>(std::move(emitter)) : std::move(emitter);
}

double area_of(const Emitter& emitter) {
    if (emitter.is_infinite()) return 0.0;
    double area = 0.0;
    for (int i = 0; i < area_steps * area_steps; ++i) {
        const Vec2 u((float(i % area_steps) + 0.5f) / area_steps,
                     (float(i / area_steps) + 0.5f) / area_steps);
        const std::optional<EmitterPoint> point = emitter.sample_point(u, std::nullopt);
        if (point && point->pdf > 0.0) area += 1.0 / point->pdf / (area_steps * area_steps);
    }
    return area;
}

}  // namespace velatura::lights
