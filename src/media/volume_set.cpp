// SPDX-License-Identifier: Apache-2.0
#include "media/volume_set.h"

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
    const Vec3& o;
    const Vec3& d;
    const Rgb& carried;
    sampling::RandomStream& numbers;
    Flight& out;
    TrackingCounts& counts;

    /// Decides what the meeting is: a collision, or nothing.
    bool collides(const TentativeCollisions& at) {
        const Medium& medium = at.medium();
        const float majorant = at.rate();
        const float extinction = medium.extinction(medium.field(at.span(), o, d, at.t()));
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
    for (const Medium& medium : media_) bounds_.extendBy(medium.bounds());
}

void VolumeSet::fly(const Vec3& o,
                    const Vec3& d,
                    float t_max,
                    const Rgb& carried,
                    const FreePath& around,
                    sampling::RandomStream numbers,
                    Flight& out,
                    TrackingCounts& counts,
                    const scene::LinkSet* visible) const {
    out.clear();
    out.around = around;
    t_max = std::min(t_max, around.end);
    thread_local std::vector<TentativeCollisions> met;
    met.clear();
    for (const Medium& medium : media_) {
        if (visible && !visible->holds(medium.link())) continue;
        float begin = 0.0f, end = t_max;
        if (medium.clip(o, d, begin, end)) met.emplace_back(medium, o, d, begin, end);
    }
    const bool is_absorbing = !is_black(around.extinction);
    Tracker tracker{o, d, carried, numbers, out, counts};
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
                const Rgb given = at->medium().emission(
                    at->medium().field(at->span(), o, d, at->t()), o + d * at->t());
                const Rgb left = is_absorbing ? around.weight_at(at->t()) : Rgb(1.0f);
                out.emitted += given * left * out.weight / at->rate();
            } else if (tracker.collides(*at)) {
                out.medium = &at->medium();
                out.t = at->t();
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
                             TrackingCounts& counts) const {
    Rgb passed(1.0f);
    uint32_t met = 0;
    for (const Medium& medium : media_) {
        if (medium.gives_light() || (casters && !casters->holds(medium.link()))) continue;
        float begin = 0.0f, end = t_max;
        if (!medium.clip(o, d, begin, end)) continue;
        BrickWalk walk = medium.walk(o, d, begin, end);
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
                const float extinction = medium.extinction(medium.field(span, o, d, float(t)));
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
