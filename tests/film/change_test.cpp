// SPDX-License-Identifier: Apache-2.0
// How pixels changed when their samples doubled, and what that says of their error.
#include "accumulate/pixel_means.h"
#include "base/hash.h"
#include "film/film.h"
#include "film/film_scene.h"
#include "layers/layer_header.h"
#include "layers/sums_part.h"
#include "statistics/block_errors.h"
#include "statistics/image_change.h"
#include "statistics/layer_changes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <string>

namespace velatura::film {
namespace {

const Window window{2, 1, 9, 6};

/// The mean of the first samples of a pixel as a film of these alone has it.
accumulate::EarlierMean mean_of_first(int x, int y, uint64_t samples) {
    Film film(window, test_layer_set());
    render(film, 0, samples);
    const auto total = [&](uint32_t accumulator) { return film.sums().total(x, y, accumulator); };
    return accumulate::mean_of(total(accumulate::AccumulatorTable::beauty),
                               total(accumulate::AccumulatorTable::coverage));
}

void expect_earlier_means(const Film& film, uint64_t samples, const char* how) {
    for (const auto& [x, y] : {std::pair(2, 1), std::pair(5, 3), std::pair(8, 5)}) {
        const accumulate::EarlierMean* mean = film.sums().earlier_mean(x, y);
        ASSERT_NE(mean, nullptr) << how << ", " << samples;
        EXPECT_EQ(*mean, mean_of_first(x, y, std::bit_floor(samples - 1)))
            << how << ", " << samples << " samples of (" << x << ", " << y << ")";
    }
}

/// A pixel's value with mean 1 and variance 1, of another stream for every trial.
Rgb coin(uint64_t trial, int x, int y, uint64_t sample) {
    const uint64_t key = hash_combine(hash_combine(trial, uint64_t(y * 64 + x)), sample);
    return Rgb(key & 1 ? 2.0f : 0.0f, key & 2 ? 2.0f : 0.0f, key & 4 ? 2.0f : 0.0f);
}

Film film_of_coins(uint64_t trial, uint64_t samples) {
    const LayerSet set = test_layer_set();
    Film film({0, 0, 64, 64}, set);
    SampleRadiance s(set);
    PixelAccumulator accumulator(set);
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            film.begin_pixel(accumulator, x, y, 0);
            for (uint64_t i = 0; i < samples; ++i) {
                s.clear();
                s.add(1, 0, coin(trial, x, y, i));
                accumulator.add(s);
            }
            film.end_pixel(accumulator);
        }
    }
    return film;
}

TEST(ImageChange, EarlierMeansDoNotDependOnHowSamplesCame) {
    for (const uint64_t samples : {2u, 3u, 7u, 8u, 9u, 24u, 31u, 32u, 33u}) {
        Film once(window, test_layer_set());
        render(once, 0, samples);
        expect_earlier_means(once, samples, "at once");
        for (uint64_t cut = 1; cut < samples; ++cut) {
            Film parts(window, test_layer_set());
            render(parts, 0, cut);
            render(parts, cut, samples);
            expect_earlier_means(parts, samples, "in two");
        }
        Film folded(window, test_layer_set(), {.final_sample_end = samples});
        for (uint64_t i = 0; i < samples; ++i) render(folded, i, i + 1);
        expect_earlier_means(folded, samples, "one by one");
    }
}

TEST(ImageChange, PartsThatAreJoinedKnowIt) {
    for (const uint64_t cut : {1u, 5u, 8u, 16u, 20u}) {
        Film first(window, test_layer_set()), second(window, test_layer_set());
        render(first, 0, cut);
        render(second, cut, 24);
        EXPECT_EQ(second.sums().earlier_mean(2, 1), nullptr);
        EXPECT_FALSE(statistics::image_change(second.sums()).has_value());
        accumulate::SampleSums joined(window, test_layer_set());
        joined.append(first.sums());
        joined.append(second.sums());
        expect_earlier_means(Film(std::move(joined), {}), 24, "joined");
    }
}

TEST(ImageChange, StoredSumsKnowIt) {
    for (const uint64_t samples : {16u, 24u}) {
        Film film(window, test_layer_set());
        render(film, 0, samples);
        image::Image image;
        image.data = image.display = window;
        image.parts = *layers::sums_parts(film.sums());
        image.attributes[layers::sums_attribute] = layers::sums_json(film.layer_set(), image);
        auto sums = layers::read_sums(image);
        ASSERT_TRUE(sums.has_value()) << sums.error().message;
        Film back(std::move(*sums), {});
        expect_earlier_means(back, samples, "read back");
        render(back, samples, 40);
        expect_earlier_means(back, 40, "gone on with");
    }
}

TEST(ImageChange, StatesTheErrorOfIndependentSamples) {
    for (const uint64_t samples : {256u, 384u}) {
        double square = 0;
        for (const uint64_t trial : {3, 4, 5, 6}) {
            const std::optional<statistics::RelativeError> change =
                statistics::image_change(film_of_coins(trial, samples).sums());
            ASSERT_TRUE(change.has_value());
            square += change->value * change->value / 4;
            EXPECT_LE(change->low, change->value);
            EXPECT_GE(change->high, change->value);
            // Of 12288 squares of one degree of freedom: √(2 / 12288) of their sum, half of that of
            // its root
            EXPECT_NEAR(std::log(change->high / change->value), 1.96 * 0.0064, 0.006);
        }
        const double stated = std::sqrt(square);
        const double expected = std::sqrt(1.0 / double(samples) / 1.01);
        // 49152 squares of one degree of freedom
        std::printf("%u samples: %.5f of %.5f, detectable 1 %%\n", unsigned(samples), stated,
                    expected);
        EXPECT_NEAR(stated, expected, 0.01 * expected);
    }
}

