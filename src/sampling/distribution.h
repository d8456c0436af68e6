// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cstddef>
#include <span>
#include <vector>

namespace velatura::sampling {

/// Piecewise constant density over [0, 1), all bins of equal width. Sums are in double; a bin of
/// weight 0 is never drawn. Negative, NaN and infinite weights count as 0. When every weight is 0
/// (or there is none) nothing can be drawn: integral() is 0 and every density is 0.
class Distribution1D {
  public:
    struct Sample {
        double x = 0;          ///< in [0, 1)
        double pdf = 0;        ///< density at x with respect to [0, 1)
        double pmf = 0;        ///< probability of the bin
        size_t index = 0;      ///< the bin
        float u_remapped = 0;  ///< position inside the bin, a fresh number in [0, 1)
    };

    Distribution1D() = default;
    explicit Distribution1D(std::span<const double> weights);
    explicit Distribution1D(std::span<const float> weights);

    size_t size() const { return cdf_.empty() ? 0 : cdf_.size() - 1; }

    /// Mean of the weights: the integral over [0, 1).
    double integral() const { return integral_; }

    /// Draws by inversion; pdf 0 when nothing can be drawn.
    Sample sample(float u) const;

    double pmf(size_t index) const { return cdf_[index + 1] - cdf_[index]; }

    /// Density at x in [0, 1]; 0 outside.
    double pdf(double x) const;

  private:
    template <class T>
    void build(std::span<const T> weights);

    std::vector<double> cdf_;  // [bin + 1], from 0 to exactly 1
    double integral_ = 0;
};

/// Piecewise constant density over the unit square by rows: first the row, then the column within
/// it.
class Distribution2D {
  public:
    struct Sample {
        Vec2d xy;        ///< in [0, 1)²
        double pdf = 0;  ///< density with respect to the unit square
        size_t column = 0, row = 0;
    };

    Distribution2D() = default;
    /// weights[row][column], row 0 at y = 0.
    Distribution2D(std::span<const float> weights, size_t width, size_t height);

    double integral() const { return rows_.integral(); }

    size_t width() const { return columns_.empty() ? 0 : columns_[0].size(); }

    size_t height() const { return rows_.size(); }

    Sample sample(const Vec2& u) const;
    double pdf(const Vec2d& xy) const;

    /// Probability of one bin.
    double pmf(size_t column, size_t row) const {
        return integral() > 0.0 ? rows_.pmf(row) * columns_[row].pmf(column) : 0.0;
    }

  private:
    Distribution1D rows_;
    std::vector<Distribution1D> columns_;  // [row]
};

}  // namespace velatura::sampling
