// SPDX-License-Identifier: Apache-2.0
// The error that a picture states of itself, where the truth is known.
#include "image/picture_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

namespace velatura::image {
namespace {

constexpr int width = 100, height = 80;

/// What one channel of a pixel is: its true value, what it shows, and the squared error that its
/// samples show of it.
struct Shown {
    double truth, mean, variance;
};

struct Picture {
    NoisyPicture noisy;
    double relative = 0;  ///< the √relMSE that it has

    RelativeError stated() const { return picture_error(width, height, noisy); }
};

Picture picture(const std::function<Shown(int, int)>& at) {
    Picture p;
    double sum = 0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const Shown s = at(x, y);
            for (NoisyChannel& channel : p.noisy) {
                channel.mean.push_back(float(s.mean));
                channel.variance.push_back(float(s.variance));
            }
            sum += relative_square((s.mean - s.truth) * (s.mean - s.truth), s.truth);
        }
    }
    p.relative = std::sqrt(sum / (width * height));
    return p;
}

/// Truth with normal noise of this relative deviation: of the mean, and of what shows it.
class Noise {
  public:
    explicit Noise(double deviation) : deviation_(deviation) {}

    Shown of(double truth) {
        const double own = normal_(engine_) * deviation_ * truth,
                     seen = normal_(engine_) * deviation_ * truth;
        return {truth, truth + own, seen * seen};
    }

    double uniform() { return std::uniform_real_distribution<double>()(engine_); }

  private:
    std::mt19937_64 engine_{11};
    std::normal_distribution<double> normal_;
    double deviation_;
};

/// Of 8000 squares of one degree of freedom: √(2 / 8000) = 1.6 % of their sum, 0.8 % of the root;
/// the found error has as much noise: 1.1 % together.
TEST(PictureError, IsThatOfEvenNoise) {
    for (const double deviation : {0.03, 0.1, 0.3, 0.5}) {
        Noise noise(deviation);
        const Picture p = picture([&](int, int) { return noise.of(1); });
        const RelativeError stated = p.stated();
        std::printf("noise %.2f: stated %.4f, found %.4f\n", deviation, stated.value, p.relative);
        EXPECT_NEAR(stated.value, p.relative, 0.05 * p.relative) << deviation;
        EXPECT_FALSE(stated.is_lower);
    }
}

/// Checks of 1 pixel to 16, ten times as bright as what is between them: bases must not blur.
TEST(PictureError, IsThatOfEvenNoiseOverTexture) {
    for (const int size : {1, 2, 4, 16}) {
        Noise noise(0.1);
        const Picture p = picture(
            [&](int x, int y) { return noise.of((x / size + y / size) % 2 == 0 ? 0.2 : 2.0); });
        const RelativeError stated = p.stated();
        std::printf("checks of %d: stated %.4f, found %.4f\n", size, stated.value, p.relative);
        EXPECT_NEAR(stated.value, p.relative, 0.06 * p.relative) << size;
    }
}

/// A bright sample in 1 of n: its pixel shows F/n in place of 0.2, and as the half that has it
/// shows twice as much and the other nothing, a squared error of (F/n)². In one of 16 pixels these
/// are many; the true error is far above 100 %.
TEST(PictureError, DoesNotHideBrightSamplesBehindThemselves) {
    for (const double bright : {1.0, 10.0, 1000.0}) {
        Noise noise(0.05);
        const Picture p = picture([&](int, int) {
            Shown s = noise.of(0.2);
            if (noise.uniform() < 1.0 / 32) {
                s.mean += bright;
                s.variance = bright * bright;
            }
            return s;
        });
        const RelativeError stated = p.stated();
        std::printf("bright samples of %g: stated %.3f, found %.3f\n", bright, stated.value,
                    p.relative);
        // One pixel cannot tell them from small bright things: no more than a lower bound
        EXPECT_TRUE(stated.is_lower);
        EXPECT_LT(stated.value, p.relative);
        EXPECT_GT(stated.value, 0.1);
    }
}

/// Four pixels in 8000: the figure is theirs alone.
TEST(PictureError, IsALowerBoundWhereFewPixelsHoldIt) {
    Noise noise(0.05);
    const Picture p = picture([&](int x, int y) {
        Shown s = noise.of(0.2);
        if (x % 50 == 25 && y % 40 == 20) {
            s.mean += 20;
            s.variance = 400;
        }
        return s;
    });
    const RelativeError stated = p.stated();
    EXPECT_TRUE(stated.is_lower);
    EXPECT_EQ(stated.half_in, 2u);
    // No more than all of the light of those four is noise
    EXPECT_LT(stated.value, p.relative);
    EXPECT_NEAR(stated.value, std::sqrt(4.0 / (width * height) + 0.05 * 0.05 * 0.04 / 0.05), 0.01);
}

/// A lamp of one pixel whose edge makes a noise of a tenth: its own brightness is what its error is
/// relative to.
TEST(PictureError, LampsOfAPixelKeepTheirBrightness) {
    Neighbourhood dark;
    for (int i = 0; i < 24; ++i) dark.add(0.2, 1e-4);
    EXPECT_GE(error_base(50, 25, dark).likely, 40.0);
    EXPECT_EQ(error_base(50, 25, dark).cautious, 50.0);
    EXPECT_NEAR(error_base(20, 400, dark).likely, 0.2, 1e-3);
    EXPECT_EQ(error_base(20, 400, dark).cautious, 20.0);
    EXPECT_EQ(error_base(3, 0, dark).likely, 3.0);
    EXPECT_EQ(error_base(3, 1, {}).likely, 3.0);
}

TEST(FewPixels, IsARuleOfHowSquaresAreSpread) {
    // n equal squares: (Σ s)² / Σ s² = n
    EXPECT_TRUE(few_pixels(99, 99, 1e5));
    EXPECT_FALSE(few_pixels(101, 101, 1e5));
    // Even noise of a small picture: a third of its pixels
    for (const double pixels : {9.0, 64.0, 300.0, 1200.0})
        EXPECT_FALSE(few_pixels(pixels, 3 * pixels, pixels)) << pixels;
    EXPECT_TRUE(few_pixels(2, 2, 64));
    EXPECT_FALSE(few_pixels(0, 0, 64));
}

}  // namespace
}  // namespace velatura::image
