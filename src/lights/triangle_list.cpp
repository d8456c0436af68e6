// SPDX-License-Identifier: Apache-2.0
#include "lights/triangle_list.h"

#include "base/check.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace velatura::lights {

void TriangleList::add(uint32_t shape, std::vector<uint32_t> triangles, size_t triangle_count) {
    if (triangles.empty()) return;
    const size_t total = size_t(size_) + triangles.size();
    VELATURA_CHECK(total < std::numeric_limits<uint32_t>::max(), "too many emissive triangles");
    Run run{shape, size_, uint32_t(triangles.size()), {}};
    if (triangles.size() != triangle_count) run.triangles = std::move(triangles);
    runs_.push_back(std::move(run));
    size_ = uint32_t(total);
}

TriangleList::Entry TriangleList::operator[](uint32_t index) const {
    const auto after = std::upper_bound(runs_.begin(), runs_.end(), index,
                                        [](uint32_t i, const Run& run) { return i < run.first; });
    const Run& run = *(after - 1);
    const uint32_t within = index - run.first;
    return {run.shape, run.triangles.empty() ? within : run.triangles[within]};
}

uint32_t TriangleList::find(uint32_t shape, uint32_t triangle) const {
    const auto run = std::lower_bound(runs_.begin(), runs_.end(), shape,
                                      [](const Run& r, uint32_t s) { return r.shape < s; });
    if (run == runs_.end() || run->shape != shape) return not_listed;
    if (run->triangles.empty()) return triangle < run->count ? run->first + triangle : not_listed;
    const auto at = std::lower_bound(run->triangles.begin(), run->triangles.end(), triangle);
    if (at == run->triangles.end() || *at != triangle) return not_listed;
    return run->first + uint32_t(at - run->triangles.begin());
}

}  // namespace velatura::lights
