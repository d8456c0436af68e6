// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace velatura::canvas {

/// Black, red, yellow, white. x in [0, 1].
inline std::array<float, 3> heat(float x) {
    const auto ramp = [x](float from) { return std::clamp(3.0f * x - from, 0.0f, 1.0f); };
    return {ramp(0), ramp(1), ramp(2)};
}

/// From black over violet and orange to white; brighter is more, also in print. t in [0, 1].
inline std::array<float, 3> glow(double t) {
    constexpr std::array<std::array<double, 3>, 5> stops = {{{0, 0, 0.02},
                                                             {0.34, 0.07, 0.43},
                                                             {0.74, 0.22, 0.33},
                                                             {0.98, 0.55, 0.04},
                                                             {0.99, 1.0, 0.85}}};
    const double x = std::clamp(t, 0.0, 1.0) * 4;
    const size_t i = std::min(size_t(x), size_t(3));
    std::array<float, 3> color{};
    for (size_t c = 0; c < 3; ++c)
        color[c] = float(stops[i][c] + (stops[i + 1][c] - stops[i][c]) * (x - double(i)));
    return color;
}

}  // namespace velatura::canvas
