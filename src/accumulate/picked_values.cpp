// SPDX-License-Identifier: Apache-2.0
#include "accumulate/picked_values.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace velatura::accumulate {

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
    : grid_(window), filters_(std::move(filters)), tiles_(grid_.count()) {}

void PickedValues::add(int x, int y, size_t layer, const PickedValue& value) {
    if (!value.is_there) return;
    std::vector<PickedValue>& tile = tiles_[grid_.tile_of(x, y)];
    if (tile.empty()) tile.resize(TileGrid::pixels * filters_.size());
    pick(filters_[layer], tile[grid_.pixel_of(x, y) * filters_.size() + layer], value);
}

void PickedValues::add(const PickedValues& other) {
    for (int y = grid_.window.y0; y < grid_.window.y1; ++y)
        for (int x = grid_.window.x0; x < grid_.window.x1; ++x)
            for (size_t layer = 0; layer < filters_.size(); ++layer)
                add(x, y, layer, other.at(x, y, layer));
}

PickedValue PickedValues::at(int x, int y, size_t layer) const {
    const std::vector<PickedValue>& tile = tiles_[grid_.tile_of(x, y)];
    return tile.empty() ? PickedValue{} : tile[grid_.pixel_of(x, y) * filters_.size() + layer];
}

size_t PickedValues::memory_bytes() const {
    size_t bytes = tiles_.size() * sizeof(tiles_[0]);
    for (const auto& tile : tiles_) bytes += tile.capacity() * sizeof(PickedValue);
    return bytes;
}

}  // namespace velatura::accumulate
