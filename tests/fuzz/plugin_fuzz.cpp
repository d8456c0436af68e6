// SPDX-License-Identifier: Apache-2.0
#include "fuzz_targets.h"
#include "plugin/manifest.h"

#include <cstdlib>
#include <string_view>

namespace velatura::fuzz {

/// Any bytes are read, or refused with an error; no library name leads out of the folder.
void plugin(std::string_view bytes) {
    Diagnostics diagnostics;
    const auto manifest = plugin::parse_manifest(bytes, "fuzz/plugin.txt", diagnostics);
    if (manifest.has_value() != (diagnostics.error_count() == 0)) std::abort();
    if (manifest && manifest->library.find('/') != std::string::npos) std::abort();
}

}  // namespace velatura::fuzz
