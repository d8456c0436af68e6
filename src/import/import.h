// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"

#include <cstddef>
#include <string>

namespace velatura::import {

/// What came out of a file.
struct ImportSummary {
    size_t meshes = 0;     ///< distinct ones
    size_t instances = 0;  ///< placements of meshes that are placed more than once
    size_t materials = 0;
    size_t lights = 0;
    size_t cameras = 0;
    size_t textures = 0;  ///< embedded images that were written beside the output
};

/// Turns a .dae, .obj, .gltf, .glb, .ply or .fbx file into a .usda layer. The layer refers to
/// textures by paths relative to itself; embedded images are written into the folder
/// "<output without suffix>_textures". What the file holds and the layer cannot say is warned
/// about. Nothing is left behind when it fails. Errors: "import-format" (suffix), "import-read"
/// (the file is not there or broken), "import-empty" (nothing to show), "import-timeout",
/// "import-crashed" (the reader works in a child process with limits on CPU time and memory),
/// "io-write".
/// A file that it names and that may not be read (asset_roots) costs an error.
Result<ImportSummary> import_file(const std::string& file,
                                  const std::string& output,
                                  Diagnostics& diagnostics);

}  // namespace velatura::import
