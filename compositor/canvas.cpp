// SPDX-License-Identifier: Apache-2.0
#include "compositor/canvas.h"

#include <algorithm>
#include <cstring>

// A header that defines functions nobody here calls
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wdouble-promotion"
#pragma GCC diagnostic ignored "-Wuseless-cast"
#pragma GCC diagnostic ignored "-Wcast-align"
#pragma GCC diagnostic ignored "-Wcast-qual"
#include <stb/stb_easy_font.h>
#pragma GCC diagnostic pop

namespace velatura::compositor {

namespace {

constexpr int scale = 2;  // of a font of 7 pixels, its lines 12 apart

/// What stb_easy_font_print writes, four to a rectangle.
struct Corner {
    float x, y, z;
    uint32_t colour;
};

std::string printable(std::string_view text) {
    std::string ascii(text);
    for (char& c : ascii) {
        if (c < 32 || c > 126) c = '?';
    }
    return ascii;
}

}  // namespace

Canvas::Canvas(int width, int height, const Colour& background)
    : width_(width), height_(height), rgb_(3 * size_t(width) * size_t(height)) {
    fill(0, 0, width, height, background);
}

void Canvas::fill(int x, int y, int width, int height, const Colour& colour) {
    const int x1 = std::min(x + width, width_), y1 = std::min(y + height, height_);
    for (int py = std::max(y, 0); py < y1; ++py) {
        for (int px = std::max(x, 0); px < x1; ++px)
            std::copy(colour.begin(), colour.end(),
                      &rgb_[3 * (size_t(py) * size_t(width_) + size_t(px))]);
    }
}

void Canvas::paste(int x, int y, int width, int height, const std::vector<float>& rgb) {
    const int x0 = std::max(x, 0), x1 = std::min(x + width, width_);
    if (x0 >= x1) return;
    for (int py = std::max(y, 0); py < std::min(y + height, height_); ++py) {
        const float* const from = &rgb[3 * (size_t(py - y) * size_t(width) + size_t(x0 - x))];
        std::copy(from, from + 3 * size_t(x1 - x0),
                  &rgb_[3 * (size_t(py) * size_t(width_) + size_t(x0))]);
    }
}

void Canvas::write(int x, int y, int width, std::string_view text, const Colour& colour) {
    std::string ascii = printable(text);
    while (!ascii.empty() && text_width(ascii) > width) ascii.pop_back();
    std::vector<Corner> corners(80 * (ascii.size() + 1));
    const int boxes = stb_easy_font_print(0, 0, ascii.data(), nullptr, corners.data(),
                                          int(corners.size() * sizeof(Corner)));
    for (int i = 0; i < boxes; ++i) {
        const Corner& upper_left = corners[4 * size_t(i)];
        const Corner& lower_right = corners[4 * size_t(i) + 2];
        fill(x + scale * int(upper_left.x), y + scale * int(upper_left.y),
             scale * int(lower_right.x - upper_left.x), scale * int(lower_right.y - upper_left.y),
             colour);
    }
}

int Canvas::text_width(std::string_view text) {
    std::string ascii = printable(text);
    return scale * stb_easy_font_width(ascii.data());
}

}  // namespace velatura::compositor
