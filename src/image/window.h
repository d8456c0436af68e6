// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace velatura::image {

/// Half-open pixel rectangle [x0, x1) × [y0, y1); y counts from the top row of the image.
struct Window {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

    bool operator==(const Window&) const = default;

    int width() const { return x1 - x0; }

    int height() const { return y1 - y0; }

    bool is_empty() const { return x1 <= x0 || y1 <= y0; }

    bool contains(int x, int y) const { return x >= x0 && x < x1 && y >= y0 && y < y1; }

    size_t pixel_count() const { return is_empty() ? 0 : size_t(width()) * size_t(height()); }

    /// Position of a pixel in row-major order from the top left.
    size_t index(int x, int y) const { return size_t(y - y0) * size_t(width()) + size_t(x - x0); }
};

}  // namespace velatura::image
