// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <OpenEXR/ImfForward.h>

#include <cstdint>
#include <string>

namespace velatura::image {

/// Rows of a part that are compressed together: by the compression (OpenEXR file layout), or those
/// of a tile.
int rows_per_chunk_of(const Imf::Header& header);

/// The most bytes of pixels that one byte of a file can stand for.
uint64_t max_expansion(const Imf::Header& header);

/// A part takes at least so many bytes of its file: the table of its chunks, their headers, and its
/// pixels as small as its compression ever makes them. Of deep parts the counts of samples only.
uint64_t min_bytes_of(const Imf::Header& header);

/// Before OpenEXR opens a file. Errors: "io-open", with the file, where exr_header_error finds
/// one.
Result<void> check_headers(const std::string& path);

}  // namespace velatura::image
