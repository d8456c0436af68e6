// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/window.h"

#include <algorithm>
#include <cstddef>

namespace velatura::accumulate {

/// Square tiles over a window, row by row from its upper left corner.
struct TileGrid {
    static constexpr int size = 16;  ///< pixels to a side
    static constexpr size_t pixels = size_t(size) * size_t(size);

    explicit TileGrid(const image::Window& w)
        : window(w), across((w.width() + size - 1) / size), high((w.height() + size - 1) / size) {}

    size_t count() const { return size_t(across) * size_t(high); }

    /// Index of the tile that holds a pixel of the window.
    size_t tile_of(int x, int y) const {
        return size_t((y - window.y0) / size) * size_t(across) + size_t((x - window.x0) / size);
    }

    /// Index of a pixel within its tile.
    size_t pixel_of(int x, int y) const {
        return size_t((y - window.y0) % size) * size + size_t((x - window.x0) % size);
    }

    /// The pixels of a tile, as far as they lie in the window.
    image::Window window_of(size_t tile) const {
        const int x = window.x0 + int(tile % size_t(across)) * size;
        const int y = window.y0 + int(tile / size_t(across)) * size;
        return {x, y, std::min(x + size, window.x1), std::min(y + size, window.y1)};
    }

    image::Window window;
    int across, high;
};

}  // namespace velatura::accumulate
