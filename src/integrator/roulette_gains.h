// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace velatura::integrator {

/// Roulette spares paths that still carry this part of what they began with: ending them sooner
/// costs more noise than it saves time (`./dev bench transport`: 1.1 to 1.5 times the efficiency of
/// survival = throughput).
inline constexpr float usual_gain = 2.0f;

/// From this many scatterings on, roulette ends one path in `trapped_path_share` at each, whatever
/// its throughput: light that total reflection traps in lossless glass would never end by itself.
/// Rare enough to add no noise that matters.
inline constexpr int trapped_path_start = 1024;
inline constexpr float trapped_path_share = 1024.0f;

/// How likely paths survive: gain times what they still carry, by the number of scatterings. Any
/// gains > 0 are unbiased.
struct RouletteGains {
    static constexpr size_t count = 4;

    /// After 1, 2, 3, and more scatterings.
    std::array<float, count> gains = {usual_gain, usual_gain, usual_gain, usual_gain};

    static size_t index(int bounce) { return size_t(std::clamp(bounce, 1, int(count)) - 1); }

    float at(int bounce) const { return gains[index(bounce)]; }
};

}  // namespace velatura::integrator
