// SPDX-License-Identifier: Apache-2.0
#include "recorded_rays.h"

#include "cpu_clock.h"

#include <algorithm>
#include <map>
#include <utility>

namespace velatura::bench {

namespace {

constexpr int rounds = 5;
/// Paths that would be under way at once if rays were handed over in batches.
constexpr uint32_t paths_of_batch = 4096;

double median(std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + rounds / 2, values.end());
    return values[rounds / 2];
}

bool is_bounce(const RecordedRay& r) {
    return !r.is_any_hit && r.depth > 0;
}

/// What came of the rays; keeps the compiler from leaving them out.
volatile uint64_t sink = 0;

template <class Wanted>
double one_by_one(const std::vector<RecordedRay>& rays,
                  const accel::Accelerator& accelerator,
                  const Wanted& is_wanted) {
    uint64_t hits = 0;
    const double start = thread_seconds();
    for (const RecordedRay& r : rays) {
        if (!is_wanted(r)) continue;
        hits += r.is_any_hit ? uint64_t(accelerator.is_occluded(r.ray))
                             : uint64_t(accelerator.intersect(r.ray).is_valid());
    }
    const double seconds = thread_seconds() - start;
    sink = sink + hits;
    return seconds;
}

using Batches = std::vector<std::vector<geometry::Ray>>;

/// The rays of many paths that stand at the same depth, side by side.
template <class Wanted>
Batches make_batches(const std::vector<RecordedRay>& rays, const Wanted& is_wanted) {
    std::map<std::pair<uint32_t, uint16_t>, std::vector<geometry::Ray>> batches;
    for (const RecordedRay& r : rays) {
        if (is_wanted(r)) batches[{r.path / paths_of_batch, r.depth}].push_back(r.ray);
    }
    Batches out;
    for (auto& [key, batch] : batches) out.push_back(std::move(batch));
    return out;
}

double in_batches(const Batches& batches,
                  const accel::Accelerator& accelerator,
                  bool is_any_hit,
                  bool is_side_by_side) {
    std::vector<geometry::Hit> hits;
    std::vector<uint8_t> occluded;
    double seconds = 0;
    for (const auto& batch : batches) {
        hits.resize(batch.size());
        occluded.resize(batch.size());
        const double start = thread_seconds();
        if (is_side_by_side && is_any_hit) {
            accelerator.is_occluded_batch(batch, occluded);
        } else if (is_side_by_side) {
            accelerator.intersect_batch(batch, hits);
        } else {
            for (size_t i = 0; i < batch.size(); ++i) {
                if (is_any_hit)
                    occluded[i] = accelerator.is_occluded(batch[i]);
                else
                    hits[i] = accelerator.intersect(batch[i]);
            }
        }
        seconds += thread_seconds() - start;
    }
    return seconds;
}

}  // namespace

ReplayTimes replay(const std::vector<RecordedRay>& rays, const accel::Accelerator& accelerator) {
    const auto is_shadow = [](const RecordedRay& r) { return r.is_any_hit; };
    const Batches shadow = make_batches(rays, is_shadow), bounce = make_batches(rays, is_bounce);
    std::vector<double> all, shadows, bounces, batched[2][2];
    for (int round = 0; round < rounds; ++round) {
        all.push_back(one_by_one(rays, accelerator, [](const RecordedRay&) { return true; }));
        shadows.push_back(one_by_one(rays, accelerator, is_shadow));
        bounces.push_back(one_by_one(rays, accelerator, is_bounce));
        for (const bool is_side_by_side : {false, true}) {
            batched[0][is_side_by_side].push_back(
                in_batches(shadow, accelerator, true, is_side_by_side));
            batched[1][is_side_by_side].push_back(
                in_batches(bounce, accelerator, false, is_side_by_side));
        }
    }
    return {median(all), median(shadows), median(bounces),
            std::min(median(batched[0][0]), median(batched[0][1])),
            std::min(median(batched[1][0]), median(batched[1][1]))};
}

}  // namespace velatura::bench
