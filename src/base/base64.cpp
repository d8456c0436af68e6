// SPDX-License-Identifier: Apache-2.0
#include "base/base64.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace velatura {

namespace {

constexpr std::string_view alphabet =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

}  // namespace

std::string to_base64(std::string_view bytes) {
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (size_t i = 0; i < bytes.size(); i += 3) {
        const size_t n = std::min<size_t>(3, bytes.size() - i);
        uint32_t bits = 0;
        for (size_t k = 0; k < 3; ++k)
            bits = bits << 8 | (k < n ? uint32_t(static_cast<unsigned char>(bytes[i + k])) : 0u);
        for (size_t k = 0; k < 4; ++k) text += k <= n ? alphabet[(bits >> (18 - 6 * k)) & 63] : '=';
    }
    return text;
}

std::string from_base64(std::string_view text) {
    std::array<int8_t, 256> digit_of;
    digit_of.fill(-1);
    for (size_t i = 0; i < alphabet.size(); ++i)
        digit_of[static_cast<unsigned char>(alphabet[i])] = int8_t(i);
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3);
    uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        const int8_t digit = digit_of[static_cast<unsigned char>(c)];
        if (digit < 0) break;
        bits = bits << 6 | uint32_t(digit);
        count += 6;
        if (count < 8) continue;
        count -= 8;
        bytes += char((bits >> count) & 255);
    }
    return bytes;
}

}  // namespace velatura
