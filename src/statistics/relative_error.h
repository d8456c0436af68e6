// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace velatura::statistics {

/// √relMSE of an image and its 95 % interval (docs/engineering/numerics.md, Error).
struct RelativeError {
    double value = 0;
    double low = 0, high = 0;

    /// Pixels that hold half of the squared error, where `is_lower`.
    size_t half_in = 0;

    /// Few pixels hold most of the squared error, or what they hold is not known (image_error.h):
    /// rare bright samples, of which other pixels have met none yet. The value is a lower bound,
    /// the interval means nothing.
    bool is_lower = false;

    /// The pixel with the largest squared error, where `is_lower`; -1: not known.
    int worst_x = -1, worst_y = -1;
};

/// Square of the relative error of one channel of a pixel. The constant keeps black pixels from
/// counting without end.
inline double relative_square(double variance, double mean) {
    return variance / (mean * mean + 0.01);
}

/// Whether so few of `pixels` hold a sum of squares, of this variance, that the sum is no figure to
/// rely on.
///
/// n = sum² / variance; of squares s that are there by the chance of a rare sample the variance is,
/// as of Poisson counts, Σ s², and n their number. The sum is known to 1/√n, its root to half of
/// that: below n = 100 not to ±10 % with 95 % confidence; and since such sums are skewed, most
/// images state too little. Of a small image with even noise n is half of its pixels (normal
/// errors: the variance of s is 2 (E s)²).
bool few_pixels(double sum, double variance, double pixels);

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

}  // namespace velatura::statistics
