// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/hash.h"
#include "base/math.h"
#include "sampling/warp.h"

#include <cstdint>

namespace velatura::selftest {

/// Numbers that are the same on every machine: hashes of a counter.
class Random {
  public:
    explicit Random(uint64_t seed) : state_(mix64(seed)) {}

    /// In [0, 1), 24 bits.
    float unit() { return float(mix64(state_++) >> 40) * 0x1p-24f; }

    float between(float low, float high) { return low + (high - low) * unit(); }

    uint32_t below(uint32_t count) { return uint32_t((mix64(state_++) >> 32) * count >> 32); }

    Vec3 in_cube(float half) {
        const float x = between(-half, half), y = between(-half, half);
        return {x, y, between(-half, half)};
    }

    Vec3 direction() {
        const float u = unit();
        return sampling::uniform_sphere({u, unit()});
    }

  private:
    uint64_t state_;
};

}  // namespace velatura::selftest
