// SPDX-License-Identifier: Apache-2.0
// Compiled once for every program, with VELATURA_FUZZ_TARGET as the name of its function.
#include "fuzz_targets.h"

#include <cstddef>
#include <cstdint>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    velatura::fuzz::VELATURA_FUZZ_TARGET(std::string_view(reinterpret_cast<const char*>(data), size));
    return 0;
}
