// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"

#include <nlohmann/json_fwd.hpp>

#include <filesystem>
#include <string_view>

namespace velatura::import {

/// Gives the vertices of a glTF file as floats where they are integers of 8 or 16 bits (texture
/// coordinates and colors may be, KHR_mesh_quantization adds positions and normals): Assimp 5.2
/// takes their bytes for floats. Changes accessors in `file` and adds a buffer for them.
/// Args:    body: of a .glb file what follows the JSON, else empty; folder: of the file.
/// Returns: whether anything changed. Accessors whose bytes are not there are left as they are,
///          with an error "import-accessor".
/// Ref:     glTF 2.0, 3.6 (accessors, data alignment), 3.11 (decoding of normalized integers).
bool widen_accessors(nlohmann::json& file,
                     std::string_view body,
                     const std::filesystem::path& folder,
                     Diagnostics& diagnostics,
                     SourceLoc loc);

}  // namespace velatura::import
