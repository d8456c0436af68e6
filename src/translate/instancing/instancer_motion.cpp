// SPDX-License-Identifier: Apache-2.0
#include "translate/instancing/instancer_motion.h"

#include "translate/context/instance_source.h"
#include "translate/instancing/placement_motion.h"
#include "translate/motion/scoped_time.h"
#include "translate/motion/shutter.h"
#include "translate/motion/unblurred.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

namespace velatura::translate::instancing {

namespace {

/// The motion of the instances of one prim, level by level of ever more segments.
class InstancerKeys {
  public:
    InstancerKeys(Context& ctx,
                  Prim instancer,
                  const MovingRows& places,
                  const InstanceSource& parent,
                  const PlacedInstances& placed,
                  const Shutter& shutter)
        : ctx_(ctx),
          instancer_(instancer),
          places_(places),
          holder_(parent),
          placed_(placed),
          shutter_(shutter) {}

    void run() {
        const State opening = state_at(0);
        std::vector<size_t> curved(placed_.placements.size());
        std::iota(curved.begin(), curved.end(), size_t(0));
        for (size_t segments =
                 fewest_segments(places_.sample_times(), instancer_, holder_.frame, shutter_);
             !curved.empty(); segments *= 2) {
            std::vector<size_t> straight, rest;
            read_level(opening, segments, curved, straight, rest);
            const bool is_last = 2 * segments > motion::max_segments;
            for (const size_t i : straight) finish(opening, i);
            if (is_last)
                for (const size_t i : rest) finish(opening, i);
            curved = is_last ? std::vector<size_t>() : std::move(rest);
        }
        warn_color();
    }

  private:
    /// All instances at one time.
    struct State {
        InstanceRows rows;
        Mat4d holder_from_instancer;
    };

    State state_at(double way) const {
        const motion::ScopedTime at(ctx_, shutter_.open + way * (shutter_.close - shutter_.open));
        return {places_.at(ctx_.time),
                relative_to(motion::carried_by(ctx_, instancer_, holder_.frame, ctx_.time),
                            holder_.origin)};
    }

    Mat4d matrix(const State& state, size_t i) const {
        const Vec3d nowhere(0.0);
        return between_origins(state.rows.matrix(placed_.numbers[i]),
                               placed_.placements[i].what->origin, nowhere) *
               state.holder_from_instancer;
    }

    /// Gives the instances `wanted` keys, and says which need no more of them.
    void read_level(const State& opening,
                    size_t segments,
                    const std::vector<size_t>& wanted,
                    std::vector<size_t>& straight,
                    std::vector<size_t>& rest) {
        std::vector<bool> strayed(placed_.placements.size());
        for (const size_t i : wanted) placed_.placements[i].later.clear();
        State from = opening;
        for (size_t k = 0; k < segments; ++k) {
            const double step = 1.0 / double(segments), way = double(k) * step;
            State to = state_at(double(k + 1) * step);
            for (const double f : ways_between) {
                const State halfway = state_at(way + f * step);
                for (const size_t i : wanted) {
                    if (strayed[i]) continue;
                    const Mat4d line = between(matrix(from, i), matrix(to, i), f);
                    strayed[i] =
                        strays(matrix(halfway, i), line, reach_of(*placed_.placements[i].what));
                }
            }
            for (const size_t i : wanted) placed_.placements[i].later.push_back(matrix(to, i));
            from = std::move(to);
        }
        for (const size_t i : wanted) (strayed[i] ? rest : straight).push_back(i);
    }

    /// Keeps the keys of an instance that moves and may.
    void finish(const State& opening, size_t i) {
        Placement& placement = placed_.placements[i];
        std::vector<Mat4d> later = std::move(placement.later);
        placement.later.clear();
        const Mat4d first = matrix(opening, i);
        if (std::all_of(later.begin(), later.end(), [&](const Mat4d& m) { return m == first; }))
            return;
        if (!fits_floats(first) || !std::all_of(later.begin(), later.end(), fits_floats)) {
            ++lost_;
        } else {
            placement.matrix = first;
            placement.later = std::move(later);
        }
    }

    void warn_color() const {
        if (lost_ > 0)
            ctx_.warn("unsupported-motion-blur", instancer_,
                      fmt::format("{} instances have non-finite transforms while the shutter is "
                                  "open; they are rendered without motion blur, at the frame time",
                                  lost_));
    }

    Context& ctx_;
    Prim instancer_;
    const MovingRows& places_;
    const InstanceSource& holder_;
    PlacedInstances placed_;
    Shutter shutter_;
    size_t lost_ = 0;
};

}  // namespace

void read_instancer_motion(Context& ctx,
                           Prim instancer,
                           const Mat4d& matrix,
                           const InstancerPlaces& places,
                           const InstanceSource& parent,
                           const PlacedInstances& placed) {
    const bool can_move = places.can_move() || motion::can_be_carried(ctx, instancer, parent.frame);
    if (!ctx.shutter || placed.placements.empty() || !can_move) return;
    const std::optional<Shutter> shutter = motion::shutter_of(ctx, instancer);
    if (!shutter) return;
    // Joints above may carry it, where its own transforms say nothing of that
    if (motion::carried_by(ctx, instancer, parent.frame, ctx.frame) != matrix) {
        motion::warn_if_it_moves(ctx, instancer, parent.frame);
        return;
    }
    if (places.is_renumbered(*shutter)) {
        constexpr const char* why = "its instances change while the shutter is open";
        ctx.note_not_simulated(scene::Effect::TransformBlur, instancer, why);
        ctx.warn("unsupported-motion-blur", instancer,
                 fmt::format("{}, and there are no velocities; they are rendered without motion "
                             "blur, at the frame time",
                             why));
        return;
    }
    read_keys(ctx, instancer, places, parent, placed, *shutter);
}

void read_keys(Context& ctx,
               Prim prim,
               const MovingRows& rows,
               const InstanceSource& parent,
               const PlacedInstances& placed,
               const Shutter& shutter) {
    InstancerKeys(ctx, prim, rows, parent, placed, shutter).run();
}

}  // namespace velatura::translate::instancing
