// SPDX-License-Identifier: Apache-2.0
#include "accel/ray_stream.h"

#include "base/check.h"

#include <algorithm>
#include <chrono>
#include <limits>

namespace velatura::accel {

RayStream::RayStream(const Accelerator& accelerator)
    : accelerator_(accelerator), next_trial_(accelerator.has_batches() ? 0 : last_trial) {}

template <class OneByOne, class SideBySide>
void RayStream::trace(size_t count, const OneByOne& one_by_one, const SideBySide& side_by_side) {
    if (!has_chosen() && count >= smallest_trial) return try_both(count, one_by_one, side_by_side);
    is_side_by_side_&& count >= smallest_batch ? side_by_side(0, count) : one_by_one(0, count);
}

// Rays of one kind take more time in one part of the scene than in another, so both ways get parts
// of the same batch, in an order in which neither has the better one; and the median of several
// trials decides, since what disturbs a timing makes it longer.
template <class OneByOne, class SideBySide>
void RayStream::try_both(size_t count, const OneByOne& one_by_one, const SideBySide& side_by_side) {
    using Clock = std::chrono::steady_clock;
    const auto seconds = [](const auto& way, size_t first, size_t rays) {
        const Clock::time_point start = Clock::now();
        way(first, rays);
        return std::chrono::duration<double>(Clock::now() - start).count();
    };
    const size_t part = count / 4;
    double one = seconds(one_by_one, 0, part);
    const double side = seconds(side_by_side, part, 2 * part);
    one += seconds(one_by_one, 3 * part, part);
    one_by_one(4 * part, count - 4 * part);

    const size_t trial = next_trial_++;
    if (trial >= warm_up)
        gains_[trial - warm_up] = one / std::max(side, std::numeric_limits<double>::min());
    if (!has_chosen()) return;
    std::nth_element(gains_.begin(), gains_.begin() + trials / 2, gains_.end());
    is_side_by_side_ = gains_[trials / 2] > 1.0;
}

void RayStream::intersect(std::span<const geometry::Ray> rays, std::span<geometry::Hit> hits) {
    VELATURA_CHECK(hits.size() >= rays.size(), "fewer places for hits than rays");
    trace(
        rays.size(),
        [&](size_t first, size_t count) {
            for (size_t i = first; i < first + count; ++i)
                hits[i] = accelerator_.intersect(rays[i]);
        },
        [&](size_t first, size_t count) {
            accelerator_.intersect_batch(rays.subspan(first, count), hits.subspan(first, count));
        });
}

void RayStream::is_occluded(std::span<const geometry::Ray> rays, std::span<uint8_t> occluded) {
    VELATURA_CHECK(occluded.size() >= rays.size(), "fewer places for answers than rays");
    trace(
        rays.size(),
        [&](size_t first, size_t count) {
            for (size_t i = first; i < first + count; ++i)
                occluded[i] = accelerator_.is_occluded(rays[i]);
        },
        [&](size_t first, size_t count) {
            accelerator_.is_occluded_batch(rays.subspan(first, count),
                                           occluded.subspan(first, count));
        });
}

}  // namespace velatura::accel
