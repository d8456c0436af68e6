// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "canvas/canvas.h"

#include <string>
#include <vector>

namespace velatura::canvas {

/// A value on the scale of a false-color image.
struct ScaleLabel {
    float t = 0;  ///< place, 0 to 1 from left to right
    std::string text;
};

/// An image of false colors by heat(), with their scale below it: a bar and labels. Wider than the
/// image where the labels need that.
/// Args:    rgb: [height][width][3].
Canvas with_heat_scale(int width,
                       int height,
                       const std::vector<float>& rgb,
                       const std::vector<ScaleLabel>& labels);

}  // namespace velatura::canvas
