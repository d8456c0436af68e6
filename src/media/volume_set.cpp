// SPDX-License-Identifier: Apache-2.0
#include "media/volume_set.h"

#include "base/box.h"
#include "media/tentative_collisions.h"
#include "scene/effect_calls.h"

#include <algorithm>
#include <cmath>

namespace velatura::media {

namespace {

/// TentativeCollisions of one segment before it is cut, and counted: a hot voxel in much empty
/// space that is one brick with it would take minutes.
constexpr uint32_t max_tentative_collisions = 1u << 22;

/// Light below this share goes on by roulette.
constexpr float roulette_below = 1.0f / 16.0f;

Rgb exponential(const Rgb& sigma, float way) {
    return {std::exp(-sigma.x * way), std::exp(-sigma.y * way), std::exp(-sigma.z * way)};
}

float largest(const Rgb& c) {
    return std::max({std::abs(c.x), std::abs(c.y), std::abs(c.z)});
}

/// The meeting that comes first; null: none is left before the end.
TentativeCollisions* first_of(std::vector<TentativeCollisions>& all) {
    TentativeCollisions* first = nullptr;
    for (TentativeCollisions& m : all)
        if (!first || m.t() < first->t()) first = &m;
    return first;
}

void remove(std::vector<TentativeCollisions>& all, TentativeCollisions* gone) {
    *gone = all.back();
    all.pop_back();
}

/// One segment on its way.
struct Tracker {
    const Rgb& carried;
    sampling::RandomStream& numbers;
    Flight& out;
    TrackingCounts& counts;

