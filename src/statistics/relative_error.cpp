// SPDX-License-Identifier: Apache-2.0
#include "statistics/relative_error.h"

#include <algorithm>
#include <cmath>

namespace velatura::statistics {

bool few_pixels(double sum, double variance, double pixels) {
    constexpr double fewest = 100, of_even_noise = 12;
    return sum > 0 && sum * sum < std::min(fewest, pixels / of_even_noise) * variance;
}

void RelativeErrorSum::add_tile(double sum, double count) {
    if (count == 0) return;
    ++tiles_;
    sum_ += sum;
    count_ += count;
    sum_sum_ += sum * sum;
    sum_count_ += sum * count;
    count_count_ += count * count;
}

RelativeError RelativeErrorSum::result() const {
    if (tiles_ == 0) return {};
    const double mean = sum_ / count_;
    // Σ (sum − mean·count)²
    const double spread =
        std::max(0.0, sum_sum_ - 2 * mean * sum_count_ + mean * mean * count_count_);
    const auto n = double(tiles_);
    const double error = tiles_ > 1 ? std::sqrt(spread * n / (n - 1)) / count_ : mean;
    constexpr double quantile = 1.96;
    return {std::sqrt(mean), std::sqrt(std::max(0.0, mean - quantile * error)),
            std::sqrt(mean + quantile * error)};
}

}  // namespace velatura::statistics
