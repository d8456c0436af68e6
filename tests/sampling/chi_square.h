// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace velatura::sampling::testing {

/// Result of Pearson's test; z is the Wilson-Hilferty normal deviate of the statistic.
struct ChiSquare {
    double statistic = 0;
    int degrees = 0;
    double z = 0;
    double expected_total = 0;
};

/// Compares counts with expected counts; neighboring cells are pooled until each expects at
/// least 5.
inline ChiSquare chi_square(std::span<const double> counts, std::span<const double> expected) {
    ChiSquare r;
    double c = 0, e = 0;
    std::vector<double> pooled_c, pooled_e;
    for (size_t i = 0; i < counts.size(); ++i) {
        c += counts[i];
        e += expected[i];
        r.expected_total += expected[i];
        if (e >= 5) {
            pooled_c.push_back(c);
            pooled_e.push_back(e);
            c = e = 0;
        }
    }
    if (!pooled_e.empty()) {
        pooled_c.back() += c;
        pooled_e.back() += e;
    }
    for (size_t i = 0; i < pooled_e.size(); ++i) {
        r.statistic += (pooled_c[i] - pooled_e[i]) * (pooled_c[i] - pooled_e[i]) / pooled_e[i];
    }
    r.degrees = int(pooled_e.size()) - 1;
    if (r.degrees < 1) return r;
    const double k = r.degrees;
    r.z = (std::cbrt(r.statistic / k) - (1 - 2 / (9 * k))) / std::sqrt(2 / (9 * k));
    return r;
}

/// Relative error of one of `cells` equal cells that a test of n samples finds with probability 0.9
/// at z = 4.
inline double smallest_detectable(double n, double cells) {
    return (4 + 1.28) * std::sqrt(cells / n);
}

/// SplitMix64: an independent source of numbers for tests.
class TestRandom {
  public:
    explicit TestRandom(unsigned long long seed) : state_(seed) {}

    unsigned long long bits() {
        unsigned long long z = (state_ += 0x9e3779b97f4a7c15ull);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
        return z ^ (z >> 31);
    }

    float uniform() { return float(bits() >> 40) * 0x1p-24f; }

  private:
    unsigned long long state_;
};

}  // namespace velatura::sampling::testing
