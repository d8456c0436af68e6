// SPDX-License-Identifier: Apache-2.0
// Adaptive sampling: one image however it is made, samples where the noise is, and no bias.
#include "base/hash.h"
#include "hard_case.h"
#include "integrator/sample_placement.h"
#include "integrator/schedule.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>

namespace velatura::test {

namespace {

using integrator::pilot_samples;
using integrator::RenderOptions;
using integrator::SampleRates;

RenderOptions adaptive_options(uint64_t samples) {
    RenderOptions options;
    options.adaptive = true;
    options.tile_size = 16;
    options.end_sample = samples;
    options.seed = 5;
    return options;
}

// A number in [0, 1) of one sample.
double number(uint64_t seed, int x, int y, uint64_t sample) {
    uint64_t h = hash_combine(seed, uint64_t(x));
    h = hash_combine(hash_combine(h, uint64_t(y)), sample);
    return double(h >> 11) * 0x1p-53;
}

// Renders an image whose samples are the values of a function; all in light group 0, bounce 0.
template <class Value>
film::Film render_values(const film::Window& window,
                         const RenderOptions& options,
                         const Value& value) {
    film::LayerSet layers;
    layers.groups.push_back({"lamp", {}, false});
    film::Film film(window, layers);
    integrator::run_schedule(
        film, options,
        [&](int x, int y, uint64_t s, film::SampleRadiance& out, integrator::RayCounts& counts) {
            ++counts.camera;
            out.alpha = 1;
            out.add(0, 0, Rgb(float(value(x, y, s))));
        },
        {});
    return film;
}

double mean_of(const film::Film& film, int x, int y) {
    const accumulate::Triple sum = film.sums().total(x, y, accumulate::AccumulatorTable::beauty);
    const accumulate::PixelRecord& record = film.sums().record(x, y);
    return sum.x / double(record.end - record.first);
}

uint64_t samples_of(const film::Film& film, int x, int y) {
    const accumulate::PixelRecord& record = film.sums().record(x, y);
    return record.end - record.first;
}

}  // namespace

TEST(Adaptive, ModesThreadsTilesAndPartsGiveTheSameBits) {
    const scene::Scene scene = scene_from_usda(room_usda(), 40, 34);
    RenderOptions options = adaptive_options(40);
    options.mode = integrator::RenderMode::Tile;
    const film::Film whole = render_scene(scene, options, 1);
    const uint64_t expected = fingerprint(whole);
    const film::NoiseEstimate noise = whole.noise();
    EXPECT_GT(noise.samples_max, 2 * noise.samples_min);
    for (const integrator::RenderMode mode :
         {integrator::RenderMode::Tile, integrator::RenderMode::Progressive}) {
        for (const int threads : {1, 3}) {
            for (const int tile : {16, 64}) {
                options.mode = mode;
                options.tile_size = tile;
                EXPECT_EQ(fingerprint(render_scene(scene, options, threads)), expected)
                    << "mode " << int(mode) << ", threads " << threads << ", tile " << tile;
            }
        }
    }
    // Parts that end and begin before, inside and after the pilot, each on its own
    for (const std::vector<uint64_t>& splits : {std::vector<uint64_t>{8}, {16}, {20}, {5, 17, 33}})
        EXPECT_EQ(fingerprint(render_scene(scene, options, RenderSetup{.sample_splits = splits})),
                  expected);
}

TEST(Adaptive, RendersNoLongerThanThePilotAreUniform) {
    const scene::Scene scene = scene_from_usda(room_usda(), 20, 16);
    RenderOptions options = adaptive_options(pilot_samples);
    const uint64_t adaptive = fingerprint(render_scene(scene, options));
    options.adaptive = false;
    EXPECT_EQ(fingerprint(render_scene(scene, options)), adaptive);
}

TEST(Adaptive, SamplesGoWhereTheNoiseIs) {
    const film::Window window{3, 2, 67, 50};
    // Left: constant; middle: some noise; right: ten times as much
    const auto value = [](int x, int y, uint64_t s) {
        const double spread = x < 20 ? 0.0 : x < 40 ? 0.05 : 0.5;
        return 1.0 + spread * (2 * number(7, x, y, s) - 1);
    };
    const film::Film film = render_values(window, adaptive_options(64), value);
    EXPECT_EQ(samples_of(film, 10, 20), 16u);
    EXPECT_EQ(samples_of(film, 30, 20), 16u);
    EXPECT_EQ(samples_of(film, 60, 20), 128u);
    // As many as asked for, but for the rounding of the rates to powers of two
    EXPECT_NEAR(film.noise().samples_mean, 64, 8);
    // A doubled image has the same relative noise
    const film::Film twice =
        render_values(window, adaptive_options(64),
                      [&](int x, int y, uint64_t s) { return 64 * value(x, y, s); });
    EXPECT_EQ(samples_of(twice, 60, 20), 128u);
}

TEST(Adaptive, AnImageWithoutNoiseIsUniform) {
    const film::Film film = render_values({0, 0, 20, 20}, adaptive_options(64),
                                          [](int x, int, uint64_t) { return double(x); });
    EXPECT_EQ(film.noise().samples_min, 64u);
    EXPECT_EQ(film.noise().samples_max, 64u);
}

TEST(Adaptive, WhatAPixelHasSeenDoesNotDecideHowOftenItLooks) {
    // One pixel of much noise among pixels of little: only its neighbors react
    const auto value = [](bool is_noisy) {
        return [is_noisy](int x, int y, uint64_t s) {
            const bool is_it = is_noisy && x == 16 && y == 16;
            const double spread = is_it ? 0.9 : x < 22 ? 0.01 : 0.1;
            return 1 + spread * (2 * number(3, x, y, s / 4) - 1);
        };
    };
    const film::Window window{0, 0, 32, 32};
    const film::Film plain = render_values(window, adaptive_options(64), value(false));
    const film::Film noisy = render_values(window, adaptive_options(64), value(true));
    EXPECT_EQ(samples_of(noisy, 16, 16), samples_of(plain, 16, 16));
    EXPECT_GT(samples_of(noisy, 17, 16), samples_of(plain, 17, 16));
}

// A lamp that one sample in a hundred meets. 16 pilot samples miss it with probability 0.85; a
// pixel that stopped for it would be too dark, one that went on for it as well.
TEST(H46RareEvents, LeaveNoBias) {
    constexpr double p = 0.01;
    const film::Window window{0, 0, 64, 64};
    double sum = 0, square = 0;
    int count = 0;
    const uint64_t seeds = hardcase::sized(40, 4000, 40000);
    for (uint64_t seed = 0; seed < seeds; ++seed) {
        // On the left other noise hides it, on the right there is none
        const auto value = [seed](int x, int y, uint64_t s) {
            const double lamp = number(2 * seed, x, y, s) < p ? 1 / p : 0.0;
            return lamp + (x < 32 ? 2 * number(2 * seed + 1, x, y, s) : 1.0);
        };
        const film::Film film = render_values(window, adaptive_options(64), value);
        double mean = 0;
        for (int y = 0; y < 64; ++y) {
            for (int x = 0; x < 64; ++x) mean += mean_of(film, x, y) / (64 * 64);
        }
        sum += mean;
        square += mean * mean;
        ++count;
    }
    const double mean = sum / count,
                 error = std::sqrt((square / count - mean * mean) / (count - 1));
    EXPECT_NEAR(mean, 2, std::max(2.58 * error, 1e-12));
    hardcase::expect_within({"mean of adaptive renders of a lamp of probability 0.01, relative",
                             std::abs(mean / 2 - 1), 0.01, (2.58 + 1.28) * error / 2,
                             "closed form"});
}

// One sample of the pilot that is far too bright: how bright does not matter, and few samples
// follow it
TEST(Adaptive, OneFireflyDrawsFewSamples) {
    const film::Window window{0, 0, 64, 64};
    const auto counts = [&](double firefly) {
        integrator::PilotNoise noise(window);
        for (int y = 0; y < 64; ++y) {
            for (int x = 0; x < 64; ++x) {
                for (uint64_t s = 0; s < pilot_samples; ++s) {
                    const bool is_it = x == 30 && y == 30 && s == 5;
                    noise.add(
                        x, y,
                        Rgb(float(is_it ? 1 + firefly
                                        : 1 + (2 * number(9, x, y, s) - 1) * (x < 48 ? 0.1 : 0.5))),
                        3);
                }
            }
        }
        const SampleRates rates(noise);
        std::vector<uint64_t> out;
        for (int y = 0; y < 64; ++y) {
            for (int x = 0; x < 64; ++x) out.push_back(rates.count(x, y, 256));
        }
        return out;
    };
    const std::vector<uint64_t> without = counts(0), with = counts(1e3);
    EXPECT_EQ(counts(1e7), with);
    uint64_t max = 0, drawn = 0, total = 0;
    for (size_t i = 0; i < with.size(); ++i) {
        max = std::max(max, with[i] / without[i]);
        drawn += with[i] - std::min(with[i], without[i]);
        total += with[i];
    }
    fmt::print("up to {} times the samples nearby, {:.2f} % of all\n", max,
               100 * double(drawn) / double(total));
    EXPECT_LE(max, 4u);
    EXPECT_LT(double(drawn), 0.015 * double(total));
}

TEST(H45PowersOfTwo, SampleCountsGrowWithTheIndexAndStopAtThem) {
    const film::Window window{0, 0, 48, 48};
    integrator::PilotNoise noise(window);
    for (int y = 0; y < 48; ++y) {
        for (int x = 0; x < 48; ++x) {
            for (uint64_t s = 0; s < pilot_samples; ++s)
                noise.add(x, y, Rgb(float(number(9, x, y, s) * x * x)), 3);
        }
    }
    const SampleRates rates(noise);
    ASSERT_FALSE(rates.is_uniform());
    int others = 0;
    for (int x = 0; x < 48; x += 5) {
        uint64_t last = 0;
        for (uint64_t index = 0; index <= 256; ++index) {
            const uint64_t count = rates.count(x, 20, index);
            EXPECT_GE(count, last);
            EXPECT_GE(count, std::min(index, pilot_samples));
            EXPECT_LE(count, SampleRates::max(index));
            // Low-discrepancy sequences are best used up to powers of two
            if (index >= 64 && std::has_single_bit(index)) others += !std::has_single_bit(count);
            last = count;
        }
    }
    hardcase::expect_within(
        {"counts of adaptive stops that are no power of two", double(others), 0, 0, "every stop"});
}

}  // namespace velatura::test
