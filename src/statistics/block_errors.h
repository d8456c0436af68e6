// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/sample_sums.h"

#include <array>
#include <optional>
#include <vector>

namespace velatura::statistics {

/// The mean of 8×8 pixels (fewer at the borders), RGB, with its standard error.
struct BlockError {
    image::Window window;
    std::array<double, 3> mean{}, error{};

    /// Degrees of freedom of the squared error: one for each pixel of equal noise, few where some
    /// pixels have most of it (Satterthwaite 1946, An approximate distribution of estimates of
    /// variance components).
    std::array<double, 3> freedom{};

    /// So many errors to both sides of the mean are the 95 % interval: Student's quantile.
    double quantile(size_t channel) const;

    /// √(mean of error² / (mean² + 0.01)) of the channels.
    double relative() const;

    /// The error hangs on a pixel or two: what they met may be rarer or commoner than it looks.
    bool is_uncertain() const;

    static constexpr int size = 8;
};

/// Row by row. `slope`: errors fall as samples^−slope (image_change.h). Nothing unless every
/// pixel's change is known.
std::optional<std::vector<BlockError>> block_errors(const accumulate::SampleSums& sums,
                                                    double slope);

}  // namespace velatura::statistics
