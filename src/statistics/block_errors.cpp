// SPDX-License-Identifier: Apache-2.0
#include "statistics/block_errors.h"

#include "statistics/image_change.h"

#include <algorithm>
#include <cmath>

namespace velatura::statistics {

namespace {

constexpr double uncertain_freedom = 4;

bool add_pixel(const accumulate::SampleSums& sums,
               int x,
               int y,
               double factor,
               BlockError& block,
               std::array<double, 3>& fourth) {
    const std::optional<PixelChange> change = pixel_change(sums, x, y);
    if (!change) return false;
    for (size_t c = 0; c < 3; ++c) {
        const double variance = change->square[c] * factor;
        block.mean[c] += change->now[c];
        block.error[c] += variance;
        fourth[c] += variance * variance;
    }
    return true;
}

}  // namespace

double BlockError::quantile(size_t channel) const {
    // Abramowitz & Stegun 26.7.5, two terms; below two degrees they say too little, and nothing is
    // sure anyway
    const double f = std::max(freedom[channel], 1.0);
    return 1.96 + 2.37 / f + 2.82 / (f * f);
}

double BlockError::relative() const {
    double sum = 0;
    for (size_t c = 0; c < 3; ++c) sum += error[c] * error[c] / (mean[c] * mean[c] + 0.01) / 3;
    return std::sqrt(sum);
}

bool BlockError::is_uncertain() const {
    const auto largest = size_t(std::max_element(error.begin(), error.end()) - error.begin());
    return error[largest] > 0 && freedom[largest] < uncertain_freedom;
}

std::optional<std::vector<BlockError>> block_errors(const accumulate::SampleSums& sums,
                                                    double slope) {
    const double factor = net_factor(slope) * net_factor(slope);
    const image::Window& w = sums.window();
    std::vector<BlockError> blocks;
    for (int y0 = w.y0; y0 < w.y1; y0 += BlockError::size) {
        for (int x0 = w.x0; x0 < w.x1; x0 += BlockError::size) {
            BlockError block;
            block.window = {x0, y0, std::min(x0 + BlockError::size, w.x1),
                            std::min(y0 + BlockError::size, w.y1)};
            std::array<double, 3> fourth{};
            for (int y = y0; y < block.window.y1; ++y) {
                for (int x = x0; x < block.window.x1; ++x) {
                    if (!add_pixel(sums, x, y, factor, block, fourth)) return std::nullopt;
                }
            }
            const auto n = double(block.window.pixel_count());
            for (size_t c = 0; c < 3; ++c) {
                // The square of a normal variable has the fourth moment 3 σ⁴
                block.freedom[c] =
                    fourth[c] > 0 ? 3 * block.error[c] * block.error[c] / fourth[c] : 0;
                block.mean[c] /= n;
                block.error[c] = std::sqrt(block.error[c]) / n;
            }
            blocks.push_back(block);
        }
    }
    return blocks;
}

}  // namespace velatura::statistics
