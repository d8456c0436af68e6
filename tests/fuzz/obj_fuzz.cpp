// SPDX-License-Identifier: Apache-2.0
#include "fuzz_targets.h"
#include "import/import.h"
#include "temporary_file.h"

#include <cstdlib>
#include <filesystem>
#include <string>

namespace velatura::fuzz {

/// Any bytes are an .obj file that becomes a layer, or is refused and leaves none; Assimp, which
/// reads it, costs no more than the process that it runs in.
void obj(std::string_view bytes) {
    const std::string layer = memory_folder() + "/fuzz.usda";
    std::error_code ignored;
    std::filesystem::remove(layer, ignored);
    Diagnostics diagnostics;
    const auto summary = import::import_file(memory_file("fuzz.obj", bytes), layer, diagnostics);
    if (summary.has_value() != std::filesystem::exists(layer)) std::abort();
}

}  // namespace velatura::fuzz
