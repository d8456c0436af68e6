// SPDX-License-Identifier: Apache-2.0
// The error that an image states of itself, where the truth is known.
#include "statistics/image_error.h"

#include <gtest/gtest.h>

#include <algorithm>
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

struct Image {
    statistics::NoisyImage noisy;
    double relative = 0;  ///< the √relMSE that it has

    statistics::RelativeError stated() const {
        return statistics::image_error(width, height, noisy);
    }
};

Image image(const std::function<Shown(int, int)>& at) {
    Image p;
    double sum = 0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const Shown s = at(x, y);
            for (statistics::NoisyChannel& channel : p.noisy) {
                channel.mean.push_back(float(s.mean));
                channel.variance.push_back(float(s.variance));
            }
            sum += statistics::relative_square((s.mean - s.truth) * (s.mean - s.truth), s.truth);
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
TEST(ImageError, IsThatOfEvenNoise) {
    for (const double deviation : {0.03, 0.1, 0.3, 0.5}) {
        Noise noise(deviation);
        const Image p = image([&](int, int) { return noise.of(1); });
        const statistics::RelativeError stated = p.stated();
        std::printf("noise %.2f: stated %.4f, found %.4f\n", deviation, stated.value, p.relative);
        EXPECT_NEAR(stated.value, p.relative, 0.05 * p.relative) << deviation;
        EXPECT_FALSE(stated.is_lower);
    }
}

/// Checks of 1 pixel to 16, ten times as bright as what is between them: bases must not blur.
TEST(ImageError, IsThatOfEvenNoiseOverTexture) {
    for (const int size : {1, 2, 4, 16}) {
        Noise noise(0.1);
        const Image p = image(
            [&](int x, int y) { return noise.of((x / size + y / size) % 2 == 0 ? 0.2 : 2.0); });
        const statistics::RelativeError stated = p.stated();
        std::printf("checks of %d: stated %.4f, found %.4f\n", size, stated.value, p.relative);
        EXPECT_NEAR(stated.value, p.relative, 0.06 * p.relative) << size;
    }
}

/// The two halves of a pixel, as samples of them give them.
Shown of_halves(double truth, double a, double b) {
    return {truth, (a + b) / 2, (a - b) * (a - b) / 4};
}

/// Noise with an exponential tail: each half is the mean of k samples that are exponentially
/// distributed, of k real: gamma(k) / k of a relative variance of 1/k; of both 1/(2 k) = ρ².
Shown of_exponential_samples(double truth, double deviation, std::mt19937_64& engine) {
    const double k = 1 / (2 * deviation * deviation);
    std::gamma_distribution<double> gamma(k, truth / k);
    const double a = gamma(engine);
    return of_halves(truth, a, gamma(engine));
}

/// Of a lower bound the worst pixel is known, by its place in the image.
TEST(ImageError, NamesTheWorstPixel) {
    Noise noise(0.03);
    const Image p = image(
        [&](int x, int y) { return x == 37 && y == 70 ? of_halves(1, 400, 1) : noise.of(1); });
    const statistics::RelativeError stated = p.stated();
    ASSERT_TRUE(stated.is_lower);
    EXPECT_EQ(stated.worst_x, 37);
    EXPECT_EQ(stated.worst_y, 70);
}

/// Samples that are never far above their mean make no lower bound: of 100 images each with normal
/// and with exponential tails, over a ramp and an edge of 1 to 10, 5 % ± 2.2 of chance would be
/// let pass as 95 % of confidence; found is none.
TEST(ImageError, IsNoLowerBoundByChance) {
    std::mt19937_64 engine(5);
    int bounds = 0;
    double worst = 0;
    constexpr int images = 20;
    for (const double deviation : {0.02, 0.1, 0.2, 0.3, 0.4}) {
        Noise noise(deviation);
        for (int n = 0; n < images; ++n) {
            for (const bool is_normal : {true, false}) {
                const Image p = image([&](int x, int y) {
                    const double truth = x + y < 90 ? 0.3 + 0.01 * y : 3;
                    return is_normal ? noise.of(truth)
                                     : of_exponential_samples(truth, deviation, engine);
                });
                const statistics::RelativeError stated = p.stated();
                bounds += stated.is_lower;
                worst = std::max(worst, std::abs(stated.value / p.relative - 1));
            }
        }
    }
    std::printf("%d of %d are lower bounds, the others are up to %.3f off\n", bounds,
                5 * 2 * images, worst);
    EXPECT_EQ(bounds, 0);
    EXPECT_LT(worst, 0.1);
}

/// A bright sample in 1 of 32 pixels: its pixel shows F in addition to 0.2, and as the half that
/// has it shows twice as much and the other nothing, a squared error of F². The true mean is 0.2 +
/// F/32; of pixels whose neighbors met none it may be as low as 0.2: a lower bound, unless F is no
/// more than the rest of the noise.
TEST(ImageError, DoesNotHideBrightSamplesBehindThemselves) {
    const struct {
        double bright;
        bool is_lower;
    } cases[] = {{0.2, false}, {10, true}, {1000, true}};

    for (const auto& c : cases) {
        Noise noise(0.2);
        const Image p = image([&](int, int) {
            Shown s = noise.of(0.2);
            s.truth += c.bright / 32;
            if (noise.uniform() < 1.0 / 32) {
                s.mean += c.bright;
                s.variance += c.bright * c.bright;
            }
            return s;
        });
        const statistics::RelativeError stated = p.stated();
        std::printf("bright samples of %g: stated %.3f%s, found %.3f\n", c.bright, stated.value,
                    stated.is_lower ? " or more" : "", p.relative);
        EXPECT_EQ(stated.is_lower, c.is_lower);
        EXPECT_LT(stated.value, 1.1 * p.relative);
        EXPECT_GT(stated.value, c.is_lower ? 0.1 : 0.9 * p.relative);
    }
}

/// Edges of a lamp: in 10 rows of pixels the lamp covers a part p of each, of any size. 16 samples,
/// 8 in each half; so bright that one sample is `contrast` times the dark beside it. Pixels that it
/// hardly covers and that met it hold the error, unless it is not much brighter: the second moment
/// of their squares is contrast²/2. Either the figure is found within a tenth or it is a bound.
TEST(ImageError, IsALowerBoundAtTheEdgesOfBrightLamps) {
    const struct {
        double contrast;
        bool is_lower;
    } cases[] = {{0.1, false}, {100, true}, {3000, true}};

    for (const auto& c : cases) {
        std::mt19937_64 engine(3);
        std::uniform_real_distribution<double> uniform;
        const double dark = 0.2, lamp = 16 * c.contrast * dark;
        const Image p = image([&](int, int y) {
            const bool is_edge = y % 8 == 0, is_lamp = y % 8 < 4;
            const double coverage = is_edge ? uniform(engine) : is_lamp ? 1 : 0;
            std::binomial_distribution<int> hits(8, coverage);
            const auto half = [&] { return dark + lamp * hits(engine) / 8.0; };
            const double a = half();
            return of_halves(dark + lamp * coverage, a, half());
        });
        const statistics::RelativeError stated = p.stated();
        std::printf("lamps of %g: stated %.4f%s, found %.4f\n", c.contrast, stated.value,
                    stated.is_lower ? " or more" : "", p.relative);
        EXPECT_EQ(stated.is_lower, c.is_lower) << c.contrast;
        EXPECT_LT(stated.value, 1.1 * p.relative);
        EXPECT_TRUE(stated.is_lower || stated.value > 0.9 * p.relative);
    }
}

/// 400 bright dots that fill a part of their pixel, which its samples meet 10 times in the mean:
/// what one half met of them the other did too. Relative to the dark around them the figure would
/// be far too large.
TEST(ImageError, DoesNotTakeSmallBrightThingsForRareSamples) {
    std::mt19937_64 engine(7);
    std::poisson_distribution<int> hits(5);
    const Image p = image([&](int x, int y) {
        if (x % 5 || y % 4) return Shown{0.02, 0.02, 1e-8};
        const double a = 0.02 + 10 * hits(engine);
        return of_halves(50.02, a, 0.02 + 10 * hits(engine));
    });
    const statistics::RelativeError stated = p.stated();
    std::printf("bright dots: stated %.4f%s, found %.4f\n", stated.value,
                stated.is_lower ? " or more" : "", p.relative);
    EXPECT_LT(stated.value, 1.25 * p.relative);
    EXPECT_TRUE(stated.is_lower || stated.value > 0.9 * p.relative);
}

/// Four pixels in 8000: the figure is theirs alone.
TEST(ImageError, IsALowerBoundWhereFewPixelsHoldIt) {
    Noise noise(0.05);
    const Image p = image([&](int x, int y) {
        Shown s = noise.of(0.2);
        if (x % 50 == 25 && y % 40 == 20) {
            s.mean += 20;
            s.variance = 400;
        }
        return s;
    });
    const statistics::RelativeError stated = p.stated();
    EXPECT_TRUE(stated.is_lower);
    EXPECT_EQ(stated.half_in, 2u);
    // No more than all of the light of those four is noise
    EXPECT_LT(stated.value, p.relative);
    EXPECT_NEAR(stated.value, std::sqrt(4.0 / (width * height) + 0.05 * 0.05 * 0.04 / 0.05), 0.01);
}

/// A lamp of one pixel whose edge makes a noise of a tenth: its own brightness is what its error is
/// relative to.
TEST(ImageError, LampsOfAPixelKeepTheirBrightness) {
    statistics::Neighborhood dark;
    for (int i = 0; i < 24; ++i) dark.add(0.2, 1e-4);
    EXPECT_GE(statistics::error_base(50, 25, dark).likely, 40.0);
    EXPECT_NEAR(statistics::error_base(50, 25, dark).beside, 0.2, 1e-12);
    EXPECT_NEAR(statistics::error_base(20, 400, dark).likely, 0.2, 1e-3);
    EXPECT_NEAR(statistics::error_base(20, 400, dark).beside, 0.2, 1e-12);
    EXPECT_EQ(statistics::error_base(0.2, 1e-4, dark).beside, 0.2);
    EXPECT_EQ(statistics::error_base(3, 0, dark).likely, 3.0);
    EXPECT_EQ(statistics::error_base(3, 1, {}).likely, 3.0);
}

TEST(FewPixels, IsARuleOfHowSquaresAreSpread) {
    // n equal squares: (Σ s)² / Σ s² = n
    EXPECT_TRUE(statistics::few_pixels(99, 99, 1e5));
    EXPECT_FALSE(statistics::few_pixels(101, 101, 1e5));
    // Even noise of a small image: a third of its pixels
    for (const double pixels : {9.0, 64.0, 300.0, 1200.0})
        EXPECT_FALSE(statistics::few_pixels(pixels, 3 * pixels, pixels)) << pixels;
    EXPECT_TRUE(statistics::few_pixels(2, 2, 64));
    EXPECT_FALSE(statistics::few_pixels(0, 0, 64));
}

}  // namespace
}  // namespace velatura::image
