// SPDX-License-Identifier: Apache-2.0
#include "image/picture_change.h"

#include "image/pixel_means.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <vector>

namespace velatura::image {

namespace {

/// What the changes of some pixels sum to, by the set that they are dealt to.
struct Sums {
    std::array<double, interleaved_sets> squares{}, counts{};
};

using Changes = std::vector<PixelChange>;

/// Nothing unless all are known.
std::optional<Changes> changes_of(const SampleSums& sums) {
    const Window& w = sums.window();
    Changes changes(w.pixel_count());
    std::atomic<bool> is_known = true;
    for_each_row(w, [&](int y) {
        for (int x = w.x0; x < w.x1 && is_known.load(std::memory_order_relaxed); ++x) {
            const std::optional<PixelChange> change = pixel_change(sums, x, y);
            if (change)
                changes[w.index(x, y)] = *change;
            else
                is_known = false;
        }
    });
    if (!is_known) return std::nullopt;
    return changes;
}

using Rgb3 = std::array<double, 3>;

/// Calls visit(x, y) for the pixel and its neighbours that there are.
template <class Visit>
void for_neighbourhood(const Window& w, int x, int y, const Visit& visit) {
    for (int ny = std::max(w.y0, y - 1); ny <= std::min(w.y1 - 1, y + 1); ++ny)
        for (int nx = std::max(w.x0, x - 1); nx <= std::min(w.x1 - 1, x + 1); ++nx) visit(nx, ny);
}

/// The fourth brightest neighbour in a channel; 0 where there are fewer.
template <class MeanAt>
double fourth_brightest(const Window& w, int x, int y, size_t channel, const MeanAt& mean_at) {
    std::array<double, 4> brightest{};  // falling
    for_neighbourhood(w, x, y, [&](int nx, int ny) {
        if (nx == x && ny == y) return;
        double rest = mean_at(nx, ny)[channel];
        for (double& kept : brightest) {
            const double larger = std::max(kept, rest);
            rest = std::min(kept, rest);
            kept = larger;
        }
    });
    return brightest.back();
}

/// What errors of the pixel are relative to; mean_at(x, y) gives RGB.
template <class MeanAt>
Rgb3 base_of(const Window& w, int x, int y, const MeanAt& mean_at) {
    Rgb3 sum{};
    double count = 0;
    for_neighbourhood(w, x, y, [&](int nx, int ny) {
        const Rgb3& mean = mean_at(nx, ny);
        count += 1;
        for (size_t c = 0; c < 3; ++c) sum[c] += mean[c];
    });
    Rgb3 base = mean_at(x, y);
    for (size_t c = 0; c < 3; ++c) {
        const double around = sum[c] / count;
        // Below the mean of all it is its own base, whatever the brightest are
        if (base[c] > around)
            base[c] = std::min(base[c], std::max(fourth_brightest(w, x, y, c, mean_at), around));
    }
    return base;
}

}  // namespace

std::optional<PixelChange> pixel_change(const SampleSums& sums, int x, int y) {
    const EarlierMean* earlier = sums.earlier_mean(x, y);
    if (!earlier) return std::nullopt;
    const uint64_t all = sums.record(x, y).end, first = std::bit_floor(all - 1);
    const double times = double(all - first) / double(first);
    PixelChange change;
    const double weight = weight_of(sums.total(x, y, AccumulatorTable::coverage));
    const Triple sum = weight == 0.0 ? Triple{} : sums.total(x, y, AccumulatorTable::beauty);
    const std::array<double, 3> values = {sum.x, sum.y, sum.z};
    for (size_t c = 0; c < 3; ++c) {
        change.now[c] = weight == 0.0 ? 0.0 : values[c] / weight;
        const double step = change.now[c] - double((*earlier)[c]);
        change.square[c] = step * step / times;
    }
    return change;
}

std::optional<RelativeError> picture_change(const SampleSums& sums) {
    const std::optional<Changes> changes = changes_of(sums);
    if (!changes) return std::nullopt;
    const Window& w = sums.window();
    std::vector<Sums> rows(size_t(w.height()));
    for_each_row(w, [&](int y) {
        Sums& row = rows[size_t(y - w.y0)];
        for (int x = w.x0; x < w.x1; ++x) {
            const size_t set = interleaved_set(w, x, y);
            const Rgb3 base = base_of(w, x, y, [&](int nx, int ny) -> const Rgb3& {
                return (*changes)[w.index(nx, ny)].now;
            });
            for (size_t c = 0; c < 3; ++c)
                row.squares[set] += relative_square((*changes)[w.index(x, y)].square[c], base[c]);
            row.counts[set] += 3;
        }
    });
    Sums all;
    for (const Sums& row : rows) {
        for (size_t set = 0; set < interleaved_sets; ++set) {
            all.squares[set] += row.squares[set];
            all.counts[set] += row.counts[set];
        }
    }
    RelativeErrorSum error;
    for (size_t set = 0; set < interleaved_sets; ++set)
        error.add_tile(all.squares[set], all.counts[set]);
    return error.result();
}

std::array<double, 3> error_base(const SampleSums& sums, int x, int y) {
    return base_of(sums.window(), x, y, [&](int nx, int ny) -> Rgb3 {
        const EarlierMean mean = mean_of(sums.total(nx, ny, AccumulatorTable::beauty),
                                         sums.total(nx, ny, AccumulatorTable::coverage));
        return {double(mean[0]), double(mean[1]), double(mean[2])};
    });
}

double net_factor(double slope) {
    // The squared change is the squared error before less that after
    return 1 / std::sqrt(std::exp2(2 * slope) - 1);
}

}  // namespace velatura::image
