// SPDX-License-Identifier: Apache-2.0
#include "plugin/manifest.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

/// Any bytes are read, or refused with an error; no library name leads out of the folder.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace velatura;
    Diagnostics diagnostics;
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const auto manifest = plugin::parse_manifest(text, "fuzz/plugin.txt", diagnostics);
    if (manifest.has_value() != (diagnostics.error_count() == 0)) std::abort();
    if (manifest && manifest->library.find('/') != std::string::npos) std::abort();
    return 0;
}
