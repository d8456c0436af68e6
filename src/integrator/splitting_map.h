// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace velatura::integrator {

/// Path splitting: number of branches of a path at its first non-delta vertex, a power of two per
/// block of pixels.
class SplittingMap {
  public:
    static constexpr int block_size = 16;
    static constexpr uint32_t max = 4;

    /// One count for the whole image.
    explicit SplittingMap(uint32_t count = 1) : counts_(1, uint8_t(count)) {}

    /// counts: [blocks_high][blocks_across], from the block in column first_x and row first_y of
    /// the image on.
    SplittingMap(int blocks_across, std::vector<uint8_t> counts, int first_x = 0, int first_y = 0)
        : blocks_across_(blocks_across),
          first_x_(first_x),
          first_y_(first_y),
          counts_(std::move(counts)) {}

    /// Count at the pixel (x, y) of the image; outside the blocks, as in overscan, of the nearest
    /// block.
    uint32_t at(int x, int y) const {
        if (blocks_across_ == 0) return counts_[0];
        const int column = std::clamp(x / block_size - first_x_, 0, blocks_across_ - 1);
        const int row =
            std::clamp(y / block_size - first_y_, 0, int(counts_.size()) / blocks_across_ - 1);
        return counts_[size_t(row) * size_t(blocks_across_) + size_t(column)];
    }

    /// Mean count over blocks.
    double mean() const {
        double sum = 0;
        for (const uint8_t count : counts_) sum += count;
        return sum / double(counts_.size());
    }

  private:
    int blocks_across_ = 0, first_x_ = 0, first_y_ = 0;
    std::vector<uint8_t> counts_;
};

}  // namespace velatura::integrator
