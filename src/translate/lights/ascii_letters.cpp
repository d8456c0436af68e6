// SPDX-License-Identifier: Apache-2.0
#include "translate/lights/ascii_letters.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <cstdint>

namespace velatura::translate::lights {

namespace {

constexpr uint32_t first_latin = 0xC0;

/// U+00C0 to U+017F: Latin-1 letters and Latin Extended-A.
constexpr std::array latin = {
    "A", "A", "A",  "A",  "Ae", "Aa", "Ae", "C", "E",  "E", "E",  "E",  "I",  "I", "I",  "I",
    "D", "N", "O",  "O",  "O",  "O",  "Oe", "",  "Oe", "U", "U",  "U",  "Ue", "Y", "Th", "ss",
    "a", "a", "a",  "a",  "ae", "aa", "ae", "c", "e",  "e", "e",  "e",  "i",  "i", "i",  "i",
    "d", "n", "o",  "o",  "o",  "o",  "oe", "",  "oe", "u", "u",  "u",  "ue", "y", "th", "y",
    "A", "a", "A",  "a",  "A",  "a",  "C",  "c", "C",  "c", "C",  "c",  "C",  "c", "D",  "d",
    "D", "d", "E",  "e",  "E",  "e",  "E",  "e", "E",  "e", "E",  "e",  "G",  "g", "G",  "g",
    "G", "g", "G",  "g",  "H",  "h",  "H",  "h", "I",  "i", "I",  "i",  "I",  "i", "I",  "i",
    "I", "i", "IJ", "ij", "J",  "j",  "K",  "k", "k",  "L", "l",  "L",  "l",  "L", "l",  "L",
    "l", "L", "l",  "N",  "n",  "N",  "n",  "N", "n",  "n", "Ng", "ng", "O",  "o", "O",  "o",
    "O", "o", "Oe", "oe", "R",  "r",  "R",  "r", "R",  "r", "S",  "s",  "S",  "s", "S",  "s",
    "S", "s", "T",  "t",  "T",  "t",  "T",  "t", "U",  "u", "U",  "u",  "U",  "u", "U",  "u",
    "U", "u", "U",  "u",  "W",  "w",  "Y",  "y", "Y",  "Z", "z",  "Z",  "z",  "Z", "z",  "s",
};

/// The code point of well-formed UTF-8, else the byte itself.
uint32_t code_point(std::string_view text, size_t& at) {
    const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
    const uint32_t first = byte(at++);
    const size_t more = first >= 0xF0 ? 3 : first >= 0xE0 ? 2 : first >= 0xC0 ? 1 : 0;
    if (more == 0 || at + more > text.size()) return first;
    uint32_t code = first & (0x3Fu >> more);
    for (size_t i = 0; i < more; ++i) code = (code << 6) | (byte(at + i) & 0x3Fu);
    at += more;
    return code;
}

}  // namespace

std::string ascii_letters(std::string_view text, size_t& at) {
    const uint32_t code = code_point(text, at);
    if (code < 128) return std::isalnum(int(code)) != 0 ? std::string(1, char(code)) : "";
    if (code < first_latin) return "";
    if (code - first_latin < latin.size()) return latin[code - first_latin];
    return fmt::format("u{:04X}", code);
}

}  // namespace velatura::translate::lights
