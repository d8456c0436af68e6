// SPDX-License-Identifier: Apache-2.0
#include "compositor/inspect/flip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

namespace velatura::compositor::inspect {
namespace {

using Pixel = std::array<double, 3>;
using Image = std::function<Pixel(int, int)>;

Planes drawn(int width, int height, const Image& image) {
    Planes planes{width, height, {}};
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const Pixel p = image(x, y);
            for (size_t c = 0; c < 3; ++c) planes.values[c].push_back(float(p[c]));
        }
    }
    return planes;
}

Planes uniform(double r, double g, double b) {
    return drawn(40, 30, [=](int, int) { return Pixel{r, g, b}; });
}

/// CIE 15:2004 with the Hunt effect of Andersson et al. 2020, equation 6, in double.
Pixel lab(const Pixel& rgb) {
    constexpr double m[3][3] = {{0.4123907993, 0.3575843394, 0.1804807884},
                                {0.2126390059, 0.7151686788, 0.0721923154},
                                {0.0193308187, 0.1191947798, 0.9505321522}};
    Pixel f{};
    for (size_t r = 0; r < 3; ++r) {
        double value = 0, white = 0;
        for (size_t c = 0; c < 3; ++c) {
            value += m[r][c] * rgb[c];
            white += m[r][c];
        }
        const double t = value / white;
        f[r] = t > 216.0 / 24389.0 ? std::cbrt(t) : (24389.0 / 27.0 * t + 16) / 116;
    }
    const double lightness = 116 * f[1] - 16;
    return {lightness, 5 * lightness * (f[0] - f[1]), 2 * lightness * (f[1] - f[2])};
}

double expected_of_uniform(const Pixel& a, const Pixel& b) {
    const auto distance = [](const Pixel& u, const Pixel& v) {
        const Pixel p = lab(u), q = lab(v);
        return std::pow(std::abs(p[0] - q[0]) + std::hypot(p[1] - q[1], p[2] - q[2]), 0.7);
    };
    const double share = distance(a, b) / distance({0, 1, 0}, {0, 0, 1});
    return share < 0.4 ? share / 0.4 * 0.95 : 0.95 + (share - 0.4) / 0.6 * 0.05;
}

TEST(Flip, UniformImagesDifferByTheirColorsAlone) {
    const std::vector<std::pair<Pixel, Pixel>> pairs = {
        {{0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}},   {{0, 0, 0}, {1, 1, 1}},
        {{0.2, 0.4, 0.1}, {0.21, 0.39, 0.1}}, {{0, 1, 0}, {0, 0, 1}},
        {{0.8, 0.1, 0.3}, {0.7, 0.7, 0.1}},   {{0.001, 0.002, 0.001}, {0.003, 0.001, 0.002}}};
    for (const auto& [a, b] : pairs) {
        const auto map = ldr_flip(uniform(a[0], a[1], a[2]), uniform(b[0], b[1], b[2]));
        const double expected = expected_of_uniform(a, b);
        for (const float v : map) ASSERT_NEAR(v, expected, 2e-4) << a[0] << " " << b[0];
    }
}

TEST(Flip, IsZeroWhereNothingDiffersAndTheSameEitherWay) {
    const auto stripes = [](int x, int y) {
        return Pixel{x % 3 * 0.3, y % 5 * 0.2, (x + y) % 7 * 0.1};
    };
    const auto spotted = [&](int x, int y) {
        return x > 60 && y < 8 ? Pixel{1, 0, 0} : stripes(x, y);
    };
    const Planes a = drawn(90, 30, stripes), b = drawn(90, 30, spotted);
    const auto there = ldr_flip(a, b), back = ldr_flip(b, a), none = ldr_flip(a, a);
    EXPECT_EQ(there, back);
    EXPECT_EQ(*std::max_element(none.begin(), none.end()), 0.0f);
    // Filters reach 10 pixels
    for (size_t y = 0; y < 30; ++y) {
        for (size_t x = 0; x < 90; ++x) {
            if (x < 50 || y > 18) {
                EXPECT_EQ(there[y * 90 + x], 0.0f);
            }
        }
    }
    EXPECT_GT(there[3 * 90 + 75], 0.5f);
}

