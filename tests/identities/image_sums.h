// SPDX-License-Identifier: Apache-2.0
// Sums over images of small renders, with the standard errors that their halves show.
#pragma once

#include "accumulate/pixel_means.h"
#include "film/film.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace velatura::test {

/// A part of the light of an image: two independent estimates per pixel, mean over the channels.
struct ImageLight {
    std::vector<std::array<double, 2>> halves;  ///< row by row
    int width = 0;

    ImageLight plus(const ImageLight& o, double factor) const {
        ImageLight sum = *this;
        for (size_t i = 0; i < halves.size(); ++i)
            for (size_t h = 0; h < 2; ++h) sum.halves[i][h] += factor * o.halves[i][h];
        return sum;
    }

    ImageLight operator+(const ImageLight& o) const { return plus(o, 1.0); }

    ImageLight operator-(const ImageLight& o) const { return plus(o, -1.0); }
};

/// Of a film with halves that has samples in both.
inline ImageLight light_of(const film::Film& film, uint32_t accumulator) {
    const film::Window& w = film.window();
    ImageLight light;
    light.width = w.width();
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const accumulate::PixelHalves h =
                accumulate::resolve_halves(film.sums(), x, y, accumulator);
            EXPECT_TRUE(h.is_known);
            light.halves.push_back(
                {(h.a[0] + h.a[1] + h.a[2]) / 3, (h.b[0] + h.b[1] + h.b[2]) / 3});
        }
    }
    return light;
}

/// A sum over pixels of independent estimates.
struct PixelSum {
    double value = 0, variance = 0;

    void add(const std::array<double, 2>& halves) {
        value += 0.5 * (halves[0] + halves[1]);
        variance += 0.25 * (halves[0] - halves[1]) * (halves[0] - halves[1]);
    }
};

inline PixelSum whole(const ImageLight& light) {
    PixelSum sum;
    for (const auto& h : light.halves) sum.add(h);
    return sum;
}

/// How far a sum is from zero, in its standard errors.
inline double distance(const PixelSum& sum) {
    constexpr double rounding = 1e-6;  // where nothing is left to chance
    return std::abs(sum.value) < rounding ? 0.0 : std::abs(sum.value) / std::sqrt(sum.variance);
}

inline double distance(const ImageLight& difference) {
    return distance(whole(difference));
}

/// Mean square of that over four quarters of the image; near 1 for noise alone.
inline double mean_square_of_quarters(const ImageLight& difference) {
    std::array<PixelSum, 4> quarters;
    const size_t width = size_t(difference.width), height = difference.halves.size() / width;
    for (size_t y = 0; y < height; ++y) {
        for (size_t x = 0; x < width; ++x)
            quarters[2 * (2 * y / height) + 2 * x / width].add(difference.halves[y * width + x]);
    }
    // Where only rare samples tell anything, the halves of a quarter may agree by chance
    const double min = whole(difference).variance / 16;
    double square = 0;
    for (PixelSum& s : quarters) {
        s.variance = std::max(s.variance, min);
        square += distance(s) * distance(s) / 4;
    }
    return square;
}

}  // namespace velatura::test
