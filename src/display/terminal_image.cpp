// SPDX-License-Identifier: Apache-2.0
#include "display/terminal_image.h"

#include "base/base64.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

namespace velatura::display {

namespace {

std::string kitty_image(const PreviewImage& image) {
    constexpr size_t piece = 4096;
    const std::string text = to_base64(
        std::string_view(reinterpret_cast<const char*>(image.rgb.data()), image.rgb.size()));
    std::string out;
    for (size_t at = 0; at < text.size(); at += piece) {
        const bool is_last = at + piece >= text.size();
        // q=2: no answers, which nobody would read; i, p: in place of the image before
        out += at == 0 ? fmt::format("\033_Ga=T,i=1,p=1,q=2,f=24,s={},v={},m={};", image.width,
                                     image.height, is_last ? 0 : 1)
                       : fmt::format("\033_Gm={};", is_last ? 0 : 1);
        out += text.substr(at, piece);
        out += "\033\\";
    }
    return out + "\n";
}

constexpr int levels = 6;
constexpr std::array<std::array<int, 4>, 4> bayer = {
    {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}}};

/// Of 6 x 6 x 6.
uint8_t palette_index(const PreviewImage& image, int x, int y) {
    const uint8_t* rgb = &image.rgb[(size_t(y) * size_t(image.width) + size_t(x)) * 3];
    // 0 to 15/16 of a step
    const double dither = (bayer[size_t(y % 4)][size_t(x % 4)] + 0.5) / 16;
    int index = 0;
    for (int c = 0; c < 3; ++c)
        index = index * levels +
                std::min(int(double(rgb[c]) / 255 * (levels - 1) + dither), levels - 1);
    return uint8_t(index);
}

/// A run of the same six pixels.
void add_run(std::string& out, char sixel, int count) {
    if (count > 3)
        out += fmt::format("!{}{}", count, sixel);
    else
        out.append(size_t(count), sixel);
}

std::string sixel_image(const PreviewImage& image) {
    const int width = image.width, height = image.height;
    std::vector<uint8_t> indices(size_t(width) * size_t(height));
    std::array<bool, 216> is_used{};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const uint8_t index = palette_index(image, x, y);
            indices[size_t(y) * size_t(width) + size_t(x)] = index;
            is_used[index] = true;
        }
    std::string out = fmt::format("\033P0;1;0q\"1;1;{};{}", width, height);
    for (int i = 0; i < int(is_used.size()); ++i)
        if (is_used[size_t(i)])
            out += fmt::format("#{};2;{};{};{}", i, i / (levels * levels) * 20,
                               i / levels % levels * 20, i % levels * 20);
    for (int band = 0; band < height; band += 6) {
        std::array<bool, 216> is_here{};
        const int end = std::min(band + 6, height);
        for (int y = band; y < end; ++y)
            for (int x = 0; x < width; ++x)
                is_here[indices[size_t(y) * size_t(width) + size_t(x)]] = true;
        bool is_first = true;
        for (size_t color = 0; color < is_here.size(); ++color) {
            if (!is_here[color]) continue;
            if (!is_first) out += '$';
            is_first = false;
            out += fmt::format("#{}", color);
            char last = 0;
            int count = 0;
            for (int x = 0; x < width; ++x) {
                int bits = 0;
                for (int y = band; y < end; ++y)
                    if (indices[size_t(y) * size_t(width) + size_t(x)] == color)
                        bits |= 1 << (y - band);
                const char sixel = char(63 + bits);
                if (count > 0 && sixel != last) {
                    add_run(out, last, count);
                    count = 0;
                }
                last = sixel;
                ++count;
            }
            add_run(out, last, count);
        }
        out += '-';
    }
    return out + "\033\\\n";
}

}  // namespace

std::string terminal_image(TerminalProtocol protocol, const PreviewImage& image) {
    return protocol == TerminalProtocol::Kitty ? kitty_image(image) : sixel_image(image);
}

}  // namespace velatura::display
