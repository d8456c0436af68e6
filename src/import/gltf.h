// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"

#include <filesystem>
#include <optional>
#include <string>

namespace velatura::import {

/// Looks into a .gltf or .glb file before Assimp 5.2 reads it.
/// Warns ("import-extension") of every extension that the file declares and that is not imported;
/// it is an error where the file requires the extension, and import goes on with what is left.
/// Args:    bytes of the whole file, which lies in `folder`; loc: the file, for messages.
/// Returns: bytes to read instead, where Assimp would go wrong without a word and other words say
///          the same: KHR_materials_emissive_strength becomes a greater emissiveFactor, the
///          texCoord of KHR_texture_transform that of its texture, vertices of small integers
///          become floats, names of buffers are read as the URIs they are. Nothing when the file is
///          to be read as it is.
/// Ref:     glTF 2.0, 3.12 (specifying extensions) and 4.4 (GLB).
std::optional<std::string> prepare_gltf(const std::string& bytes,
                                        const std::filesystem::path& folder,
                                        Diagnostics& diagnostics,
                                        SourceLoc loc);

}  // namespace velatura::import
