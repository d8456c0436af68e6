// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <istream>
#include <string_view>

namespace velatura {

/// Whether the headers of an OpenEXR file are what they say: OpenEXR takes memory for as many bytes as an attribute says before it
/// reads them, and reads on where a value ended by its type, wherever that should have been; and for the lines or the tile that are
/// compressed together before it reads any. False where an attribute leads out of the file or is of another size than its type, and
/// where such a block has more than 64 MB and 16384 times the bytes of the file. Files that are none are left to OpenEXR to refuse. `version`: of the OpenEXR that
/// is to read it, 301 for 3.1, as it reads lists of names for ids by it.
bool has_sane_exr_headers(std::istream& file, uint64_t file_bytes, int version);

/// The same of a file in memory.
bool has_sane_exr_headers(std::string_view file, int version);

}  // namespace velatura
