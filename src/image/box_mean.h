// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace velatura::image {

/// Means over windows of (2·radius + 1)² pixels, cut off at the border; values: [height][width].
std::vector<double> box_mean(const std::vector<double>& values, int width, int height, int radius);

}  // namespace velatura::image
