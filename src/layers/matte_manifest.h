// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "layers/cryptomatte.h"

#include <string>
#include <string_view>
#include <vector>

namespace velatura::layers {

/// The names of a Cryptomatte, and what is wrong with how they are stored.
struct Manifest {
    std::vector<MatteName> names;
    std::string fault;  ///< empty: nothing
};

/// Reads {"name":"hex id", …}, also where it is no JSON: with quotes or backslashes in names that
/// are not escaped, as Blender writes them, commas too many, or an end that is missing. Of a name
/// that can be read in two ways, the one whose hash is the id counts.
Manifest read_manifest(std::string_view text);

/// Reads one from the file beside an image. Only a file below the image's own folder.
Manifest read_manifest_file(const std::string& image_path, const std::string& name);

}  // namespace velatura::layers
