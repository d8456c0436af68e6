// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace velatura::translate::lights {

/// The character of UTF-8 text at `at`, which moves past it, in ASCII letters and digits: letters
/// and digits stay, Latin ones lose their accents ("ü" is "ue", "é" is "e"), those of other scripts
/// become "u" and their code point in hexadecimal ("灯" is "u706F"); empty for everything else.
std::string ascii_letters(std::string_view text, size_t& at);

}  // namespace velatura::translate::lights