/// A thin line weighs more than the same light spread out, and both less from further away.
TEST(Flip, SeesLinesAndDistance) {
    const Planes gray = uniform(0.2, 0.2, 0.2);
    const Planes line = drawn(40, 30, [](int x, int) {
        return x == 20 ? Pixel{0.5, 0.5, 0.5} : Pixel{0.2, 0.2, 0.2};
    });
    const Planes haze = drawn(40, 30, [](int x, int) {
        return std::abs(x - 20) <= 7 ? Pixel{0.22, 0.22, 0.22} : Pixel{0.2, 0.2, 0.2};
    });
    const auto at_line = [](const std::vector<float>& map) { return map[15 * 40 + 20]; };
    const float thin = at_line(ldr_flip(gray, line)), spread = at_line(ldr_flip(gray, haze));
    EXPECT_GT(thin, 1.5f * spread);
    EXPECT_LT(at_line(ldr_flip(gray, line, 2 * flip_pixels_per_degree)), thin);
}

Pixel scene(int x, int y) {
    return {(x + 1) / 16.0, (y + 1) / 32.0, ((x * y) % 17 + 1) / 64.0};
}

Pixel test_of_scene(int x, int y) {
    Pixel p = scene(x, y);
    if ((x / 5 + y / 3) % 2 == 1) {
        for (double& v : p) v *= 1.25;
    }
    const bool is_disc = (x - 40) * (x - 40) + (y - 20) * (y - 20) < 30;
    return is_disc ? Pixel{4, 0.125, 0.25} : p;
}

// What the authors' own program (FLIP 1.7, C++) prints for these two images
TEST(Flip, AgreesWithTheAuthorsProgram) {
    const Flip flip = hdr_flip(drawn(64, 48, scene), drawn(64, 48, test_of_scene));
    EXPECT_NEAR(flip.mean, 0.192910, 5e-6);
    EXPECT_NEAR(flip.largest, 0.976789, 2e-5);
    EXPECT_NEAR(flip.first_stop, 0.1364, 1e-4);
    EXPECT_NEAR(flip.last_stop, 1.0965, 5e-4);
    EXPECT_EQ(flip.exposures, 2);
}

TEST(Flip, ExposureOfBothImagesDoesNotMatter) {
    const auto scaled = [](const Image& image) {
        return [=](int x, int y) {
            Pixel p = image(x, y);
            for (double& v : p) v *= 1024;
            return p;
        };
    };
    const Flip near = hdr_flip(drawn(64, 48, scene), drawn(64, 48, test_of_scene));
    const Flip far = hdr_flip(drawn(64, 48, scaled(scene)), drawn(64, 48, scaled(test_of_scene)));
    EXPECT_NEAR(near.mean, far.mean, 1e-5);
    EXPECT_NEAR(near.first_stop, far.first_stop + 10, 1e-5);
}

TEST(Flip, BlackImagesAndBadPixelsAreNoTrouble) {
    const Flip black = hdr_flip(uniform(0, 0, 0), uniform(0, 0, 0));
    EXPECT_EQ(black.mean, 0.0);
    const Planes bad = drawn(40, 30, [](int x, int y) {
        return x == 3 && y == 3 ? Pixel{NAN, INFINITY, -1} : Pixel{0, 0, 0};
    });
    const Flip flip = hdr_flip(bad, uniform(0.5, 0.5, 0.5));
    EXPECT_TRUE(std::isfinite(flip.mean));
    EXPECT_GT(flip.mean, 0.5);
}

TEST(Flip, IsZeroOfAnImageAndItself) {
    const float infinite = std::numeric_limits<float>::infinity();
    for (const double value : {0.0, 1e-30, 0.5, 1e30, double(infinite), std::nan("")}) {
        Planes image = uniform(0.1, 0.2, 0.3);
        for (size_t i = 0; i < 40; ++i) image.values[i % 3][i] = float(value);
        const Flip same = hdr_flip(image, image);
        EXPECT_EQ(same.mean, 0.0) << value;
        EXPECT_EQ(same.largest, 0.0) << value;
        // Nor is what differs lost where a value is huge
        const Flip other = hdr_flip(image, uniform(0.3, 0.2, 0.1));
        EXPECT_GT(other.mean, 0.0) << value;
        EXPECT_LE(other.largest, 1.0) << value;
    }
}

}  // namespace
}  // namespace velatura::compositor::inspect
