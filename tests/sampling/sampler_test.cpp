// SPDX-License-Identifier: Apache-2.0
#include "sampling/sampler.h"

#include "hard_case.h"
#include "sampling/owen.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <random>
#include <set>
#include <vector>

namespace velatura::sampling {
namespace {

TEST(Owen, ReverseBitsAgreesWithBitLoop) {
    uint32_t v = 1;
    for (int n = 0; n < 10000; ++n) {
        v = v * 1664525u + 1013904223u;
        uint32_t slow = 0;
        for (int i = 0; i < 32; ++i) slow |= ((v >> i) & 1u) << (31 - i);
        ASSERT_EQ(reverse_bits(v), slow);
    }
}

// Second dimension of Sobol' from its direction numbers: m_1 = 1, v_{i+1} = v_i ^ (v_i >> 1)
TEST(Owen, SecondDimensionAgreesWithDirectionNumbers) {
    uint32_t direction[32];
    direction[0] = 0x80000000u;
    for (int i = 1; i < 32; ++i) direction[i] = direction[i - 1] ^ (direction[i - 1] >> 1);
    uint32_t index = 12345;
    for (int n = 0; n < 100000; ++n) {
        index = index * 1664525u + 1013904223u;
        uint32_t slow = 0;
        for (int i = 0; i < 32; ++i) slow ^= ((index >> i) & 1u) ? direction[i] : 0u;
        ASSERT_EQ(reverse_bits(sobol_1_reversed(index)), slow);
    }
}

TEST(Owen, ScrambleKeepsNestedStrata) {
    // Two numbers that agree in their upper k bits still do, and then differ in the next, after
    // scrambling
    uint32_t v = 99;
    for (int n = 0; n < 20000; ++n) {
        v = v * 1664525u + 1013904223u;
        const int k = n % 32;
        const uint32_t other = v ^ (0x80000000u >> k) ^ ((v * 2654435761u) & ((0x7fffffffu >> k)));
        const uint32_t seed = v * 747796405u + 77u;
        const uint32_t a = reverse_bits(owen_hash_reversed(reverse_bits(v), seed));
        const uint32_t b = reverse_bits(owen_hash_reversed(reverse_bits(other), seed));
        ASSERT_EQ(std::countl_zero(a ^ b), k);
    }
}

TEST(H43UnitFloat, StaysBelowOneForEveryBitPattern) {
    EXPECT_EQ(unit_float(0u), 0.0f);
    const uint64_t step = hardcase::sized(251, 1, 1);
    float largest = unit_float(0xffffffffu);
    for (uint64_t v = 0; v <= 0xffffffffull; v += step)
        largest = std::max(largest, unit_float(uint32_t(v)));
    // Half a step below it would be 1 - 2^-23
    hardcase::expect_within({fmt::format("largest of 2^32 / {} patterns from 1 - 2^-24", step),
                             std::abs(double(largest) - 0x1.fffffep-1), 0, 0, "bit patterns"});
}

/// Every elementary interval of area 1/n holds one of the n = 2^k points.
void expect_net(const std::vector<Vec2>& points) {
    const size_t n = points.size();
    const int k = std::bit_width(n) - 1;
    for (int i = 0; i <= k; ++i) {
        const size_t columns = size_t(1) << i, rows = n >> i;
        std::vector<int> count(n, 0);
        for (const Vec2& p : points) {
            ++count[size_t(p.x * float(columns)) * rows + size_t(p.y * float(rows))];
        }
        for (const int c : count) ASSERT_EQ(c, 1) << n << " points, " << columns << " columns";
    }
}

TEST(PixelSampler, EveryAlignedBlockIsANet) {
    for (const int k : {0, 1, 2, 4, 6, 10}) {
        for (const uint64_t block : {0u, 1u, 5u}) {
            std::vector<Vec2> points;
            for (uint64_t i = 0; i < (uint64_t(1) << k); ++i)
                points.push_back(
                    PixelSampler(7, 3, 4, (block << k) + i).get_2d(2, Purpose::LightSurface));
            expect_net(points);
        }
    }
}

TEST(PixelSampler, EveryAlignedBlockOfAHalfIsANet) {
    for (const uint64_t half : {0u, 1u}) {
        for (const int k : {0, 1, 2, 4, 6, 10}) {
            for (const uint64_t block : {0u, 1u, 5u}) {
                std::vector<Vec2> points;
                for (uint64_t i = 0; i < (uint64_t(1) << k); ++i) {
                    const uint64_t index = 2 * ((block << k) + i) + half;
                    points.push_back(PixelSampler(7, 3, 4, index, SamplerKind::SobolHalves)
                                         .get_2d(2, Purpose::LightSurface));
                }
                expect_net(points);
            }
        }
    }
}

TEST(PixelSampler, BranchesOfAnAlignedBlockOfSamplesAreANet) {
    for (const SamplerKind kind : {SamplerKind::Sobol, SamplerKind::SobolHalves}) {
        const uint64_t stride = has_halves(kind) ? 2 : 1;
        for (const uint32_t count : {2u, 4u}) {
            for (const uint64_t block : {0u, 1u, 5u}) {
                std::vector<Vec2> points;
                for (uint64_t i = 0; i < 16; ++i) {
                    const PixelSampler sample(7, 3, 4, stride * (16 * block + i), kind);
                    for (uint32_t b = 0; b < count; ++b)
                        points.push_back(sample.branch(b, count).get_2d(2, Purpose::BsdfDirection));
                }
                expect_net(points);
            }
        }
    }
}

// Of any sampler, and where their points lie beyond the sequence's 2^32
TEST(PixelSampler, BranchesAreDistinct) {
    for (const SamplerKind kind :
         {SamplerKind::Sobol, SamplerKind::Independent, SamplerKind::BlueNoise,
          SamplerKind::SobolHalves, SamplerKind::Stratified}) {
        std::set<std::pair<float, float>> seen;
        for (const uint64_t first : {uint64_t(0), (uint64_t(1) << 30) - 50}) {
            for (uint64_t s = first; s < first + 100; ++s) {
                for (uint32_t b = 0; b < 4; ++b) {
                    const Vec2 u = PixelSampler(7, 3, 4, s, kind)
                                       .branch(b, 4)
                                       .get_2d(2, Purpose::BsdfDirection);
                    seen.insert({u.x, u.y});
                }
            }
        }
        EXPECT_EQ(seen.size(), 800u);
    }
}

// One of 4^k samples in each square, anywhere in it and in no order that a net would have
TEST(PixelSampler, StratifiedSamplesAreJitteredSquares) {
    for (const SamplerKind kind : {SamplerKind::Stratified, SamplerKind::StratifiedHalves}) {
        const uint64_t stride = has_halves(kind) ? 2 : 1;
        size_t empty_columns = 0;
        double sum = 0, squares = 0;
        constexpr uint64_t blocks = 64, side = 8;
        for (uint64_t block = 0; block < blocks; ++block) {
            std::vector<int> squares_hit(side * side), columns_hit(side * side);
            for (uint64_t i = 0; i < side * side; ++i) {
                const Vec2 u = PixelSampler(7, 3, 4, stride * (side * side * block + i), kind)
                                   .get_2d(2, Purpose::LightSurface);
                ++squares_hit[size_t(u.y * float(side)) * side + size_t(u.x * float(side))];
                ++columns_hit[size_t(u.x * float(side * side))];
                const double within = std::fmod(double(u.x) * side, 1.0);
                sum += within;
                squares += within * within;
            }
            for (const int n : squares_hit) ASSERT_EQ(n, 1) << "block " << block;
            for (const int n : columns_hit) empty_columns += n == 0;
        }
        // Uniform within the square: mean 1/2, mean square 1/3, within 4 standard errors
        constexpr double n = double(blocks * side * side);
        EXPECT_NEAR(sum / n, 0.5, 4 * std::sqrt(1.0 / 12 / n));
        EXPECT_NEAR(squares / n, 1.0 / 3, 4 * std::sqrt(4.0 / 45 / n));
        // A column of 1/64 is missed by its 8 squares with probability (1 − 1/8)^8; a net misses
        // none
        EXPECT_NEAR(double(empty_columns) / n, std::pow(7.0 / 8, 8), 0.05);
    }
}

TEST(PixelSampler, OneDimensionIsStratified) {
    constexpr size_t n = 1024;
    std::vector<int> count(n, 0);
    for (uint64_t i = 0; i < n; ++i) {
        ++count[size_t(PixelSampler(1, 2, 3, i).get_1d(0, Purpose::LightSelect) * float(n))];
    }
    for (const int c : count) ASSERT_EQ(c, 1);
}

// The last of 2^20 samples of the last pixel of an 8k image, and beyond 32 bits of index
TEST(H42LargeIndices, AreDistinctAndInRange) {
    std::set<std::pair<float, float>> seen;
    std::vector<Vec2> points;
    for (uint64_t i = 0; i < 256; ++i) {
        const PixelSampler s(0, 8191, 8191, (uint64_t(1) << 20) - 256 + i);
        const Vec2 u = s.get_2d(9, Purpose::BsdfDirection);
        seen.insert({u.x, u.y});
        points.push_back(u);
    }
    hardcase::expect_within({"points drawn twice, of the last 256 of 2^20 of pixel 8191, 8191",
                             256.0 - double(seen.size()), 0, 0,
                             "every elementary interval of a net holds one point"});
    expect_net(points);
    EXPECT_NE(PixelSampler(0, 0, 0, 0).get_1d(0, Purpose::Lens),
              PixelSampler(0, 0, 0, uint64_t(1) << 33).get_1d(0, Purpose::Lens));
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - 0.5) * (b[i] - 0.5);
    return sum / double(a.size()) * 12;  // variance of a uniform number is 1/12
}

/// 64 streams: 4 bounces, 8 purposes, 2 dimensions. Number i of each is made by `sampler(i)`.
template <class MakeSampler>
double worst_correlation(size_t n, MakeSampler sampler) {
    std::vector<std::vector<double>> streams;
    for (int bounce = 0; bounce < 4; ++bounce) {
        for (const Purpose purpose :
             {Purpose::PixelFilter, Purpose::Lens, Purpose::LightSelect, Purpose::LightSurface,
              Purpose::BsdfLobe, Purpose::BsdfDirection, Purpose::Roulette, Purpose::Opacity}) {
            std::vector<double> x(n), y(n);
            for (size_t i = 0; i < n; ++i) {
                const Vec2 u = sampler(i).get_2d(bounce, purpose);
                x[i] = double(u.x);
                y[i] = double(u.y);
            }
            streams.push_back(std::move(x));
            streams.push_back(std::move(y));
        }
    }
    double worst = 0;
    for (size_t a = 0; a < streams.size(); ++a) {
        for (size_t b = a + 1; b < streams.size(); ++b) {
            worst = hardcase::larger(worst, std::abs(correlation(streams[a], streams[b])));
        }
    }
    return worst;
}

/// Bound that the largest of 2016 independent normal deviates keeps with probability 0.99 (Šidák).
constexpr double largest_of_all_pairs = 4.56;

// One number per pixel, so that every number is an independent draw of the hash
TEST(H44Streams, AreUncorrelatedOverPixels) {
    const size_t n = hardcase::sized(4096, 1 << 16, 1 << 18);
    const double worst = worst_correlation(
        n, [](size_t i) { return PixelSampler(11, int(i % 64), int(i / 64), 0); });
    hardcase::expect_within({fmt::format("|correlation| of 2016 pairs of streams, {} pixels", n),
                             worst, largest_of_all_pairs / std::sqrt(double(n)), 0,
                             "independent draws",
                             fmt::format("|correlation| {:.2g}",
                                         (largest_of_all_pairs + 1.28) / std::sqrt(double(n)))});
}

// Over the samples of one pixel neighbors in a net are antithetic in every stream, so that n
// numbers hold n / 2 independent pairs: the bound is that of n / 2 draws
TEST(H44Streams, AreUncorrelatedOverSamples) {
    const size_t n = hardcase::sized(4096, 1 << 16, 1 << 18);
    const double worst = worst_correlation(n, [](size_t i) { return PixelSampler(11, 5, 6, i); });
    hardcase::expect_within({fmt::format("|correlation| of 2016 pairs of streams, {} samples", n),
                             worst, largest_of_all_pairs / std::sqrt(double(n) / 2), 0,
                             "independent draws of antithetic pairs",
                             fmt::format("|correlation| {:.2g}", (largest_of_all_pairs + 1.28) /
                                                                     std::sqrt(double(n) / 2))});
}

// Two of 2^16 random points of 48 bits are alike with a probability of 1e-5
TEST(H44Streams, PixelsShareNoPoint) {
    for (const SamplerKind kind :
         {SamplerKind::Sobol, SamplerKind::SobolHalves, SamplerKind::BlueNoise,
          SamplerKind::BlueNoiseHalves, SamplerKind::Independent, SamplerKind::Stratified}) {
        std::set<std::pair<float, float>> seen;
        for (int i = 0; i < 1 << 16; ++i) {
            const Vec2 u = PixelSampler(11, i % 128, i / 128 % 128, uint64_t(i >> 14), kind)
                               .get_2d(1, Purpose::LightSurface);
            seen.insert({u.x, u.y});
        }
        hardcase::expect_within(
            {fmt::format("points that two of 128 by 128 pixels share, 4 samples, sampler {}",
                         int(kind)),
             65536.0 - double(seen.size()), 0, 0, "points of independent draws are distinct"});
    }
}

// The same number across neighboring pixels, seeds, repeats and the two halves: sample by sample
// independent
TEST(PixelSampler, PixelsSeedsRepeatsAndHalvesAreIndependent) {
    constexpr size_t n = 4096;
    std::vector<std::vector<double>> streams(5, std::vector<double>(n));
    for (size_t i = 0; i < n; ++i) {
        for (size_t half : {size_t(0), size_t(1)}) {
            const PixelSampler sampler(1, 10, 20, 2 * i + half, SamplerKind::SobolHalves);
            streams[half][i] = double(sampler.get_1d(1, Purpose::BsdfLobe));
        }
        streams[2][i] = double(PixelSampler(1, 11, 20, 2 * i).get_1d(1, Purpose::BsdfLobe));
        streams[3][i] = double(PixelSampler(2, 10, 20, 2 * i).get_1d(1, Purpose::BsdfLobe));
        streams[4][i] = double(PixelSampler(1, 10, 20, 2 * i).get_1d(1, Purpose::BsdfLobe, 1));
    }
    for (size_t a = 0; a < streams.size(); ++a) {
        for (size_t b = a + 1; b < streams.size(); ++b) {
            EXPECT_LT(std::abs(correlation(streams[a], streams[b])), 4 / std::sqrt(double(n)))
                << a << " " << b;
        }
    }
}

// Means of the halves must be independent errors of one truth: their covariance over pixels is 0,
// their squared difference predicts the variance of the mean of both.
TEST(PixelSampler, HalvesPredictTheError) {
    constexpr int pixels = 4000;
    constexpr int samples = 8;  // per half
    double aa = 0, ab = 0, bb = 0;
    for (int p = 0; p < pixels; ++p) {
        double mean[2] = {0, 0};
        for (uint64_t i = 0; i < 2 * samples; ++i) {
            const Vec2 u = PixelSampler(3, p % 64, p / 64, i, SamplerKind::SobolHalves)
                               .get_2d(1, Purpose::LightSurface);
            // A disk of area 1/2: its truth is 1/2
            const float x = u.x - 0.5f, y = u.y - 0.5f;
            mean[i & 1] += (x * x + y * y < 0.5f * inv_pi ? 1.0 : 0.0) / samples;
        }
        aa += (mean[0] - 0.5) * (mean[0] - 0.5);
        bb += (mean[1] - 0.5) * (mean[1] - 0.5);
        ab += (mean[0] - 0.5) * (mean[1] - 0.5);
    }
    EXPECT_LT(std::abs(ab) / std::sqrt(aa * bb), 4 / std::sqrt(double(pixels)));
    EXPECT_NEAR(aa / bb, 1.0, 4 * std::sqrt(4.0 / pixels));
    // And they are better than independent numbers, whose variance is 1/4 per sample
    EXPECT_LT(aa / pixels, 0.6 * 0.25 / samples);
}

// In one sequence both halves together are better than two independent ones, and their difference
// says so too little: it errs on the safe side.
TEST(PixelSampler, HalvesOfOneSequenceOverstateTheError) {
    constexpr int pixels = 4000;
    constexpr int samples = 32;
    constexpr float radius2 = 0.09f;
    // Disks that lie anywhere in the square
    const auto squares = [&](SamplerKind kind, double& predicted) {
        std::mt19937 random(8);
        std::uniform_real_distribution<float> center(0.3f, 0.7f);
        double error = 0;
        predicted = 0;
        for (int p = 0; p < pixels; ++p) {
            const float cx = center(random), cy = center(random);
            double mean[2] = {0, 0};
            for (uint64_t i = 0; i < samples; ++i) {
                const Vec2 u =
                    PixelSampler(3, p % 64, p / 64, i, kind).get_2d(1, Purpose::LightSurface);
                const float d2 = sqr(u.x - cx) + sqr(u.y - cy);
                mean[i & 1] += (d2 < radius2 ? 2.0 : 0.0) / samples;
            }
            error += sqr((mean[0] + mean[1]) / 2 - double(radius2) * pi_d) / pixels;
            predicted += sqr(mean[0] - mean[1]) / 4 / pixels;
        }
        return error;
    };
    double predicted_two = 0, predicted_one = 0;
    const double two = squares(SamplerKind::SobolHalves, predicted_two);
    const double one = squares(SamplerKind::Sobol, predicted_one);
    std::printf("one sequence has %.2f of the variance of two, and predicts %.2f of its own\n",
                one / two, predicted_one / one);
    EXPECT_NEAR(predicted_two / two, 1.0, 0.1);
    EXPECT_LT(one, 0.8 * two);
    EXPECT_GT(predicted_one, one);
}

// The spread of the means of 64 seeds, for one independent draw per seed and pixel
TEST(H44Streams, MeansOverSeedsSpreadAsPredicted) {
    constexpr int seeds = 64, pixels = 1024;
    double sum2 = 0;
    for (int s = 0; s < seeds; ++s) {
        double mean = 0;
        for (int p = 0; p < pixels; ++p) {
            mean +=
                double(PixelSampler(uint64_t(s), p, 0, 0).get_1d(0, Purpose::ShutterTime)) / pixels;
        }
        sum2 += (mean - 0.5) * (mean - 0.5);
    }
    const double ratio = sum2 / seeds * 12 * pixels;  // expectation 1, variance 2 / seeds
    hardcase::expect_within(
        {"variance of the means of 64 seeds over its prediction, less 1, within 4 standard errors",
         std::abs(ratio - 1), 4 * std::sqrt(2.0 / seeds), 0, "closed form",
         fmt::format("{:.2g}", 5.28 * std::sqrt(2.0 / seeds))});
}

TEST(H44Streams, OneChangedKeyBitChangesHalfTheBits) {
    const auto draw = [](uint64_t seed, int x, int y, int bounce, uint32_t repeat) {
        const Vec2 u = PixelSampler(seed, x, y, 0).get_2d(bounce, Purpose::Lens, repeat);
        return (uint64_t(double(u.x) * 0x1p24) << 24) | uint64_t(double(u.y) * 0x1p24);
    };
    double flipped = 0;
    int trials = 0;
    for (int i = 0; i < 4096; ++i) {
        const uint64_t seed = uint64_t(i) * 77;
        const uint64_t base = draw(seed, i, 2 * i, i % 9, 0);
        flipped += std::popcount(base ^ draw(seed ^ (uint64_t(1) << (i % 64)), i, 2 * i, i % 9, 0));
        flipped += std::popcount(base ^ draw(seed, i ^ (1 << (i % 14)), 2 * i, i % 9, 0));
        flipped += std::popcount(base ^ draw(seed, i, (2 * i) ^ (1 << (i % 14)), i % 9, 0));
        flipped += std::popcount(base ^ draw(seed, i, 2 * i, i % 9, 1u << (i % 16)));
        trials += 4;
    }
    // Of independent bits
    const double error = 0.5 / std::sqrt(48.0 * trials);
    hardcase::expect_within({"share of bits that one changed bit of the key changes, less 1/2",
                             std::abs(flipped / trials / 48 - 0.5), 0.01, 5.28 * error,
                             "independent bits"});
}

}  // namespace
}  // namespace velatura::sampling
