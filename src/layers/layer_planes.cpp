// SPDX-License-Identifier: Apache-2.0
#include "layers/layer_planes.h"

#include "accumulate/pixel_means.h"
#include "base/tasks.h"

#include <algorithm>
#include <cmath>

namespace velatura::layers {

namespace {

/// Below this part of what a difference is made from it is rounding.
constexpr double rounding_share = 0x1p-20;

/// The sums of a tile's pixels; false where nothing came.
bool selected(const accumulate::SampleSums& sums,
              size_t tile,
              uint32_t accumulator,
              Selection selection,
              accumulate::TileTotals& totals) {
    const uint32_t half = selection == Selection::All ? accumulate::AccumulatorTable::absent
                                                      : sums.table().half_of(accumulator);
    if (selection == Selection::HalfA) return sums.tile_totals(tile, half, totals);
    if (!sums.tile_totals(tile, accumulator, totals)) return false;
    accumulate::TileTotals a;
    if (selection == Selection::HalfB && sums.tile_totals(tile, half, a))
        std::transform(totals.begin(), totals.end(), a.begin(), totals.begin(),
                       accumulate::odd_samples);
    return true;
}

/// Calls visit(pixel in the window, pixel in the tile).
template <class Visit>
void for_each_pixel(const accumulate::SampleSums& sums, size_t tile, const Visit& visit) {
    const image::Window w = sums.tile_window(tile);
    for (int y = w.y0; y < w.y1; ++y) {
        const size_t begin = sums.window().index(w.x0, y),
                     in_tile = size_t(y - w.y0) * size_t(accumulate::SampleSums::tile_size);
        for (size_t i = 0; i < size_t(w.width()); ++i) visit(begin + i, in_tile + i);
    }
}

void drop_rounding(accumulate::Triple& rest, const accumulate::Triple& whole) {
    const auto drop = [](double& r, double w) {
        if (std::abs(r) <= rounding_share * std::abs(w)) r = 0.0;
    };
    drop(rest.x, whole.x);
    drop(rest.y, whole.y);
    drop(rest.z, whole.z);
}

}  // namespace

std::vector<double> pixel_weights(const accumulate::SampleSums& sums, Selection selection) {
    std::vector<double> weights(sums.window().pixel_count());
    parallel_for(sums.tile_count(), [&](size_t tile) {
        accumulate::TileTotals coverage;
        if (!selected(sums, tile, accumulate::AccumulatorTable::coverage, selection, coverage))
            return;
        for_each_pixel(sums, tile, [&](size_t i, size_t k) {
            weights[i] = accumulate::weight_of(coverage[k]);
        });
    });
    return weights;
}

Planes layer_planes(const accumulate::SampleSums& sums,
                    const std::vector<double>& weights,
                    const accumulate::LayerSource& source,
                    Selection selection) {
    Planes planes;
    for (auto& plane : planes) plane.assign(weights.size(), 0.0f);
    parallel_for(sums.tile_count(), [&](size_t tile) {
        accumulate::TileTotals sum{}, whole{}, part;
        bool is_lit = false;
        for (const uint32_t a : source.plus) {
            if (!selected(sums, tile, a, selection, part)) continue;
            for (size_t k = 0; k < sum.size(); ++k) sum[k] += part[k];
            is_lit = true;
        }
        if (source.is_rest) whole = sum;
        for (const uint32_t a : source.minus) {
            if (!selected(sums, tile, a, selection, part)) continue;
            for (size_t k = 0; k < sum.size(); ++k) sum[k] += {-part[k].x, -part[k].y, -part[k].z};
            is_lit = true;
        }
        if (!is_lit) return;
        if (source.is_rest) {
            for (size_t k = 0; k < sum.size(); ++k) drop_rounding(sum[k], whole[k]);
        }
        for_each_pixel(sums, tile, [&](size_t i, size_t k) {
            if (weights[i] == 0.0) return;
            planes[0][i] = float(sum[k].x / weights[i]);
            planes[1][i] = float(sum[k].y / weights[i]);
            planes[2][i] = float(sum[k].z / weights[i]);
        });
    });
    return planes;
}

Extent extent_of(const Planes& planes) {
    Extent extent;
    for (const auto& plane : planes) {
        for (size_t i = 0; i < plane.size(); ++i) {
            if (!std::isfinite(plane[i])) {
                if (extent.is_finite) extent.bad_pixel = i;
                extent.is_finite = false;
            }
            extent.largest = std::max(extent.largest, std::abs(plane[i]));
        }
    }
    return extent;
}

image::Channel stored_channel(std::string name, std::vector<float> plane, image::ChannelType type) {
    image::Channel channel;
    channel.name = std::move(name);
    if (type == image::ChannelType::Half) {
        std::vector<Imath::half> half(plane.size());
        std::transform(plane.begin(), plane.end(), half.begin(),
                       [](float v) { return Imath::half(v); });
        channel.data = std::move(half);
    } else {
        channel.data = std::move(plane);
    }
    return channel;
}

}  // namespace velatura::layers
