// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <istream>
#include <string>
#include <string_view>

namespace velatura {

/// Lines of a part without tiles that are compressed together, by the number of its `compression`;
/// the most for unknown ones. Ref: OpenEXR, "File Layout", "Chunk Layout"; 256 for DWAB.
int exr_lines_per_chunk(uint32_t compression);

/// What is wrong with the headers of an OpenEXR file; empty where they are what they say. OpenEXR
/// takes memory for as many bytes as an attribute says before it reads them, and for the lines or
/// the tile that are compressed together when it opens a file; and it reads on where a value ended
/// by its type, wherever that should have been. Wrong is an attribute that leads out of the file or
/// is of another size than its type, and lines that are compressed together, or a tile, of more
/// than 64 MB and 16384 times the bytes of the file. Files that are none are left to OpenEXR to
/// refuse. `version`: of the OpenEXR that is to read it, 301 for 3.1, as it reads lists of names
/// for ids by it.
std::string exr_header_error(std::istream& file, uint64_t file_bytes, int version);

/// The same of a file in memory.
std::string exr_header_error(std::string_view file, int version);

}  // namespace velatura
