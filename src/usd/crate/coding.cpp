// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/coding.h"

#include "base/check.h"
#include "usd/crate/append.h"

#include <lz4.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <type_traits>
#include <unordered_map>
#include <vector>

namespace velatura::usd::crate {

namespace {

constexpr size_t max_chunk = LZ4_MAX_INPUT_SIZE;
constexpr size_t max_chunks = 127;

/// One block of LZ4; the bytes that came out, negative when corrupt.
int decompress_block(std::string_view block, std::span<char> out) {
    constexpr size_t limit = size_t(std::numeric_limits<int>::max());
    if (block.size() > limit) return -1;
    return LZ4_decompress_safe(block.data(), out.data(), int(block.size()),
                               int(std::min(out.size(), limit)));
}

template <class Int>
using Quarter = std::conditional_t<sizeof(Int) == 4, int8_t, int16_t>;
template <class Int>
using Half = std::conditional_t<sizeof(Int) == 4, int16_t, int32_t>;

template <class Int>
constexpr size_t code_width(unsigned code) {
    return code == 0 ? 0 : sizeof(Int) >> (3 - code);
}

/// Bytes that the four codes of one byte stand for.
template <class Int>
constexpr std::array<uint8_t, 256> make_widths() {
    std::array<uint8_t, 256> widths{};
    for (unsigned byte = 0; byte < 256; ++byte) {
        for (unsigned i = 0; i < 4; ++i) {
            widths[byte] = uint8_t(widths[byte] + code_width<Int>((byte >> (2 * i)) & 3));
        }
    }
    return widths;
}

template <class T>
T load(const char*& p) {
    T value;
    std::memcpy(&value, p, sizeof value);
    p += sizeof value;
    return value;
}

/// The difference of one code; moves past its bytes.
template <class Int>
Int difference(unsigned code, Int common, const char*& data) {
    switch (code) {
        case 0:
            return common;
        case 1:
            return load<Quarter<Int>>(data);
        case 2:
            return load<Half<Int>>(data);
        default:
            return load<Int>(data);
    }
}

template <class Int>
bool decode(std::string_view coded, std::span<Int> out) {
    using Unsigned = std::make_unsigned_t<Int>;
    static constexpr std::array<uint8_t, 256> widths = make_widths<Int>();
    const size_t code_bytes = (out.size() + 3) / 4;
    if (coded.size() < sizeof(Int) + code_bytes) return false;
    const char* at = coded.data();
    const Int common = load<Int>(at);
    const auto* codes = reinterpret_cast<const uint8_t*>(at);
    const char* data = at + code_bytes;
    // Bits after the last code are padding
    const size_t whole = out.size() / 4;
    const size_t rest = out.size() % 4;
    size_t needed = 0;
    for (size_t i = 0; i < whole; ++i) needed += widths[codes[i]];
    if (rest != 0) needed += widths[codes[whole] & ((1u << (2 * rest)) - 1)];
    if (needed > coded.size() - sizeof(Int) - code_bytes) return false;
    // Unsigned, so that corrupt sums wrap
    Unsigned value = 0;
    Int* to = out.data();
    for (size_t i = 0; i < whole; ++i) {
        const unsigned byte = codes[i];
        for (unsigned k = 0; k < 4; ++k) {
            value += Unsigned(difference((byte >> (2 * k)) & 3, common, data));
            *to++ = Int(value);
        }
    }
    for (unsigned k = 0; k < rest; ++k) {
        value += Unsigned(difference((unsigned(codes[whole]) >> (2 * k)) & 3, common, data));
        *to++ = Int(value);
    }
    return true;
}

template <class Int>
bool decode_compressed(std::string_view compressed, std::span<Int> out, std::string& scratch) {
    if (out.empty()) return true;
    if (out.size() > max_decoded_integers(compressed.size())) return false;
    scratch.resize(sizeof(Int) + (out.size() + 3) / 4 + out.size() * sizeof(Int));
    size_t written = 0;
    if (!decompress(compressed, scratch, written)) return false;
    return decode<Int>(std::string_view(scratch).substr(0, written), out);
}

template <class Int>
Int max_common(const std::vector<Int>& differences) {
    std::unordered_map<Int, size_t> counts;
    Int best = 0;
    size_t best_count = 0;
    for (const Int d : differences) {
        const size_t count = ++counts[d];
        // Of equally common ones the greater, whatever the order they come in
        if (count > best_count || (count == best_count && d > best)) {
            best = d;
            best_count = count;
        }
    }
    return best;
}

template <class Int>
void encode(std::span<const Int> integers, std::string& out) {
    using Unsigned = std::make_unsigned_t<Int>;
    if (integers.empty()) return compress({}, out);
    std::vector<Int> differences(integers.size());
    Unsigned previous = 0;
    for (size_t i = 0; i < integers.size(); ++i) {
        differences[i] = Int(Unsigned(integers[i]) - previous);
        previous = Unsigned(integers[i]);
    }
    const Int common = max_common(differences);
    std::string codes((integers.size() + 3) / 4, '\0');
    std::string data;
    for (size_t i = 0; i < differences.size(); ++i) {
        const Int d = differences[i];
        unsigned code = 0;
        if (d == common) {
            code = 0;
        } else if (d == Quarter<Int>(d)) {
            code = 1;
            append(data, Quarter<Int>(d));
        } else if (d == Half<Int>(d)) {
            code = 2;
            append(data, Half<Int>(d));
        } else {
            code = 3;
            append(data, d);
        }
        codes[i / 4] = char(uint8_t(codes[i / 4]) | code << (2 * (i % 4)));
    }
    std::string coded;
    append(coded, common);
    compress(coded + codes + data, out);
}

}  // namespace

bool decompress(std::string_view compressed, std::span<char> out, size_t& written) {
    written = 0;
    if (compressed.empty()) return false;
    const auto chunks = uint8_t(compressed.front());
    compressed.remove_prefix(1);
    if (chunks == 0) {
        const int n = decompress_block(compressed, out);
        if (n < 0) return false;
        written = size_t(n);
        return true;
    }
    if (chunks > max_chunks) return false;
    for (unsigned i = 0; i < chunks; ++i) {
        int32_t size = 0;
        if (compressed.size() < sizeof size) return false;
        std::memcpy(&size, compressed.data(), sizeof size);
        compressed.remove_prefix(sizeof size);
        if (size < 0 || size_t(size) > compressed.size()) return false;
        const int n = decompress_block(compressed.substr(0, size_t(size)), out.subspan(written));
        if (n < 0) return false;
        written += size_t(n);
        compressed.remove_prefix(size_t(size));
    }
    return true;
}

void compress(std::string_view plain, std::string& out) {
    VELATURA_CHECK(plain.size() <= max_chunks * max_chunk, "more than a crate's compression holds");
    const auto block = [&](std::string_view part) {
        const int bound = LZ4_compressBound(int(part.size()));
        const size_t start = out.size();
        out.resize(start + size_t(bound));
        const int n =
            LZ4_compress_default(part.data(), out.data() + start, int(part.size()), bound);
        VELATURA_CHECK(n > 0, "LZ4 output fits its own bound");
        out.resize(start + size_t(n));
        return int32_t(n);
    };
    if (plain.size() <= max_chunk) {
        out += '\0';
        block(plain);
        return;
    }
    out += char((plain.size() + max_chunk - 1) / max_chunk);
    for (size_t at = 0; at < plain.size(); at += max_chunk) {
        const size_t start = out.size();
        append(out, int32_t(0));
        const int32_t size = block(plain.substr(at, max_chunk));
        std::memcpy(out.data() + start, &size, sizeof size);
    }
}

bool decode_integers(std::string_view compressed, std::span<int32_t> out, std::string& scratch) {
    return decode_compressed(compressed, out, scratch);
}

bool decode_integers(std::string_view compressed, std::span<int64_t> out, std::string& scratch) {
    return decode_compressed(compressed, out, scratch);
}

void encode_integers(std::span<const int32_t> integers, std::string& out) {
    encode(integers, out);
}

void encode_integers(std::span<const int64_t> integers, std::string& out) {
    encode(integers, out);
}

}  // namespace velatura::usd::crate
