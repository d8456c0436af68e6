// SPDX-License-Identifier: Apache-2.0
#include "usd/text/number_text.h"

#include "usd/layer/path.h"

#include <charconv>
#include <cmath>

namespace velatura::usd::text {

namespace {

template <class T>
void append_shortest(std::string& out, T v) {
    if (std::isnan(v)) {
        out += "nan";
        return;
    }
    if (std::isinf(v)) {
        out += v < T(0) ? "-inf" : "inf";
        return;
    }
    if (std::signbit(v)) {
        out += '-';
        v = -v;
    }
    if (v == T(0)) {
        out += '0';
        return;
    }
    // The scientific form has the shortest digits: d.ddde±xx
    char buffer[64];
    const auto end =
        std::to_chars(buffer, buffer + sizeof buffer, v, std::chars_format::scientific).ptr;
    std::string digits;
    const char* p = buffer;
    for (; p < end && *p != 'e'; ++p) {
        if (*p != '.') digits += *p;
    }
    int exponent = 0;
    const char* e = p + 1;
    if (e < end && *e == '+') ++e;
    std::from_chars(e, end, exponent);
    const int count = int(digits.size());
    if (exponent < -6 || exponent >= 15) {
        out += digits[0];
        if (count > 1) out.append(".").append(digits, 1);
        out += 'e';
        out += std::to_string(exponent);
    } else if (exponent < 0) {
        out.append("0.").append(size_t(-exponent - 1), '0').append(digits);
    } else if (count <= exponent + 1) {
        out.append(digits).append(size_t(exponent + 1 - count), '0');
    } else {
        out.append(digits, 0, size_t(exponent + 1))
            .append(".")
            .append(digits, size_t(exponent + 1));
    }
}

void append_hex(std::string& out, char c) {
    constexpr char digits[] = "0123456789abcdef";
    const auto byte = static_cast<unsigned char>(c);
    out += "\\x";
    out += digits[byte >> 4];
    out += digits[byte & 15];
}

}  // namespace

void append_number(std::string& out, double v) {
    append_shortest(out, v);
}

void append_number(std::string& out, float v) {
    append_shortest(out, v);
}

void append_quoted(std::string& out, std::string_view text) {
    const bool has_double = text.find('"') != std::string_view::npos;
    const bool has_single = text.find('\'') != std::string_view::npos;
    const char quote = has_double && !has_single ? '\'' : '"';
    const bool is_triple = text.find('\n') != std::string_view::npos;
    out.append(is_triple ? 3 : 1, quote);
    for (size_t at = 0, length = 1; at < text.size(); at += length) {
        const char c = text[at];
        length = 1;
        if (static_cast<unsigned char>(c) >= 0x80) {
            if (layer::decode_utf8(text, at, length) == 0xffffffffu) {
                length = 1;
                append_hex(out, c);
            } else {
                out.append(text, at, length);
            }
        } else if (c == '\n' && is_triple) {
            out += c;
        } else if (c == '\r') {
            out += "\\r";
        } else if (c == '\t') {
            out += "\\t";
        } else if (c == '\\' || c == quote) {
            out += '\\';
            out += c;
        } else if (c < 0x20 || c == 0x7f) {
            append_hex(out, c);
        } else {
            out += c;
        }
    }
    out.append(is_triple ? 3 : 1, quote);
}

void append_asset(std::string& out, std::string_view path) {
    if (path.find('@') == std::string_view::npos) {
        out.append("@").append(path).append("@");
        return;
    }
    out += "@@@";
    for (size_t at = 0; at < path.size();) {
        if (path.substr(at, 3) == "@@@") {
            out += "\\@@@";
            at += 3;
        } else {
            out += path[at++];
        }
    }
    out += "@@@";
}

}  // namespace velatura::usd::text
