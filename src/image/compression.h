// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <utility>

namespace velatura::image {

/// How EXR files are packed. None of these loses a bit; those of EXR that do would break what light
/// layers promise.
enum class Compression : uint8_t {
    None,
    Rle,   ///< runs of equal bytes
    Zips,  ///< deflate, a row at a time
    Zip,   ///< deflate, 16 rows at a time
    Piz,   ///< wavelets and Huffman codes, 32 rows at a time
};

/// What --exr-compression calls them.
inline constexpr std::array<std::pair<const char*, Compression>, 5> compression_table = {
    {{"none", Compression::None},
     {"rle", Compression::Rle},
     {"zips", Compression::Zips},
     {"zip", Compression::Zip},
     {"piz", Compression::Piz}}};

}  // namespace velatura::image
