// SPDX-License-Identifier: Apache-2.0
#include "statistics/truncation.h"

#include "accumulate/layer_sources.h"
#include "accumulate/pixel_means.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace velatura::statistics {

namespace {

using accumulate::Triple;

/// Light by bounce: b0 … bK, then the tail.
using Light = std::vector<Triple>;

/// The light of each set of pixels; their differences tell the noise.
using Parts = std::array<Light, accumulate::interleaved_sets>;

Parts light_by_bounce(const accumulate::SampleSums& sums) {
    const std::vector<accumulate::LayerSource> sources =
        accumulate::bounce_sources(sums.layer_set(), sums.table());
    Parts parts;
    parts.fill(Light(sources.size()));
    const image::Window& w = sums.window();
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const double weight =
                accumulate::weight_of(sums.total(x, y, accumulate::AccumulatorTable::coverage));
            if (weight == 0.0) continue;
            Light& part = parts[accumulate::interleaved_set(w, x, y)];
            for (size_t column = 0; column < sources.size(); ++column) {
                for (const uint32_t a : sources[column].plus) {
                    const Triple t = sums.total(x, y, a);
                    part[column] += {t.x / weight, t.y / weight, t.z / weight};
                }
            }
        }
    }
    return parts;
}

/// r with r + r² + … + r^terms = sum; r <= 1.
double ratio_of_sum(double sum, int terms) {
    double low = 0, high = 1;
    for (int step = 0; step < 60; ++step) {
        const double r = 0.5 * (low + high);
        const double found = r * (1 - std::pow(r, terms)) / (1 - r);
        (found < sum ? low : high) = r;
    }
    return 0.5 * (low + high);
}

/// How the fall goes on: by the last ratio, by the one before (light may go to and fro), or by one
/// that changes once more as it did.
enum class Fall { Last, Before, Changing };

/// Light of one channel past the limit; negative: it does not fall.
double missing(const std::vector<double>& a, int max_depth, Fall fall) {
    const size_t last = std::min(a.size() - 2, size_t(max_depth));
    if (a[last] <= 0) return 0;
    const int terms = max_depth - int(last);
    double ratio = 0;
    if (terms > 0)
        ratio = ratio_of_sum(a.back() / a[last], terms);
    else if (fall == Fall::Last)
        ratio = a[last] / a[last - 1];
    else if (fall == Fall::Before)
        ratio = a[last - 1] / a[last - 2];
    else
        ratio = a[last] * a[last] * a[last - 2] / (a[last - 1] * a[last - 1] * a[last - 1]);
    // Light that grows from bounce to bounce has no end in sight
    return ratio < 0.9999 ? a[last] * std::pow(ratio, terms + 1) / (1 - ratio) : -1;
}

/// Share of the whole; negative: not known.
double missing_share(const Light& light, int max_depth, Fall fall) {
    double kept = 0, lost = 0;
    for (size_t c = 0; c < 3; ++c) {
        std::vector<double> a;
        for (const Triple& t : light) a.push_back(c == 0 ? t.x : c == 1 ? t.y : t.z);
        for (const double v : a) kept += v;
        const double more = missing(a, max_depth, fall);
        if (more < 0) return -1;
        lost += more;
    }
    return kept + lost > 0 ? lost / (kept + lost) : 0;
}

}  // namespace

std::optional<TruncatedLight> truncated_light(const accumulate::SampleSums& sums, int max_depth) {
    const accumulate::LayerSet& set = sums.layer_set();
    if (!set.bounce_layers && !set.matrix_layers) return std::nullopt;
    // Bounce 0 is what lights and glowing surfaces show: its ratio to the next says nothing
    const int needed = max_depth > set.last_bounce ? 1 : 3;
    if (std::min(max_depth, set.last_bounce) < needed) return std::nullopt;

    const Parts parts = light_by_bounce(sums);
    Light all(parts[0].size());
    for (const Light& part : parts) {
        for (size_t column = 0; column < all.size(); ++column) all[column] += part[column];
    }
    const double share = missing_share(all, max_depth, Fall::Last),
                 before = missing_share(all, max_depth, Fall::Before),
                 changing = missing_share(all, max_depth, Fall::Changing);
    if (share < 0) return std::nullopt;

    // Leaving out each part in turn tells the variance (Efron, Stein 1981, The jackknife estimate
    // of variance)
    double sum = 0, square = 0;
    for (const Light& part : parts) {
        Light rest = all;
        for (size_t column = 0; column < all.size(); ++column)
            rest[column] += {-part[column].x, -part[column].y, -part[column].z};
        const double s = missing_share(rest, max_depth, Fall::Last);
        if (s < 0) return std::nullopt;
        sum += s;
        square += s * s;
    }
    constexpr double n = accumulate::interleaved_sets, quantile = 1.96;
    const double deviation = std::sqrt(std::max(0.0, (square - sum * sum / n) * (n - 1) / n));
    TruncatedLight result;
    result.share = share;
    result.low =
        std::max(0.0, std::min({share, before < 0 ? 1.0 : before, changing < 0 ? 1.0 : changing}) -
                          quantile * deviation);
    result.high = before < 0 || changing < 0
                      ? 1.0
                      : std::min(1.0, std::max({share, before, changing}) + quantile * deviation);
    return result;
}

}  // namespace velatura::statistics