    /// Decides what the meeting is: a collision, or nothing.
    bool collides(const TentativeCollisions& at) {
        const Medium& medium = at.medium();
        const float majorant = at.rate();
        const float extinction = medium.extinction(at.field());
        if (extinction > majorant) ++counts.violations;
        const double u = numbers.next();
        if (medium.is_gray() && extinction <= majorant)
            return u * double(majorant) < double(extinction);
        const Rgb real = medium.channels() * extinction, none = Rgb(majorant) - real;
        const Rgb beta = carried * out.weight;
        const float of_real =
            std::abs(beta.x * real.x) + std::abs(beta.y * real.y) + std::abs(beta.z * real.z);
        const float of_none =
            std::abs(beta.x * none.x) + std::abs(beta.y * none.y) + std::abs(beta.z * none.z);
        const float both = of_real + of_none;
        if (!(both > 0.0f)) return false;
        const bool is_real = u * double(both) < double(of_real);
        out.weight *= (is_real ? real : none) * (both / (majorant * (is_real ? of_real : of_none)));
        if (!is_real) out.changes.emplace_back(at.t(), out.weight);
        return is_real;
    }
};

}  // namespace

VolumeSet::VolumeSet(const scene::Scene& scene, const MediumOptions& options) {
    for (uint32_t v = 0; v < scene.volumes.size(); ++v) {
        if (const auto medium = Medium::extinction(scene, v, options)) media_.push_back(*medium);
        if (const auto medium = Medium::emission(scene, v, options)) media_.push_back(*medium);
    }
    const auto moves = [&](const Medium& medium) {
        return !scene.volumes[medium.volume()].later_render_from_volume.empty();
    };
    if (std::any_of(media_.begin(), media_.end(), moves))
        for (const Medium& medium : media_) {
            const scene::Volume& volume = scene.volumes[medium.volume()];
            motions_.emplace_back(volume.render_from_volume, volume.later_render_from_volume);
        }
    for (size_t i = 0; i < media_.size(); ++i) {
        const Box3& box = media_[i].bounds();
        bounds_.extendBy(box);
        if (motions_.empty()) continue;
        // Corners go straight on between keys
        for (const Mat4d& key : motions_[i].keys()) {
            const Box3d at_key = transformed(Box3d(Vec3d(box.min), Vec3d(box.max)), key);
            if (!at_key.isEmpty())
                bounds_.extendBy(Box3(to_float(at_key.min), to_float(at_key.max)));
        }
    }
}

std::optional<VolumeSet::CarriedRay> VolumeSet::carried_ray(size_t medium,
                                                            const Vec3& o,
                                                            const Vec3& d,
                                                            float time) const {
    if (motions_.empty() || !motions_[medium].moves()) return CarriedRay{o, d};
    scene::count_call(scene::Effect::TransformBlur);
    const scene::AffineMotion::Pose pose = motions_[medium].at(double(time));
    if (!(pose.volume > 0.0)) return std::nullopt;
    return CarriedRay{to_float(transform_point(Vec3d(o), pose.to_made)),
                      to_float(transform_direction(Vec3d(d), pose.to_made))};
}

void VolumeSet::fly(const Vec3& o,
                    const Vec3& d,
                    float t_max,
                    const Rgb& carried,
                    const FreePath& around,
                    sampling::RandomStream numbers,
                    Flight& out,
                    TrackingCounts& counts,
                    const scene::LinkSet* visible,
                    float time) const {
    out.clear();
    out.around = around;
    t_max = std::min(t_max, around.end);
    thread_local std::vector<TentativeCollisions> met;
    met.clear();
    for (size_t i = 0; i < media_.size(); ++i) {
        const Medium& medium = media_[i];
        if (visible && !visible->holds(medium.link())) continue;
        const std::optional<CarriedRay> ray = carried_ray(i, o, d, time);
        float begin = 0.0f, end = t_max;
        if (ray && medium.clip(ray->o, ray->d, begin, end))
            met.emplace_back(medium, ray->o, ray->d, begin, end);
    }
    const bool is_absorbing = !is_black(around.extinction);
    Tracker tracker{carried, numbers, out, counts};
    for (uint32_t i = 0; !met.empty(); ++i) {
        if (i == max_tentative_collisions) {
            ++counts.capped;
            out.is_capped = true;
            return;
        }
        TentativeCollisions* const at = first_of(met);
        if (at->has_begun()) {
            scene::count_call(scene::Effect::Volumes);
            if (at->medium().gives_light()) {
                const Rgb given = at->medium().emission(at->field(), at->place());
                const Rgb left = is_absorbing ? around.weight_at(at->t()) : Rgb(1.0f);
                out.emitted += given * left * out.weight / at->rate();
            } else if (tracker.collides(*at)) {
                out.medium = &at->medium();
                out.t = at->t();
                out.place = at->place();
                return;
            }
        }
        if (!at->next_collision(numbers)) remove(met, at);
    }
}

Rgb VolumeSet::transmittance(const Vec3& o,
                             const Vec3& d,
                             float t_max,
                             const scene::LinkSet* casters,
                             sampling::RandomStream& numbers,
                             TrackingCounts& counts,
                             float time) const {
    Rgb passed(1.0f);
    uint32_t met = 0;
    for (size_t i = 0; i < media_.size(); ++i) {
        const Medium& medium = media_[i];
        if (medium.gives_light() || (casters && !casters->holds(medium.link()))) continue;
        const std::optional<CarriedRay> ray = carried_ray(i, o, d, time);
        float begin = 0.0f, end = t_max;
        if (!ray || !medium.clip(ray->o, ray->d, begin, end)) continue;
        BrickWalk walk = medium.walk(ray->o, ray->d, begin, end);
        BrickSpan span;
        double certain = 0.0;  // optical way by the minorants
        double way = free_path(numbers);
        while (walk.next(span)) {
            const float min = medium.minorant(*span.brick);
            const float rate = medium.majorant(*span.brick) - min;
            certain += double(min) * (double(span.end) - double(span.begin));
            auto t = double(span.begin);
            while (rate > 0.0f) {
                const double rest = double(rate) * (double(span.end) - t);
                if (!(way < rest)) {
                    way -= rest;
                    break;
                }
                t += way / double(rate);
                way = free_path(numbers);
                scene::count_call(scene::Effect::Volumes);
                const float extinction =
                    medium.extinction(medium.field(span, ray->o, ray->d, float(t)));
                if (extinction > rate + min) ++counts.violations;
                passed *= Rgb(1.0f) - medium.channels() * ((extinction - min) / rate);
                const float max = largest(passed);
                if (++met >= max_tentative_collisions) {
                    ++counts.capped;
                    return Rgb(0.0f);
                }
                if (max >= roulette_below) continue;
                if (numbers.next() * double(roulette_below) >= double(max)) return Rgb(0.0f);
                passed *= roulette_below / max;
            }
        }
        passed *= exponential(medium.channels(), float(certain));
    }
    return passed;
}

}  // namespace velatura::media
