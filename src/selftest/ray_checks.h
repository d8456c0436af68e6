// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "selftest/checks.h"

#include <cstdint>

namespace velatura::selftest {

Finding leaks(uint64_t amount);
Finding tree_against_loop(uint64_t amount);
Finding self_hits(uint64_t amount);

}  // namespace velatura::selftest
