// SPDX-License-Identifier: Apache-2.0
#include "lights/emitters.h"
#include "scene/effect_calls.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace velatura::lights {
namespace {

/// Share of the samples that still follow the dome alone: portals may leave openings out.
constexpr double dome_share = 0.5;

/// A dome that is seen through portals. One sample of a mixture: the dome's own sampling, and
/// directions through the portals in proportion to the solid angles that they fill; both know each
/// other's density (one-sample model of Veach 1997, 9.2.4). Portals only guide: light from beside
/// them counts as well. Where no portal faces the point it is the dome alone, bit for bit.
class PortalDome final : public Emitter {
  public:
    PortalDome(std::unique_ptr<Emitter> dome, std::vector<std::unique_ptr<Emitter>> portals)
        : dome_(std::move(dome)), portals_(std::move(portals)) {
        for (const auto& portal : portals_) centers_.push_back(portal->bounds().center());
    }

    std::optional<EmitterSample> sample(const Vec3d& p, const Vec2& u) const override {
        scene::count_call(scene::Effect::Portals);
        const double total = total_solid_angle(p);
        if (!(total > 0.0)) return dome_->sample(p, u);
        EmitterSample s;
        if (double(u.x) < dome_share) {
            const Vec2 inside(std::min(float(double(u.x) / dome_share), 0x1.fffffep-1f), u.y);
            const auto chosen = dome_->sample(p, inside);
            if (!chosen) return std::nullopt;
            s = *chosen;
            s.pdf = dome_share * s.pdf + (1.0 - dome_share) * density(p, s.wi, total);
            return s;
        }
        // Which portal, by what is left of the number
        double rest = (double(u.x) - dome_share) / (1.0 - dome_share) * total;
        size_t last = portals_.size();
        double width = 0.0;
        for (size_t i = 0; i < portals_.size(); ++i) {
            const double omega = solid_angle(i, p);
            if (!(omega > 0.0)) continue;
            if (last < portals_.size()) rest -= width;
            last = i;
            width = omega;
            if (rest < width) break;
        }
        const Vec2 inside(std::clamp(float(rest / width), 0.0f, 0x1.fffffep-1f), u.y);
        const auto through = portals_[last]->sample(p, inside);
        if (!through) return std::nullopt;
        const auto hit = dome_->intersect(p, through->wi);
        if (!hit) return std::nullopt;
        s.wi = through->wi;
        s.distance = std::numeric_limits<double>::infinity();
        s.Le = hit->Le;
        s.pdf = dome_share * hit->pdf + (1.0 - dome_share) * density(p, s.wi, total);
        return s;
    }

    std::optional<EmitterHit> intersect(const Vec3d& o, const Vec3d& d) const override {
        std::optional<EmitterHit> hit = dome_->intersect(o, d);
        const double total = total_solid_angle(o);
        if (!hit || !(total > 0.0)) return hit;
        hit->pdf = dome_share * hit->pdf + (1.0 - dome_share) * density(o, d, total);
        return hit;
    }

    double power(double scene_radius) const override { return dome_->power(scene_radius); }

    bool is_infinite() const override { return true; }

  private:
    /// Of a portal seen from its lit side, as its density towards the middle has it; else 0.
    double solid_angle(size_t portal, const Vec3d& p) const {
        const Vec3d to_center = centers_[portal] - p;
        if (to_center == Vec3d(0.0)) return 0.0;
        const auto hit = portals_[portal]->intersect(p, normalize(to_center));
        return hit && hit->pdf > 0.0 && std::isfinite(hit->pdf) ? 1.0 / hit->pdf : 0.0;
    }

    double total_solid_angle(const Vec3d& p) const {
        double total = 0.0;
        for (size_t i = 0; i < portals_.size(); ++i) total += solid_angle(i, p);
        return total;
    }

    /// Of directions through the portals.
    double density(const Vec3d& p, const Vec3d& wi, double total) const {
        double sum = 0.0;
        for (size_t i = 0; i < portals_.size(); ++i) {
            const auto hit = portals_[i]->intersect(p, wi);
            if (hit) sum += hit->pdf * solid_angle(i, p) / total;
        }
        return sum;
    }

    std::unique_ptr<Emitter> dome_;
    std::vector<std::unique_ptr<Emitter>> portals_;  // rectangles of radiance 1
    std::vector<Vec3d> centers_;
};

}  // namespace

std::unique_ptr<Emitter> with_portals(std::unique_ptr<Emitter> dome,
                                      std::vector<std::unique_ptr<Emitter>> portals) {
    return std::make_unique<PortalDome>(std::move(dome), std::move(portals));
}

}  // namespace velatura::lights
