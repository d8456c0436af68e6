// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/path.h"
#include "usd/layer/unicode_tables.h"

#include <algorithm>

namespace velatura::usd::layer {

namespace {

constexpr uint32_t malformed = 0xffffffffu;

bool contains(std::span<const CodePointRange> ranges, uint32_t c) {
    const auto after =
        std::upper_bound(ranges.begin(), ranges.end(), c,
                         [](uint32_t v, const CodePointRange& r) { return v < r.first; });
    return after != ranges.begin() && c <= std::prev(after)->last;
}

bool is_ascii_letter(uint32_t c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

bool is_digit(uint32_t c) {
    return c >= '0' && c <= '9';
}

}  // namespace

uint32_t decode_utf8(std::string_view text, size_t at, size_t& length) {
    const auto byte = [&](size_t i) { return uint32_t(static_cast<unsigned char>(text[i])); };
    const uint32_t lead = byte(at);
    length = 1;
    if (lead < 0x80) return lead;
    const size_t count = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
    if (lead < 0xc2 || lead > 0xf4 || at + count > text.size()) return malformed;
    uint32_t c = lead & (0x7fu >> count);
    for (size_t i = 1; i < count; ++i) {
        const uint32_t next = byte(at + i);
        if ((next & 0xc0u) != 0x80u) return malformed;
        c = (c << 6) | (next & 0x3fu);
    }
    // Reject overlong forms, surrogates and what lies beyond Unicode
    const uint32_t smallest = count == 2 ? 0x80u : count == 3 ? 0x800u : 0x10000u;
    if (c < smallest || c > 0x10ffffu || (c >= 0xd800u && c <= 0xdfffu)) return malformed;
    length = count;
    return c;
}

bool is_xid_start(uint32_t c) {
    return c < 0x80 ? is_ascii_letter(c) : c != malformed && contains(xid_start_ranges(), c);
}

bool is_xid_continue(uint32_t c) {
    if (c < 0x80) return is_ascii_letter(c) || is_digit(c) || c == '_';
    return c != malformed && contains(xid_continue_ranges(), c);
}

bool is_identifier(std::string_view text) {
    if (text.empty()) return false;
    for (size_t at = 0, length = 0; at < text.size(); at += length) {
        const uint32_t c = decode_utf8(text, at, length);
        if (!(at == 0 ? c == '_' || is_xid_start(c) : is_xid_continue(c))) return false;
    }
    return true;
}

bool is_namespaced_identifier(std::string_view text) {
    while (true) {
        const size_t colon = text.find(':');
        if (!is_identifier(text.substr(0, colon))) return false;
        if (colon == std::string_view::npos) return true;
        text.remove_prefix(colon + 1);
    }
}

bool is_variant_name(std::string_view text) {
    if (text.empty()) return false;
    size_t at = text[0] == '.' ? 1 : 0;
    for (size_t length = 0; at < text.size(); at += length) {
        const uint32_t c = decode_utf8(text, at, length);
        if (c != '|' && c != '-' && !is_xid_continue(c)) return false;
    }
    return true;
}

}  // namespace velatura::usd::layer
