// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "selftest/checks.h"

#include <cstdint>

namespace velatura::selftest {

Finding frames(uint64_t amount);
Finding ggx_distribution(uint64_t amount);
Finding metal_energy(uint64_t amount);
Finding fresnel(uint64_t amount);
Finding scattering(uint64_t amount);
Finding mis_weights(uint64_t amount);
Finding sums(uint64_t amount);
Finding random_numbers(uint64_t amount);

}  // namespace velatura::selftest
