// SPDX-License-Identifier: Apache-2.0
// Points of pixels that make up for one another's errors: nets over pixels and samples, and what is
// left of the error of images once they are filtered.
#include "sampling/sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <vector>

namespace velatura::sampling {
namespace {

constexpr int size = 32;  ///< edge of the images, pixels

using Image = std::vector<double>;  // [size][size]

/// One point in each of the n square or elementary cells.
void expect_filled(const std::vector<Vec2>& points, size_t columns, const char* what) {
    const size_t rows = points.size() / columns;
    std::vector<int> count(points.size(), 0);
    for (const Vec2& p : points)
        ++count[size_t(p.x * float(columns)) * rows + size_t(p.y * float(rows))];
    for (const int c : count) ASSERT_EQ(c, 1) << what << ", " << points.size() << " points";
}

TEST(BlueNoise, EveryAlignedBlockOfAPixelIsANet) {
    for (const SamplerKind kind : {SamplerKind::BlueNoise, SamplerKind::BlueNoiseHalves}) {
        const uint64_t step = has_halves(kind) ? 2 : 1;
        for (const int pixel : {0, 3, 17, 255}) {
            for (const int k : {0, 1, 2, 5, 10}) {
                for (const uint64_t block : {0u, 1u, 5u}) {
                    std::vector<Vec2> points;
                    for (uint64_t i = 0; i < (uint64_t(1) << k); ++i) {
                        const uint64_t index = step * ((block << k) + i);
                        points.push_back(PixelSampler(7, pixel, 4, index, kind)
                                             .get_2d(2, Purpose::LightSurface));
                    }
                    for (int columns = 0; columns <= k; ++columns)
                        expect_filled(points, size_t(1) << columns, "samples of a pixel");
                }
            }
        }
    }
}

TEST(BlueNoise, FirstSamplesOfASquareOfPixelsFillSquareCells) {
    for (const int edge : {2, 4, 8, 16}) {
        for (const int k : {0, 2, 4, 6}) {
            for (const int bounce : {0, 3}) {
                std::vector<Vec2> points;
                for (int y = 0; y < edge; ++y)
                    for (int x = 0; x < edge; ++x)
                        for (uint64_t i = 0; i < (uint64_t(1) << k); ++i)
                            points.push_back(PixelSampler(5, 32 + edge + x, 3 * edge + y, i,
                                                          SamplerKind::BlueNoise)
                                                 .get_2d(bounce, Purpose::BsdfDirection));
                expect_filled(points, size_t(edge) << (k / 2), "pixels and samples");
            }
        }
    }
}

TEST(BlueNoise, APixelByItselfIsUniformAndPixelsDiffer) {
    // Over seeds every cell is as likely: chi² of 64 cells below its 99.99 % quantile
    constexpr int runs = 20000;
    std::vector<int> count(64, 0);
    for (int seed = 0; seed < runs; ++seed) {
        const Vec2 u = PixelSampler(uint64_t(seed), 5, 9, 2, SamplerKind::BlueNoise)
                           .get_2d(1, Purpose::LightSurface);
        ++count[size_t(u.x * 8) * 8 + size_t(u.y * 8)];
    }
    double chi2 = 0;
    for (const int c : count) chi2 += (c - runs / 64.0) * (c - runs / 64.0) / (runs / 64.0);
    std::printf("chi2 of 63 degrees of freedom: %.1f\n", chi2);
    EXPECT_LT(chi2, 113.0);
    const auto first = [](int x, SamplerKind kind) {
        return PixelSampler(1, x, 0, 0, kind).get_1d(0, Purpose::LightSelect);
    };
    EXPECT_NE(first(0, SamplerKind::BlueNoise), first(1, SamplerKind::BlueNoise));
    EXPECT_NE(first(0, SamplerKind::BlueNoise), first(16, SamplerKind::BlueNoise));
}

/// Gaussian of 1.5 pixels, the image going on at the opposite edge.
Image blurred(const Image& in) {
    constexpr int reach = 6;
    double kernel[2 * reach + 1], sum = 0;
    for (int i = -reach; i <= reach; ++i) sum += kernel[i + reach] = std::exp(-i * i / 4.5);
    const auto pass = [&](const Image& from, int step_x, int step_y) {
        Image to(from.size(), 0.0);
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x)
                for (int i = -reach; i <= reach; ++i) {
                    const int xi = (x + i * step_x + size) % size;
                    const int yi = (y + i * step_y + size) % size;
                    to[size_t(y * size + x)] +=
                        kernel[i + reach] / sum * from[size_t(yi * size + xi)];
                }
        return to;
    };
    return pass(pass(in, 1, 0), 0, 1);
}

/// Share of the power of the error in frequencies below 1/8 per pixel: 49 of 1024 waves, so that
/// white noise has 0.048.
double low_power_share(const Image& error) {
    double low = 0, all = 0;
    for (const double e : error) all += e * e;
    for (int fy = -size / 8; fy <= size / 8; ++fy) {
        for (int fx = -size / 8; fx <= size / 8; ++fx) {
            if (fx * fx + fy * fy > size * size / 64) continue;
            double re = 0, im = 0;
            for (int y = 0; y < size; ++y) {
                for (int x = 0; x < size; ++x) {
                    const double phase = 2 * std::numbers::pi * (fx * x + fy * y) / size;
                    re += error[size_t(y * size + x)] * std::cos(phase);
                    im += error[size_t(y * size + x)] * std::sin(phase);
                }
            }
            low += (re * re + im * im) / (size * size);
        }
    }
    return low / all;
}

struct Integrand {
    const char* name;
    double mean;
    std::function<double(const PixelSampler&)> value;
    double min_gain;  ///< of squared errors after the blur, at 1, 4 and 16 samples
};

const std::vector<Integrand>& integrands() {
    static const std::vector<Integrand> all = {
        {"disk, 2D", std::numbers::pi / 4,
         [](const PixelSampler& s) {
             const Vec2 u = s.get_2d(1, Purpose::LightSurface);
             return u.x * u.x + u.y * u.y < 1.0f ? 1.0 : 0.0;
         },
         1.5},
        {"smooth, 2D", (std::numbers::e - 1) * (std::exp(0.5) - 1) / 0.5,
         [](const PixelSampler& s) {
             const Vec2 u = s.get_2d(1, Purpose::LightSurface);
             return std::exp(double(u.x) + 0.5 * double(u.y));
         },
         1.2},
        {"edge, 1D", 0.3,
         [](const PixelSampler& s) { return s.get_1d(0, Purpose::BsdfLobe) < 0.3f ? 1.0 : 0.0; },
         1.3},
        // What only all dimensions together decide is spread like before
        {"product, 4D", 1.0,
         [](const PixelSampler& s) {
             const Vec2 u = s.get_2d(1, Purpose::LightSurface);
             const Vec2 v = s.get_2d(1, Purpose::BsdfDirection);
             return 16.0 * double(u.x * u.y * v.x * v.y);
         },
         0.85},
    };
    return all;
}

/// Images of the error: mean of n samples less the integral.
Image error_image(const Integrand& f, SamplerKind kind, uint64_t seed, uint64_t samples) {
    Image out;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            double sum = 0;
            for (uint64_t i = 0; i < samples; ++i)
                sum += f.value(PixelSampler(seed, x, y, i, kind));
            out.push_back(sum / double(samples) - f.mean);
        }
    }
    return out;
}

