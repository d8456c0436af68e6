// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "selftest/checks.h"

#include <cstdint>

namespace velatura::selftest {

Finding scaled_image(uint64_t amount);
Finding sphere_lamps(uint64_t amount);
Finding furnace(uint64_t amount);
Finding layers(uint64_t amount);
Finding threads(uint64_t amount);

}  // namespace velatura::selftest
