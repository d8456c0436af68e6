// SPDX-License-Identifier: Apache-2.0
#include "accumulate/pixel_means.h"

#include "base/tasks.h"

#include <cmath>

namespace velatura::accumulate {

Triple odd_samples(const Triple& all, const Triple& even) {
    return {all.x - even.x, all.y - even.y, all.z - even.z};
}

void for_each_row(const image::Window& w, const std::function<void(int)>& body) {
    parallel_for(size_t(w.height()), [&](size_t row) { body(w.y0 + int(row)); });
}

double clamped_share(const SampleSums& sums) {
    if (!sums.layer_set().has_clamp()) return 0.0;
    const uint32_t clamped = sums.table().clamped(AccumulatorTable::beauty);
    double all = 0, taken = 0;
    const image::Window& w = sums.window();
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const double weight = weight_of(sums.total(x, y, AccumulatorTable::coverage));
            if (weight == 0.0) continue;
            const Triple whole = sums.total(x, y, AccumulatorTable::beauty),
                         t = sums.total(x, y, clamped);
            all += (whole.x + whole.y + whole.z) / weight;
            taken += (t.x + t.y + t.z) / weight;
        }
    }
    return all > 0.0 ? taken / all : 0.0;
}

double weight_of(const Triple& coverage) {
    const double weight = coverage.y, count = coverage.z;
    return std::abs(weight) < 0.1 * count ? count : weight;
}

EarlierMean mean_of(const Triple& sum, const Triple& coverage) {
    const double weight = weight_of(coverage);
    if (weight == 0.0) return {};
    return {float(sum.x / weight), float(sum.y / weight), float(sum.z / weight)};
}

PixelHalves resolve_halves(const SampleSums& sums, int x, int y, uint32_t accumulator) {
    PixelHalves result;
    const Triple coverage = sums.total(x, y, AccumulatorTable::coverage);
    const AccumulatorTable& table = sums.table();
    const Triple coverage_a = sums.total(x, y, table.half_of(AccumulatorTable::coverage));
    const Triple coverage_b = odd_samples(coverage, coverage_a);
    const Triple all = sums.total(x, y, accumulator);
    const Triple a = sums.total(x, y, table.half_of(accumulator)), b = odd_samples(all, a);
    const auto mean = [](const Triple& sum, const Triple& c) {
        const double w = weight_of(c);
        return w == 0.0 ? std::array<double, 3>{}
                        : std::array<double, 3>{sum.x / w, sum.y / w, sum.z / w};
    };
    result.mean = mean(all, coverage);
    result.a = mean(a, coverage_a);
    result.b = mean(b, coverage_b);
    result.is_known = coverage_a.z > 0 && coverage_b.z > 0;
    if (!result.is_known) return result;
    // Var(A − B) = s²/nA + s²/nB and Var(mean) = s²/(nA + nB); for equal halves the factor is 1/4
    const double factor = coverage_a.z * coverage_b.z / (coverage.z * coverage.z);
    for (size_t c = 0; c < 3; ++c) {
        const double difference = result.a[c] - result.b[c];
        result.variance[c] = difference * difference * factor;
    }
    return result;
}

std::vector<float> resolve_rgba(const SampleSums& sums) {
    const image::Window& w = sums.window();
    std::vector<float> rgba(4 * w.pixel_count(), 0.0f);
    for_each_row(w, [&](int y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const Triple coverage = sums.total(x, y, AccumulatorTable::coverage);
            const double weight = weight_of(coverage);
            if (weight == 0.0) continue;
            const Triple sum = sums.total(x, y, AccumulatorTable::beauty);
            float* out = &rgba[4 * w.index(x, y)];
            out[0] = float(sum.x / weight);
            out[1] = float(sum.y / weight);
            out[2] = float(sum.z / weight);
            out[3] = float(coverage.x / weight);
        }
    });
    return rgba;
}

}  // namespace velatura::accumulate
