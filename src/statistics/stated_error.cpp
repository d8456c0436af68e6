// SPDX-License-Identifier: Apache-2.0
#include "statistics/stated_error.h"

#include "accumulate/pixel_means.h"
#include "statistics/error_curve.h"
#include "statistics/image_change.h"
#include "statistics/image_error.h"

#include <algorithm>

namespace velatura::statistics {

std::optional<RelativeError> half_image_error(const accumulate::SampleSums& sums) {
    const image::Window& w = sums.window();
    const auto fill = [&](int y, size_t at, NoisyImage& strip) {
        for (int x = w.x0; x < w.x1; ++x, ++at) {
            const accumulate::PixelHalves h =
                accumulate::resolve_halves(sums, x, y, accumulate::AccumulatorTable::beauty);
            if (!h.is_known) return false;
            for (size_t c = 0; c < 3; ++c) {
                strip[c].mean[at] = float(h.mean[c]);
                strip[c].variance[at] = float(h.variance[c]);
            }
        }
        return true;
    };
    return image_error(w, fill);
}

namespace {

/// Samples of the pixels.
struct SampleCounts {
    uint64_t fewest = ~uint64_t(0), most = 0;
    double mean = 0;
};

SampleCounts counts_of(const accumulate::SampleSums& sums) {
    SampleCounts counts;
    uint64_t all = 0;
    const image::Window& w = sums.window();
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const accumulate::PixelRecord& record = sums.record(x, y);
            const uint64_t own = record.end - record.first;
            counts.fewest = std::min(counts.fewest, own);
            counts.most = std::max(counts.most, own);
            all += own;
        }
    }
    counts.mean = double(all) / double(w.pixel_count());
    return counts;
}

/// By what the samples show.
std::optional<StatedError> shown_error(const accumulate::SampleSums& sums,
                                       const PointRelations& points,
                                       const SampleCounts& counts) {
    const std::optional<RelativeError> halves = half_image_error(sums);
    if (!halves) return std::nullopt;
    if (points.has_independent_halves)
        return StatedError{.error = *halves, .is_lower = halves->is_lower};
    if (const std::optional<RelativeError> change = image_change(sums)) {
        ErrorCurve last;
        last.add({counts.fewest, counts.most, counts.mean, 0, *change});
        // The first strata of a pixel are no image of their own
        if (!last.is_empty())
            return StatedError{last.error_at(counts.mean), points.has_dependent_changes,
                               last.is_lower()};
    }
    return StatedError{.error = *halves, .is_upper = true, .is_lower = halves->is_lower};
}

}  // namespace

std::optional<StatedError> stated_error(const accumulate::SampleSums& sums,
                                        const PointRelations& points) {
    const SampleCounts counts = counts_of(sums);
    std::optional<StatedError> stated = shown_error(sums, points, counts);
    if (stated) stated->add_hidden(points.hidden, counts.mean, double(sums.window().pixel_count()));
    return stated;
}

}  // namespace velatura::statistics
