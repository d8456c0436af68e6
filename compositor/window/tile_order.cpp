// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/tile_order.h"

#include <algorithm>
#include <limits>

namespace velatura::compositor::window {

namespace {

/// The part of level 0 under a tile.
image::Window at_full_size(const image::Window& tile, size_t level) {
    const auto shift = int(level);
    return {tile.x0 << shift, tile.y0 << shift, tile.x1 << shift, tile.y1 << shift};
}

bool overlap(const image::Window& a, const image::Window& b) {
    return a.x0 < b.x1 && b.x0 < a.x1 && a.y0 < b.y1 && b.y0 < a.y1;
}

}  // namespace

image::Window TileGrid::window(size_t tile) const {
    const int x0 = int(tile) % columns() * tile_size, y0 = int(tile) / columns() * tile_size;
    return {x0, y0, std::min(x0 + tile_size, frame.x1), std::min(y0 + tile_size, frame.y1)};
}

TileOrder::TileOrder(std::vector<TileGrid> levels, size_t quick_level)
    : levels_(std::move(levels)), quick_level_(quick_level) {
    for (auto& of_look : versions_) {
        for (const TileGrid& grid : levels_) of_look.emplace_back(grid.count(), 0);
    }
}

std::optional<TileBatch> TileOrder::stale(const Wanted& wanted,
                                          size_t level,
                                          size_t max,
                                          bool is_seen_only) const {
    for (size_t look = 0; look < 2; ++look) {
        if (wanted.versions[look] == 0) continue;
        TileBatch batch{look, level, {}, is_seen_only};
        const std::vector<uint64_t>& versions = versions_[look][level];
        for (size_t t = 0; t < versions.size() && batch.tiles.size() < max; ++t) {
            const bool is_seen =
                overlap(at_full_size(levels_[level].window(t), level), wanted.seen);
            if (versions[t] != wanted.versions[look] && (is_seen || !is_seen_only))
                batch.tiles.push_back(t);
        }
        if (!batch.tiles.empty()) return batch;
    }
    return std::nullopt;
}

std::optional<TileBatch> TileOrder::next(const Wanted& wanted, size_t max) const {
    if (levels_.empty()) return std::nullopt;
    constexpr size_t all = std::numeric_limits<size_t>::max();
    if (wanted.level < quick_level_) {
        if (auto batch = stale(wanted, quick_level_, all, false)) {
            batch->is_seen = true;
            return batch;
        }
    }
    if (auto batch = stale(wanted, wanted.level, max, true)) return batch;
    if (auto batch = stale(wanted, wanted.level, max, false)) return batch;
    return stale(wanted, 0, max, false);
}

void TileOrder::mark(const TileBatch& batch, uint64_t version) {
    for (const size_t t : batch.tiles) versions_[batch.look][batch.level][t] = version;
}

}  // namespace velatura::compositor::window
