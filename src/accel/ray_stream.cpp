// SPDX-License-Identifier: Apache-2.0
#include "accel/ray_stream.h"

#include "base/check.h"

#include <algorithm>
#include <chrono>
#include <limits>

namespace velatura::accel {

namespace {

// Of both ways together, in turns. The best of each counts: what disturbs a timing makes it longer.
constexpr int trials = 10;

}  // namespace

RayStream::RayStream(const Accelerator& accelerator)
    : accelerator_(accelerator), trials_left_(accelerator.has_batches() ? trials : 0) {
    best_.fill(std::numeric_limits<double>::infinity());
}

template <class OneByOne, class SideBySide>
void RayStream::trace(size_t count, const OneByOne& one_by_one, const SideBySide& side_by_side) {
    if (count < smallest_batch) return one_by_one();
    if (trials_left_ == 0) return is_side_by_side_ ? side_by_side() : one_by_one();

    using Clock = std::chrono::steady_clock;
    const size_t way = size_t(trials_left_ % 2);
    const Clock::time_point start = Clock::now();
    way == 0 ? one_by_one() : side_by_side();
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    best_[way] = std::min(best_[way], seconds / double(count));
    --trials_left_;
    is_side_by_side_ = trials_left_ == 0 && best_[1] < best_[0];
}

void RayStream::intersect(std::span<const geometry::Ray> rays, std::span<geometry::Hit> hits) {
    VELATURA_CHECK(hits.size() >= rays.size(), "fewer places for hits than rays");
    trace(
        rays.size(),
        [&] {
            for (size_t i = 0; i < rays.size(); ++i) hits[i] = accelerator_.intersect(rays[i]);
        },
        [&] { accelerator_.intersect_batch(rays, hits); });
}

void RayStream::is_occluded(std::span<const geometry::Ray> rays, std::span<uint8_t> occluded) {
    VELATURA_CHECK(occluded.size() >= rays.size(), "fewer places for answers than rays");
    trace(
        rays.size(),
        [&] {
            for (size_t i = 0; i < rays.size(); ++i)
                occluded[i] = accelerator_.is_occluded(rays[i]);
        },
        [&] { accelerator_.is_occluded_batch(rays, occluded); });
}

}  // namespace velatura::accel
