// SPDX-License-Identifier: Apache-2.0
#include "canvas/pixel_font.h"

#include <cstdint>
#include <string>

// A header that defines functions nobody here calls
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wdouble-promotion"
#pragma GCC diagnostic ignored "-Wfloat-conversion"
#include <stb/stb_easy_font.h>
#pragma GCC diagnostic pop

namespace velatura::canvas {

namespace {

/// What stb_easy_font_print writes, four to a rectangle.
struct Corner {
    float x, y, z;
    uint32_t color;
};

std::string printable(std::string_view text) {
    std::string ascii(text);
    for (char& c : ascii) {
        if (c < 32 || c > 126) c = '?';
    }
    return ascii;
}

}  // namespace

std::vector<LetterBox> letter_boxes(std::string_view text) {
    std::string ascii = printable(text);
    std::vector<Corner> corners(80 * (ascii.size() + 1));
    const int count = stb_easy_font_print(0, 0, ascii.data(), nullptr, corners.data(),
                                          int(corners.size() * sizeof(Corner)));
    std::vector<LetterBox> boxes;
    for (int i = 0; i < count; ++i) {
        const Corner &upper_left = corners[4 * size_t(i)],
                     &lower_right = corners[4 * size_t(i) + 2];
        boxes.push_back({int(upper_left.x), int(upper_left.y), int(lower_right.x - upper_left.x),
                         int(lower_right.y - upper_left.y)});
    }
    return boxes;
}

int text_width(std::string_view text) {
    std::string ascii = printable(text);
    return stb_easy_font_width(ascii.data());
}

}  // namespace velatura::canvas
