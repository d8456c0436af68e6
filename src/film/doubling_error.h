// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"
#include "image/relative_error.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::film {

/// How much the picture changed when the samples of its pixels were doubled: what tells the error
/// whatever the sampler, also of one Sobol' sequence, whose halves make up for each other's errors.
///
/// The first n of N samples, n and N powers of two, are a scrambled net like each of the N/n runs of n
/// that follow, so that the means m have equal variances and equal covariances with their mean:
/// E (m_n − m_N)² = Var m_n − Var m_N, whatever the integrand. If the error falls by samples^−s,
/// that is ((N/n)^2s − 1) · Var m_N; the curve of several doublings tells s (integrator/error_curve.h).
/// Threads: as Film.
class DoublingError {
  public:
    explicit DoublingError(const Window& window);

    /// Remembers the pixel's mean before it gets further samples; from the first sample on, and at
    /// powers of two alone.
    void keep(const Film& film, int x, int y);

    /// Square root of the mean of (m_n − m_N)² / (N/n − 1), relative to m²; n is N/2 but for pixels whose
    /// rate was just decided. None unless every pixel has a power of two of samples and half of them were kept.
    std::optional<image::RelativeError> observe(const Film& film) const;

  private:
    Window window_;
    std::vector<float> means_;     ///< [height][width][3]
    std::vector<uint8_t> powers_;  ///< [height][width], 1 + log2 of the samples of the mean; 0: none
};

}  // namespace velatura::film
