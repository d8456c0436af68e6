// SPDX-License-Identifier: Apache-2.0
#include "compositor/exports/web_pack.h"

#include "base/check.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <vector>

namespace velatura::compositor::exports {

namespace {

constexpr int left = 0, median = 1, mean = 2;

/// Negative halves, whose bits grow as they fall, in the order of values: −0 is −1.
int16_t ordered(uint16_t bits) {
    return int16_t((bits & 0x8000u) != 0 ? uint16_t(~(bits & 0x7fffu)) : bits);
}

int16_t predict(int predictor, int16_t w, int16_t n, int16_t nw) {
    if (predictor == left) return w;
    if (predictor == mean) return int16_t((int(w) + int(n)) >> 1);
    const auto [low, high] = std::minmax(w, n);
    if (nw >= high) return low;
    if (nw <= low) return high;
    return int16_t(int(w) + int(n) - int(nw));
}

/// One plane of differences from what its neighbors predict.
std::vector<uint16_t> residuals(const std::vector<int16_t>& plane, int width, int predictor) {
    std::vector<uint16_t> out(plane.size());
    const auto row = size_t(width);
    for (size_t i = 0; i < plane.size(); ++i) {
        const bool is_first = i % row == 0, is_top = i < row;
        int16_t guess = 0;
        if (is_first) {
            guess = is_top ? int16_t(0) : plane[i - row];
        } else if (is_top) {
            guess = plane[i - 1];
        } else {
            guess = predict(predictor, plane[i - 1], plane[i - row], plane[i - row - 1]);
        }
        const auto difference = int16_t(uint16_t(plane[i]) - uint16_t(guess));
        // Small either way is a small number
        out[i] = uint16_t((uint16_t(difference) << 1) ^ uint16_t(difference >> 15));
    }
    return out;
}

size_t bits_of(const std::vector<uint16_t>& values) {
    size_t bits = 0;
    for (const uint16_t v : values) bits += size_t(std::bit_width(v));
    return bits;
}

}  // namespace

std::string pack_planes(std::span<const uint16_t> rgb, int width, int height) {
    const size_t pixels = size_t(width) * size_t(height);
    VELATURA_CHECK(rgb.size() == 3 * pixels, "an image has three values for each pixel");
    std::string bytes(3 + 6 * pixels, '\0');
    for (size_t c = 0; c < 3; ++c) {
        static constexpr std::array<size_t, 3> channel = {1, 0, 2};
        std::vector<int16_t> plane(pixels);
        for (size_t i = 0; i < pixels; ++i) {
            const int16_t green = ordered(rgb[3 * i + 1]);
            const int16_t value = ordered(rgb[3 * i + channel[c]]);
            plane[i] = c == 0 ? green : int16_t(uint16_t(value) - uint16_t(green));
        }
        std::vector<uint16_t> best;
        size_t fewest = size_t(-1);
        for (const int predictor : {left, median, mean}) {
            std::vector<uint16_t> tried = residuals(plane, width, predictor);
            const size_t bits = bits_of(tried);
            if (bits >= fewest) continue;
            fewest = bits;
            best = std::move(tried);
            bytes[c] = char(predictor);
        }
        char* low = bytes.data() + 3 + 2 * c * pixels;
        char* high = low + pixels;
        for (size_t i = 0; i < pixels; ++i) {
            low[i] = char(best[i] & 255u);
            high[i] = char(best[i] >> 8);
        }
    }
    uLongf size = compressBound(uLong(bytes.size()));
    std::string packed(size, '\0');
    const int outcome =
        compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                  reinterpret_cast<const Bytef*>(bytes.data()), uLong(bytes.size()), 6);
    VELATURA_CHECK(outcome == Z_OK, "bytes in memory can be compressed");
    packed.resize(size);
    return packed;
}

}  // namespace velatura::compositor::exports
