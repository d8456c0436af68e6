// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <cmath>
#include <vector>

namespace velatura::shading {

/// Azimuths of a Kronecker lattice by the golden ratio of `count` points over a part of a turn, in
/// (0, 1]: their cosines and sines. The heights that belong to them are (i + 1/2) / count. Tables
/// by quadrature make them once for all their entries.
inline std::vector<Vec2d> lattice_turns(int count, double part = 1.0) {
    constexpr double golden = 0.61803398874989484820;
    std::vector<Vec2d> turns;
    turns.reserve(size_t(count));
    for (int i = 0; i < count; ++i) {
        const double turn = double(i) * golden;
        const double phi = 2.0 * pi_d * (part * (turn - std::floor(turn)));
        turns.emplace_back(std::cos(phi), std::sin(phi));
    }
    return turns;
}

}  // namespace velatura::shading
