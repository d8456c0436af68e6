// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::fuzz {

/// One of the files with a few wrong bits, bytes, numbers, parts left out, said twice or taken from
/// another: the same for the same seed. `files` must not be empty.
std::string mutant(const std::vector<std::string>& files, uint64_t seed);

}  // namespace velatura::fuzz