TEST(ImageChange, NetFactorsAreThoseOfPowers) {
    for (const double slope : {0.45, 0.5, 0.6, 0.75}) {
        const double before = std::pow(32.0, -slope), after = std::pow(64.0, -slope);
        EXPECT_NEAR(std::sqrt(before * before - after * after) * statistics::net_factor(slope),
                    after, 1e-12);
    }
    EXPECT_EQ(statistics::net_factor(0.5), 1.0);
}

TEST(LayerChanges, StateTheNoiseOfEachLayer) {
    const LayerSet set = test_layer_set();
    Film film({0, 0, 256, 192}, set);
    statistics::LayerChanges layers(film.sums());
    SampleRadiance s(set);
    PixelAccumulator accumulator(set);
    const auto render_coins = [&](uint64_t first, uint64_t end) {
        for (int y = 0; y < 192; ++y) {
            for (int x = 0; x < 256; ++x) {
                film.begin_pixel(accumulator, x, y, first);
                for (uint64_t i = first; i < end; ++i) {
                    s.clear();
                    // Standard deviations 1 of one light at the first bounce, 0.25 of another at
                    // the second, none at bounce 0
                    s.add(0, 1, Rgb(2.0f));
                    s.add(1, 0, coin(7, x, y, i));
                    s.add(2, 1, coin(8, x, y, i) * 0.25f);
                    accumulator.add(s);
                }
                film.end_pixel(accumulator);
            }
        }
    };
    render_coins(0, 32);
    layers.keep(film.sums());
    layers.observe(film.sums());
    EXPECT_TRUE(layers.noise(0.5).empty()) << "nothing has doubled yet";
    render_coins(32, 64);
    layers.observe(film.sums());
    const double mean = 3.25, unit = 1 / std::sqrt(64 * (mean * mean + 0.01));
    const std::map<std::string, double> expected = {
        {"b0", 0.0}, {"b1", unit}, {"b2", 0.25 * unit}, {"C_key", unit}, {"C_fill", 0.25 * unit}};
    size_t found = 0;
    for (const statistics::LayerNoise& layer : layers.noise(0.5)) {
        const auto at = expected.find(layer.layer);
        if (at == expected.end()) {
            EXPECT_EQ(layer.error, 0.0) << layer.layer;
            continue;
        }
        ++found;
        std::printf("%s: %.5f of %.5f\n", layer.layer.c_str(), layer.error, at->second);
        // 9216 squares: 0.74 % of standard error; what they are relative to is cut by noise of 0.13
        // / 3.25: 1 % at most
        EXPECT_NEAR(layer.error, at->second, 0.035 * at->second) << layer.layer;
    }
    EXPECT_EQ(found, expected.size());
}

TEST(BlockErrors, IntervalsHoldTheTruth) {
    constexpr int trials = 20;
    int inside = 0, count = 0;
    for (uint64_t trial = 0; trial < trials; ++trial) {
        const auto blocks = statistics::block_errors(film_of_coins(trial, 64).sums(), 0.5);
        ASSERT_TRUE(blocks.has_value());
        ASSERT_EQ(blocks->size(), 64u);
        for (const statistics::BlockError& b : *blocks) {
            EXPECT_FALSE(b.is_uncertain());
            for (size_t c = 0; c < 3; ++c) {
                inside += std::abs(b.mean[c] - 1) <= b.quantile(c) * b.error[c];
                ++count;
            }
        }
    }
    const double share = double(inside) / count, error = std::sqrt(0.05 * 0.95 / count);
    std::printf("%.2f %% of %d intervals hold the truth (+- %.2f)\n", 100 * share, count,
                100 * error);
    EXPECT_NEAR(share, 0.95, 4 * error);
}

TEST(BlockErrors, SayWhereTheyHangOnOnePixel) {
    const LayerSet set = test_layer_set();
    Film film({0, 0, 16, 8}, set);
    SampleRadiance s(set);
    PixelAccumulator accumulator(set);
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 16; ++x) {
            film.begin_pixel(accumulator, x, y, 0);
            for (uint64_t i = 0; i < 4; ++i) {
                s.clear();
                s.add(1, 0, x == 3 && y == 3 && i == 3 ? Rgb(900.0f) : coin(1, x, y, i));
                accumulator.add(s);
            }
            film.end_pixel(accumulator);
        }
    }
    const auto blocks = statistics::block_errors(film.sums(), 0.5);
    ASSERT_EQ(blocks->size(), 2u);
    EXPECT_TRUE((*blocks)[0].is_uncertain());
    EXPECT_FALSE((*blocks)[1].is_uncertain());
    EXPECT_GT((*blocks)[0].quantile(0), 3);
}

}  // namespace
}  // namespace velatura::film
