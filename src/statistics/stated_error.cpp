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

std::optional<StatedError> stated_error(const accumulate::SampleSums& sums,
                                        const PointRelations& points) {
    const std::optional<RelativeError> halves = half_image_error(sums);
    if (!halves) return std::nullopt;
    if (points.has_independent_halves)
        return StatedError{.error = *halves, .is_lower = halves->is_lower};
    if (const std::optional<RelativeError> change = image_change(sums)) {
        uint64_t fewest = ~uint64_t(0), most = 0, all = 0;
        const image::Window& w = sums.window();
        for (int y = w.y0; y < w.y1; ++y) {
            for (int x = w.x0; x < w.x1; ++x) {
                const accumulate::PixelRecord& record = sums.record(x, y);
                const uint64_t own = record.end - record.first;
                fewest = std::min(fewest, own);
                most = std::max(most, own);
                all += own;
            }
        }
        const double mean = double(all) / double(w.pixel_count());
        ErrorCurve last;
        last.add({fewest, most, mean, 0, *change});
        // The first strata of a pixel are no image of their own
        if (!last.is_empty())
            return StatedError{last.error_at(mean), points.has_dependent_changes, last.is_lower()};
    }
    return StatedError{.error = *halves, .is_upper = true, .is_lower = halves->is_lower};
}

}  // namespace velatura::statistics
