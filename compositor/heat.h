// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>

namespace velatura::compositor {

/// The colour of x from 0 to 1 on maps for the eye: black, red, yellow, white.
inline std::array<float, 3> heat(float x) {
    const auto ramp = [x](float from) { return std::clamp(3.0f * x - from, 0.0f, 1.0f); };
    return {ramp(0), ramp(1), ramp(2)};
}

}  // namespace velatura::compositor
