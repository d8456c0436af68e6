// SPDX-License-Identifier: Apache-2.0
#include "image/box_mean.h"

#include <algorithm>
#include <cstddef>

namespace velatura::image {

namespace {

/// Sums over up to 2·radius + 1 neighbors in a line of `count` values, `stride` apart.
void sum_along(const double* in, double* out, int count, size_t stride, int radius) {
    for (int i = 0; i < count; ++i) {
        // Not from the last sum: one huge value would spoil all that follow
        double sum = 0;
        for (int k = std::max(0, i - radius); k <= std::min(count - 1, i + radius); ++k)
            sum += in[size_t(k) * stride];
        out[size_t(i) * stride] = sum;
    }
}

int neighbors(int i, int count, int radius) {
    return std::min(count - 1, i + radius) - std::max(0, i - radius) + 1;
}

std::vector<double> box_sum(const std::vector<double>& values, int width, int height, int radius) {
    std::vector<double> rows(values.size()), out(values.size());
    for (size_t y = 0; y < size_t(height); ++y)
        sum_along(&values[y * size_t(width)], &rows[y * size_t(width)], width, 1, radius);
    for (size_t x = 0; x < size_t(width); ++x)
        sum_along(&rows[x], &out[x], height, size_t(width), radius);
    return out;
}

}  // namespace

std::vector<double> box_mean(const std::vector<double>& values, int width, int height, int radius) {
    std::vector<double> out = box_sum(values, width, height, radius);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x)
            out[size_t(y) * size_t(width) + size_t(x)] /=
                double(neighbors(x, width, radius) * neighbors(y, height, radius));
    }
    return out;
}

}  // namespace velatura::image
