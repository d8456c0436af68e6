// SPDX-License-Identifier: Apache-2.0
#include "fuzz_targets.h"
#include "import/gltf.h"
#include "temporary_file.h"

#include <cstdlib>
#include <string>

namespace velatura::fuzz {

/// Any bytes are a .gltf or .glb file that is looked into, or left alone; what takes their place is
/// of the same kind.
void gltf(std::string_view bytes) {
    Diagnostics diagnostics;
    const auto better = import::prepare_gltf(std::string(bytes), memory_folder(), diagnostics, {});
    if (better && better->starts_with("glTF") != bytes.starts_with("glTF")) std::abort();
}

}  // namespace velatura::fuzz
