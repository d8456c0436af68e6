// SPDX-License-Identifier: Apache-2.0
#include "statistics/hidden_light.h"

#include <algorithm>
#include <cmath>

namespace velatura::statistics {

bool hides_error(const HiddenLight& light, double error, double samples_per_pixel, double pixels) {
    constexpr double quantile = 1.96, tolerance = 0.2;
    if (!(light.square > 0) || !(samples_per_pixel > 0)) return false;
    // The mean of the squares of n samples has the variance fourth / n
    const double deviation =
        std::sqrt(light.fourth / (samples_per_pixel * pixels)) / samples_per_pixel;
    const double squared = std::max(error * error, light.square / samples_per_pixel);
    return quantile * deviation > tolerance * squared;
}

}  // namespace velatura::statistics
