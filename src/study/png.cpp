// SPDX-License-Identifier: Apache-2.0
#include "study/png.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "base/check.h"

namespace velatura::study {

namespace {

void put_32(std::string& out, uint32_t v) {
    for (const int shift : {24, 16, 8, 0}) out += char(v >> shift & 0xff);
}

uint32_t crc_of(const std::string& bytes) {
    uint32_t crc = 0xffffffffu;
    for (const char b : bytes) {
        crc ^= uint32_t(static_cast<unsigned char>(b));
        for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (crc & 1 ? 0xedb88320u : 0u);
    }
    return ~crc;
}

void put_chunk(std::string& out, const std::string& type, const std::string& data) {
    put_32(out, uint32_t(data.size()));
    const std::string body = type + data;
    out += body;
    put_32(out, crc_of(body));
}

/// A zlib stream of stored blocks.
std::string stored(const std::string& bytes) {
    constexpr size_t longest = 65535;
    std::string out("\x78\x01", 2);
    for (size_t at = 0; at < bytes.size(); at += longest) {
        const size_t n = std::min(longest, bytes.size() - at);
        out += char(at + n == bytes.size() ? 1 : 0);
        for (const size_t v : {n, n ^ 0xffff}) {
            out += char(v & 0xff);
            out += char(v >> 8);
        }
        out.append(bytes, at, n);
    }
    uint32_t a = 1, b = 0;
    for (const char c : bytes) {
        a = (a + uint32_t(static_cast<unsigned char>(c))) % 65521;
        b = (b + a) % 65521;
    }
    put_32(out, b << 16 | a);
    return out;
}

}  // namespace

std::string to_png(int width, int height, const std::vector<float>& rgb) {
    VELATURA_CHECK(rgb.size() == 3 * size_t(width) * size_t(height), "a picture has three values for each pixel");
    std::string rows;
    for (int y = 0; y < height; ++y) {
        rows += '\0';
        for (size_t i = 3 * size_t(y) * size_t(width); i < 3 * size_t(y + 1) * size_t(width); ++i) rows += char(std::lround(std::clamp(rgb[i], 0.0f, 1.0f) * 255.0f));
    }
    std::string out("\x89PNG\r\n\x1a\n", 8), head;
    put_32(head, uint32_t(width));
    put_32(head, uint32_t(height));
    head += std::string("\x08\x02\x00\x00\x00", 5);
    put_chunk(out, "IHDR", head);
    put_chunk(out, "IDAT", stored(rows));
    put_chunk(out, "IEND", {});
    return out;
}

std::string to_base64(const std::string& bytes) {
    static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (size_t i = 0; i < bytes.size(); i += 3) {
        uint32_t v = 0;
        for (size_t k = 0; k < 3; ++k) v = v << 8 | (i + k < bytes.size() ? uint32_t(static_cast<unsigned char>(bytes[i + k])) : 0u);
        for (size_t k = 0; k < 4; ++k) out += i + k <= bytes.size() ? digits[v >> (18 - 6 * k) & 63] : '=';
    }
    return out;
}

}  // namespace velatura::study
