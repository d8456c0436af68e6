// SPDX-License-Identifier: Apache-2.0
#include "compositor/bake/bake_check.h"

#include "compositor/mix/mix.h"
#include "compositor/noise/noise.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

namespace velatura::compositor::bake {

namespace {

/// Agreement within this many standard errors: 1 in 16,000 by chance alone, were they normal.
constexpr double max_sigmas = 4;
/// Share of a value that rounding to half may leave in a mean.
constexpr double rounding = 1e-4;
constexpr int block_size = 8;

/// The terms of some groups, with what they refer to.
mix::MixPlan part_of(const LayerStack& stack,
                     const mix::MixPlan& plan,
                     const std::function<bool(const std::string& group)>& is_wanted) {
    mix::MixPlan part;
    part.family = plan.family;
    part.mattes = plan.mattes;
    for (const mix::MixPlan::Term& term : plan.terms) {
        const accumulate::LayerEntry* entry = stack.header().find(term.layer);
        if (entry && is_wanted(entry->group)) part.terms.push_back(term);
    }
    return part;
}

/// A mix with its window: R + G + B and the difference of its halves.
struct Grays {
    image::Window window;
    noise::MixError error;

    double value(size_t i) const {
        return double(error.mean[0][i]) + double(error.mean[1][i]) + double(error.mean[2][i]);
    }

    /// Of the sum of the channels, whose noise is common.
    double variance(size_t i) const {
        const double d = double(error.difference[0][i]) + double(error.difference[1][i]) +
                         double(error.difference[2][i]);
        return d * d * double(error.share[i]);
    }
};

struct BlockSum {
    double difference = 0, variance = 0, size = 0;
};

BakeCheckRow compare(const std::string& group, const Grays& a, const Grays& b) {
    const image::Window w{std::max(a.window.x0, b.window.x0), std::max(a.window.y0, b.window.y0),
                          std::min(a.window.x1, b.window.x1), std::min(a.window.y1, b.window.y1)};
    BakeCheckRow row;
    row.group = group;
    BlockSum all;
    std::map<std::pair<int, int>, BlockSum> blocks;
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const size_t i = a.window.index(x, y), j = b.window.index(x, y);
            const double u = a.value(i), v = b.value(j);
            row.composite += u / 3;
            row.render += v / 3;
            for (BlockSum* sum :
                 {&all, &blocks[{(x - w.x0) / block_size, (y - w.y0) / block_size}]}) {
                sum->difference += u - v;
                sum->variance += a.variance(i) + b.variance(j);
                sum->size += std::max(std::abs(u), std::abs(v));
            }
        }
    }
    row.composite /= double(w.pixel_count());
    row.render /= double(w.pixel_count());
    const double allowed = rounding * all.size;
    const double mean_error = std::sqrt(all.variance + allowed * allowed);
    if (all.difference != 0) row.mean_sigmas = std::abs(all.difference) / mean_error;
    double excess = 0, squares = 0;
    for (const auto& [place, sum] : blocks) {
        const double slack = rounding * sum.size;
        const double e = sum.difference * sum.difference - sum.variance - slack * slack;
        excess += e;
        squares += e * e;
    }
    const double count = double(blocks.size());
    const double spread = std::sqrt(std::max(squares - excess * excess / count, 0.0));
    if (excess > 0)
        row.block_sigmas = spread > 0 ? excess / spread : (count > 1 ? max_sigmas * 2 : 0);
    return row;
}

Result<Grays> grays_of(const LayerStack& stack, const mix::MixPlan& plan, const Look& look) {
    auto error = noise::mix_error(stack, plan, look);
    if (!error) return error.error();
    return Grays{stack.image().data, std::move(*error)};
}

bool tells_groups(const mix::MixPlan& plan) {
    return plan.family == "lobe-matrix" || plan.family == "matrix" || plan.family == "groups";
}

/// With all that clamps took: they would take more of a light that is turned up, so no gain
/// commutes with them, and the image that proves is rendered without.
Look without_clamps(const LayerStack& stack, Look look) {
    const auto& layers = stack.header().layers;
    const bool has_clamps = std::any_of(layers.begin(), layers.end(),
                                        [](const auto& entry) { return entry.family == "clamp"; });
    if (has_clamps) look.controls.push_back(*parse_control(Control::Kind::Clamp, "all=1"));
    return look;
}

}  // namespace

bool BakeCheckRow::agrees() const {
    return !is_compared || (mean_sigmas <= max_sigmas && block_sigmas <= max_sigmas);
}

Result<std::vector<BakeCheckRow>> check_bake(const LayerStack& mixed,
                                             const Bake& bake,
                                             const LayerStack& rendered) {
    const image::Window &u = mixed.image().data, &v = rendered.image().data;
    if (std::max(u.x0, v.x0) >= std::min(u.x1, v.x1) ||
        std::max(u.y0, v.y0) >= std::min(u.y1, v.y1))
        return Error{"diff-window", "the crop has no pixel of the file"};
    const Look look = without_clamps(mixed, bake.baked);
    const auto plan = mix::plan_mix(mixed, look), unit = mix::plan_mix(rendered, {});
    if (!plan) return plan.error();
    if (!unit) return unit.error();
    std::vector<BakeCheckRow> rows;
    const auto add = [&](const std::string& name, const mix::MixPlan& a_plan,
                         const mix::MixPlan& b_plan) -> Result<void> {
        const auto a = grays_of(mixed, a_plan, look);
        const auto b = grays_of(rendered, b_plan, {});
        if (!a) return a.error();
        if (!b) return b.error();
        rows.push_back(compare(name, *a, *b));
        return {};
    };
    const auto is_partial = [&](const std::string& group) {
        return std::find(bake.partial.begin(), bake.partial.end(), group) != bake.partial.end();
    };
    if (!tells_groups(*plan) || !tells_groups(*unit) ||
        mixed.group_names() != rendered.group_names()) {
        if (auto added = add("all", *plan, *unit); !added) return added.error();
        rows.back().is_compared = bake.partial.empty();
        return rows;
    }
    for (const std::string& group : mixed.group_names()) {
        const auto is_this = [&](const std::string& g) { return g == group; };
        if (auto added =
                add(group, part_of(mixed, *plan, is_this), part_of(rendered, *unit, is_this));
            !added)
            return added.error();
        rows.back().is_compared = !is_partial(group);
    }
    const auto is_whole = [&](const std::string& g) { return !is_partial(g); };
    if (auto added =
            add("all", part_of(mixed, *plan, is_whole), part_of(rendered, *unit, is_whole));
        !added)
        return added.error();
    return rows;
}

}  // namespace velatura::compositor::bake
