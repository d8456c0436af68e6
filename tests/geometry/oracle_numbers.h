// SPDX-License-Identifier: Apache-2.0
// What shapes are held against: random places and directions, and the type that oracles count in.
#pragma once

#include "base/math.h"

#include <cstdint>
#include <limits>
#include <random>

namespace velatura::geometry::test {

using Real = long double;
using VecL = Imath::Vec3<Real>;

inline constexpr float far_away = std::numeric_limits<float>::infinity();

class Random {
  public:
    explicit Random(uint32_t seed) : engine_(seed) {}

    double between(double a, double b) {
        return std::uniform_real_distribution<double>(a, b)(engine_);
    }

    Vec3d direction() {
        std::normal_distribution<double> normal;
        return normalize(Vec3d(normal(engine_), normal(engine_), normal(engine_)));
    }

    Vec3d in_cube(double half) {
        return {between(-half, half), between(-half, half), between(-half, half)};
    }

  private:
    std::mt19937 engine_;
};

}  // namespace velatura::geometry::test
