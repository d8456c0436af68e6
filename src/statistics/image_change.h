// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/sample_sums.h"
#include "statistics/relative_error.h"

#include <array>
#include <optional>

namespace velatura::statistics {

/// How a pixel changed since it had the largest power of two of samples that is less than what it
/// has now.
///
/// The first n of N samples of a scrambled digital sequence, n and N powers of two, and each later
/// run of n, differ by a digital shift, which Owen scrambling takes up: all have one variance and
/// one covariance with their mean. Hence E (m_n − m_N)² = Var m_n − Var m_N for every integrand,
/// without further samples or other points.
struct PixelChange {
    std::array<double, 3> now{};  ///< mean of all samples

    /// Variance of `now` per channel if it falls as 1/N; falls by a slope are weighed in by
    /// net_factor().
    std::array<double, 3> square{};
};

std::optional<PixelChange> pixel_change(const accumulate::SampleSums& sums, int x, int y);

/// What errors of a pixel are relative to, RGB: ErrorBase::likely of image_error.h.
std::array<double, 3> error_base(const accumulate::SampleSums& sums, int x, int y);

/// image_error (image_error.h) of the image if errors fall as samples^−1/2, each pixel by its
/// last change. Nothing unless every pixel's change is known.
std::optional<RelativeError> image_change(const accumulate::SampleSums& sums);

/// What an error from changes is to be multiplied by where errors fall as samples^−slope: 1 for
/// 1/2, less beyond.
double net_factor(double slope);

/// The slope of images by Sobol' points before one of them is looked at; its standard deviation
/// among scenes/.
inline constexpr double usual_slope = 0.52, usual_slope_deviation = 0.03;

}  // namespace velatura::statistics