double mean_square(const Image& p) {
    double sum = 0;
    for (const double v : p) sum += v * v;
    return sum / double(p.size());
}

TEST(BlueNoise, ErrorsOfNeighborsMakeUpForEachOther) {
    constexpr int runs = 24;
    for (const Integrand& f : integrands()) {
        for (const uint64_t samples : {1u, 2u, 4u, 8u, 16u}) {
            // Per run: squared errors of the pixels, and after the blur
            std::vector<double> pixel[2];
            double filtered[2] = {0, 0}, low[2] = {0, 0}, bias = 0;
            for (int r = 0; r < runs; ++r) {
                for (const int blue : {0, 1}) {
                    const Image e =
                        error_image(f, blue ? SamplerKind::BlueNoise : SamplerKind::Sobol,
                                    uint64_t(r) + 100, samples);
                    pixel[blue].push_back(mean_square(e));
                    filtered[blue] += mean_square(blurred(e)) / runs;
                    low[blue] += low_power_share(e) / runs;
                    if (blue)
                        for (const double v : e) bias += v / double(runs * size * size);
                }
            }
            // Welch's test over runs
            double mean[2], error2 = 0;
            for (const int blue : {0, 1}) {
                double sum = 0, squares = 0;
                for (const double v : pixel[blue]) sum += v, squares += v * v;
                mean[blue] = sum / runs;
                error2 += std::max(0.0, squares / runs - mean[blue] * mean[blue]) / (runs - 1);
            }
            const double gain = filtered[0] / filtered[1];
            std::printf(
                "%-12s %2d samples: squared error in pixels x %.3f (seen from %.3f), after "
                "the blur / %.2f, share at low frequencies %.4f for %.4f\n",
                f.name, int(samples), mean[1] / mean[0], 5.28 * std::sqrt(error2) / mean[0], gain,
                low[1], low[0]);
            EXPECT_LE(std::abs(mean[1] - mean[0]), 4.5 * std::sqrt(error2)) << f.name;
            EXPECT_LE(std::abs(bias), 5.0 * std::sqrt(mean[0] / (runs * size * size))) << f.name;
            EXPECT_GE(gain, f.min_gain) << f.name << ", " << samples;
            if (f.min_gain > 1.0) {
                EXPECT_LT(low[1], 0.9 * low[0]) << f.name;
            }
        }
    }
}

}  // namespace
}  // namespace velatura::sampling
