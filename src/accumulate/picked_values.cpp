// SPDX-License-Identifier: Apache-2.0
#include "accumulate/picked_values.h"

#include "accumulate/sample_sums.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace velatura::accumulate {

namespace {

constexpr int tile_size = SampleSums::tile_size;

}  // namespace

void pick(DataFilter filter, PickedValue& kept, const PickedValue& other) {
    if (!other.is_there) return;
    PickedValue added = other;
    // Of −0 and +0, which are equal, the order would decide
    for (float& v : added.values) v += 0.0f;
    added.depth += 0.0f;
    if (!kept.is_there) {
        kept = added;
        return;
    }
    if (filter == DataFilter::Closest) {
        if (std::tie(added.depth, added.values) < std::tie(kept.depth, kept.values)) kept = added;
        return;
    }
    kept.depth = std::min(kept.depth, added.depth);
    for (size_t i = 0; i < kept.values.size(); ++i)
        kept.values[i] = filter == DataFilter::Min ? std::min(kept.values[i], added.values[i])
                                                   : std::max(kept.values[i], added.values[i]);
}

PickedValues::PickedValues(const image::Window& window, std::vector<DataFilter> filters)
    : window_(window), filters_(std::move(filters)) {
    tiles_x_ = (window.width() + tile_size - 1) / tile_size;
    const int tiles_y = (window.height() + tile_size - 1) / tile_size;
    tiles_.resize(size_t(tiles_x_) * size_t(tiles_y));
}

size_t PickedValues::tile_of(int x, int y, size_t& pixel) const {
    const int px = x - window_.x0, py = y - window_.y0;
    pixel = size_t(py % tile_size * tile_size + px % tile_size);
    return size_t(py / tile_size) * size_t(tiles_x_) + size_t(px / tile_size);
}

void PickedValues::add(int x, int y, size_t layer, const PickedValue& value) {
    if (!value.is_there) return;
    size_t pixel = 0;
    std::vector<PickedValue>& tile = tiles_[tile_of(x, y, pixel)];
    if (tile.empty()) tile.resize(size_t(tile_size) * size_t(tile_size) * filters_.size());
    pick(filters_[layer], tile[pixel * filters_.size() + layer], value);
}

void PickedValues::add(const PickedValues& other) {
    for (int y = window_.y0; y < window_.y1; ++y)
        for (int x = window_.x0; x < window_.x1; ++x)
            for (size_t layer = 0; layer < filters_.size(); ++layer)
                add(x, y, layer, other.at(x, y, layer));
}

PickedValue PickedValues::at(int x, int y, size_t layer) const {
    size_t pixel = 0;
    const std::vector<PickedValue>& tile = tiles_[tile_of(x, y, pixel)];
    return tile.empty() ? PickedValue{} : tile[pixel * filters_.size() + layer];
}

size_t PickedValues::memory_bytes() const {
    size_t bytes = tiles_.size() * sizeof(tiles_[0]);
    for (const auto& tile : tiles_) bytes += tile.capacity() * sizeof(PickedValue);
    return bytes;
}

}  // namespace velatura::accumulate
