// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace velatura::image {

/// √relMSE of a picture and its 95 % interval (docs/numerics.md, Error).
struct RelativeError {
    double value = 0;
    double low = 0, high = 0;
};

/// Square of the relative error of one channel of a pixel. The constant keeps black pixels from
/// counting without end.
inline double relative_square(double variance, double mean) {
    return variance / (mean * mean + 0.01);
}

/// Collects relative squares tile by tile: the tiles are the batches of a ratio estimator, whose
/// spread gives the interval (Cochran 1977, Sampling Techniques, 6.3).
class RelativeErrorSum {
  public:
    static constexpr int tile_size = 16;  ///< pixels

    /// Sum and number of the relative squares of a tile.
    void add_tile(double sum, double count);

    double count() const { return count_; }

    RelativeError result() const;

  private:
    size_t tiles_ = 0;
    double sum_ = 0, count_ = 0;
    double sum_sum_ = 0, sum_count_ = 0, count_count_ = 0;  ///< of products
};

}  // namespace velatura::image
