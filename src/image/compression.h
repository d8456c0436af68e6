// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace velatura::image {

/// How EXR files are packed. None of these loses a bit; those of EXR that do would break what light layers promise.
enum class Compression : uint8_t {
    None,
    Rle,   ///< runs of equal bytes
    Zips,  ///< deflate, a row at a time
    Zip,   ///< deflate, 16 rows at a time
    Piz,   ///< wavelets and Huffman codes, 32 rows at a time
};

}  // namespace velatura::image
