// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace velatura::selftest {

/// What a check measured. It passes when `measured` and `detectable` are at most `bound`.
struct Finding {
    std::string what;     ///< what was measured, with its setting
    double measured = 0;  ///< deviation or number of failures, not below 0; NaN does not pass
    double bound = 0;     ///< in the unit of `measured`; 0 = equal to the bit, or none
    double detectable =
        0;  ///< smallest deviation that is seen with 90 % power; 0 where nothing is sampled

    bool passes() const { return measured <= bound && detectable <= bound; }
};

/// A question with a known answer.
struct Check {
    const char* hard_case;  ///< of docs/engineering/hard_cases.md: "H01"
    const char* question;   ///< in plain words
    const char* oracle;     ///< what it is compared with
    /// `amount` scales how much is sampled: 1 takes well below a second on one core. The result is
    /// a function of it.
    Finding (*run)(uint64_t amount);
};

/// All of them, in the order of their cases.
std::span<const Check> checks();

}  // namespace velatura::selftest
