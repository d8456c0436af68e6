// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace velatura::usd::crate {

/// Most bytes that `compressed` bytes of LZ4 can stand for.
inline constexpr uint64_t max_decompressed(uint64_t compressed) {
    return compressed > (uint64_t(1) << 48) ? UINT64_MAX : compressed * 255;
}

/// Most integers that `compressed` bytes of a coded array can stand for.
inline constexpr uint64_t max_decoded_integers(uint64_t compressed) {
    return compressed > (uint64_t(1) << 48) ? UINT64_MAX : compressed * 255 * 4;
}

/// Undoes compress(): one byte with the number of chunks, 0 for a single block of LZ4; else each
/// chunk with its size as int32 in front. `written` gets the bytes that came out, at most
/// out.size(). False when the data is corrupt. Ref: OpenUSD's TfFastCompression; the standard's
/// 16.3.7.1 gives both numbers 64 bits, which no file has.
bool decompress(std::string_view compressed, std::span<char> out, size_t& written);

/// Appends LZ4 of the bytes in the form above.
void compress(std::string_view plain, std::string& out);

/// Undoes encode_integers(): differences to the element before, the most common one as code 0, the
/// others in a quarter, half or all of their bytes, then LZ4. False when the data is corrupt or
/// does not hold out.size() integers. `scratch` is working space to reuse. Ref: AOUSD Core
/// Specification 1.0.1, 16.3.7.2.
bool decode_integers(std::string_view compressed, std::span<int32_t> out, std::string& scratch);
bool decode_integers(std::string_view compressed, std::span<int64_t> out, std::string& scratch);

void encode_integers(std::span<const int32_t> integers, std::string& out);
void encode_integers(std::span<const int64_t> integers, std::string& out);

}  // namespace velatura::usd::crate
