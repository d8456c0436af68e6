// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/hash.h"

#include <cstdint>

namespace velatura::sampling {

/// As many numbers as it takes, for what asks for an unknown count of them in one go: a walk
/// through media. SplitMix64 (Steele, Lea & Flood 2014). A value; equal seeds give equal numbers.
class RandomStream {
  public:
    /// first: the first number, in [0, 1), which may be of a better sequence.
    RandomStream(uint64_t seed, double first) : state_(seed), first_(first) {}

    /// In [0, 1), with 53 bits but for the first.
    double next() {
        if (first_ >= 0.0) {
            const double first = first_;
            first_ = -1.0;
            return first;
        }
        state_ += 0x9e3779b97f4a7c15ull;
        return double(mix64(state_) >> 11) * 0x1p-53;
    }

  private:
    uint64_t state_;
    double first_;
};

}  // namespace velatura::sampling
