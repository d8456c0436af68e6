// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

namespace velatura::canvas {

/// A filled rectangle of a letter, pixels from the text's upper left corner.
struct LetterBox {
    int x = 0, y = 0, width = 0, height = 0;
};

/// Height of capitals, pixels.
inline constexpr int capital_height = 7;

/// A line of text by stb_easy_font (docs/adr/0034-stb-easy-font.md): ASCII; what is not is `?`.
std::vector<LetterBox> letter_boxes(std::string_view text);

/// Pixels.
int text_width(std::string_view text);

}  // namespace velatura::canvas
