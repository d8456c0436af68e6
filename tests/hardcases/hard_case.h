// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <string>

/// The hard cases of docs/engineering/hard_cases.md. A test belongs to case 7 when the name of its
/// suite begins with H07; what it measures is written down while it runs, wherever the test lives.
namespace velatura::hardcase {

/// How much is sampled: on every commit, every night, before a release. By the environment variable
/// VELATURA_HARDCASES_SIZE (`commit`, `nightly`, `release`), which `./dev hardcases --size` sets;
/// commit if unset.
enum class Size { Commit, Nightly, Release };

Size size();

/// A count of samples or rays that grows with the size.
uint64_t sized(uint64_t commit, uint64_t nightly, uint64_t release);

struct Measurement {
    std::string what;       ///< in a few words, with the setting that it belongs to
    double measured = 0;    ///< deviation, or number of failures; not below 0
    double bound = 0;       ///< in the unit of `measured`
    double detectable = 0;  ///< smallest deviation seen with 90 % power; 0 where nothing is sampled
    std::string oracle;     ///< what it was compared with
    std::string sees = {};  ///< smallest error that is seen, where it has another unit
};

/// The larger one, and what is no number where either is: std::max would forget it.
inline double larger(double a, double b) {
    return std::isnan(a) || a >= b ? a : b;
}

/// Expects `measured` and `detectable` to be at most `bound`; a number that is none fails. In a
/// test of a case, appends it to the file that VELATURA_HARDCASES_RECORD names, as a line of JSON.
void expect_within(const Measurement& measurement);

/// A bound that is known not to be kept: expects that it is not, so that whoever mends it notices,
/// and records it.
void expect_known_failure(const Measurement& measurement);

/// As expect_within in tests of a case, and nothing in others: for helpers that many tests share,
/// which have expectations of their own.
void expect_in_hard_case(const Measurement& measurement);

}  // namespace velatura::hardcase
