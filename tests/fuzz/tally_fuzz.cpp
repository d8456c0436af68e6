// SPDX-License-Identifier: Apache-2.0
#include "base/hash.h"
#include "fuzz_targets.h"
#include "study/tally.h"

#include <cstdlib>
#include <cstring>
#include <string>

namespace velatura::fuzz {

/// Any bytes between a head and their hash are the state of a study or refused; what is read is
/// written the same.
void tally(std::string_view bytes) {
    const uint64_t hash = hash_string(bytes);
    std::string state = "velatura.study.state/1 fuzz\n" + std::string(bytes);
    state.append(reinterpret_cast<const char*>(&hash), sizeof hash);
    const auto tallies = study::from_bytes(state, "fuzz");
    if (tallies && study::to_bytes(*tallies, "fuzz") != state) std::abort();
}

}  // namespace velatura::fuzz
