// SPDX-License-Identifier: Apache-2.0
#include "statistics/image_change.h"

#include "accumulate/pixel_means.h"
#include "statistics/image_error.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace velatura::statistics {

std::optional<PixelChange> pixel_change(const accumulate::SampleSums& sums, int x, int y) {
    const accumulate::EarlierMean* earlier = sums.earlier_mean(x, y);
    if (!earlier) return std::nullopt;
    const uint64_t all = sums.record(x, y).end, first = std::bit_floor(all - 1);
    const double times = double(all - first) / double(first);
    PixelChange change;
    const double weight =
        accumulate::weight_of(sums.total(x, y, accumulate::AccumulatorTable::coverage));
    const accumulate::Triple sum = weight == 0.0
                                       ? accumulate::Triple{}
                                       : sums.total(x, y, accumulate::AccumulatorTable::beauty);
    const std::array<double, 3> values = {sum.x, sum.y, sum.z};
    for (size_t c = 0; c < 3; ++c) {
        change.now[c] = weight == 0.0 ? 0.0 : values[c] / weight;
        const double step = change.now[c] - double((*earlier)[c]);
        change.square[c] = step * step / times;
    }
    return change;
}

std::optional<RelativeError> image_change(const accumulate::SampleSums& sums) {
    const image::Window& w = sums.window();
    return image_error(w, [&](int y, size_t at, NoisyImage& strip) {
        for (int x = w.x0; x < w.x1; ++x, ++at) {
            const std::optional<PixelChange> change = pixel_change(sums, x, y);
            if (!change) return false;
            for (size_t c = 0; c < 3; ++c) {
                strip[c].mean[at] = float(change->now[c]);
                strip[c].variance[at] = float(change->square[c]);
            }
        }
        return true;
    });
}

std::array<double, 3> error_base(const accumulate::SampleSums& sums, int x, int y) {
    const image::Window& w = sums.window();
    const auto change_of = [&sums](int px, int py) {
        if (const std::optional<PixelChange> change = pixel_change(sums, px, py)) return *change;
        const accumulate::EarlierMean mean =
            accumulate::mean_of(sums.total(px, py, accumulate::AccumulatorTable::beauty),
                                sums.total(px, py, accumulate::AccumulatorTable::coverage));
        PixelChange unknown;
        for (size_t c = 0; c < 3; ++c) unknown.now[c] = double(mean[c]);
        return unknown;
    };
    std::array<Neighborhood, 3> around;
    constexpr int radius = Neighborhood::radius;
    for (int ny = std::max(w.y0, y - radius); ny <= std::min(w.y1 - 1, y + radius); ++ny) {
        for (int nx = std::max(w.x0, x - radius); nx <= std::min(w.x1 - 1, x + radius); ++nx) {
            if (nx == x && ny == y) continue;
            const PixelChange change = change_of(nx, ny);
            for (size_t c = 0; c < 3; ++c) around[c].add(change.now[c], change.square[c]);
        }
    }
    const PixelChange own = change_of(x, y);
    std::array<double, 3> base{};
    for (size_t c = 0; c < 3; ++c)
        base[c] = error_base(own.now[c], own.square[c], around[c]).likely;
    return base;
}

double net_factor(double slope) {
    // The squared change is the squared error before less that after
    return 1 / std::sqrt(std::exp2(2 * slope) - 1);
}

}  // namespace velatura::statistics
