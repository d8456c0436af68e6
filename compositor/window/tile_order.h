// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/window.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::compositor::window {

/// A level of an image cut into tiles, numbered row by row.
struct TileGrid {
    static constexpr int tile_size = 256;

    image::Window frame;  ///< x0 = y0 = 0

    int columns() const { return (frame.width() + tile_size - 1) / tile_size; }

    int rows() const { return (frame.height() + tile_size - 1) / tile_size; }

    size_t count() const { return size_t(columns()) * size_t(rows()); }

    image::Window window(size_t tile) const;
};

/// What is wanted on the screen: per look (A, B) the version of its image, 0 for none, and the
/// part of level 0 that is seen at `level`.
struct Wanted {
    std::array<uint64_t, 2> versions = {0, 0};
    size_t level = 0;
    image::Window seen;
};

/// Tiles of one level that are next.
struct TileBatch {
    size_t look = 0, level = 0;
    std::vector<size_t> tiles;
    bool is_seen = false;  ///< on the screen, or standing in for what is
};

/// Which tiles are up to date, and which are mixed next: the quick level whole, then what is seen
/// at the level of the screen, then the rest of that level, then everything at full size.
class TileOrder {
  public:
    TileOrder() = default;
    TileOrder(std::vector<TileGrid> levels, size_t quick_level);

    /// `max`: tiles of a batch, but for the quick level, which comes in one.
    std::optional<TileBatch> next(const Wanted& wanted, size_t max) const;
    void mark(const TileBatch& batch, uint64_t version);

    const TileGrid& grid(size_t level) const { return levels_[level]; }

  private:
    std::optional<TileBatch> stale(const Wanted& wanted,
                                   size_t level,
                                   size_t max,
                                   bool is_seen_only) const;

    std::vector<TileGrid> levels_;
    size_t quick_level_ = 0;
    std::array<std::vector<std::vector<uint64_t>>, 2> versions_;  ///< [look][level][tile]
};

}  // namespace velatura::compositor::window
