// SPDX-License-Identifier: Apache-2.0
// Where further samples go: in proportion, in powers of two, and whatever the pixel itself has
// seen.
#include "layers/top_up.h"

#include "base/atomic_file.h"
#include "base/hash.h"
#include "image/exr.h"
#include "made_exr.h"
#include "temporary.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>

namespace velatura::image {

namespace {

constexpr Window window{-5, 3, 91, 67};

// A number in [0, 1) of a pixel.
double number(uint64_t seed, size_t i) {
    return double(hash_combine(seed, i) >> 11) * 0x1p-53;
}

/// Priorities over four octaves, smooth enough for neighbors to be like each other.
std::vector<float> some_priority(uint64_t seed) {
    std::vector<float> priority(window.pixel_count());
    for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x) {
            const size_t i = window.index(x, y);
            priority[i] = float(std::exp2(2 * std::sin(0.1 * x) + 2 * std::cos(0.07 * y)) *
                                (1 + 0.1 * number(seed, i)));
        }
    }
    return priority;
}

std::vector<uint64_t> some_present() {
    std::vector<uint64_t> present(window.pixel_count());
    for (size_t i = 0; i < present.size(); ++i) present[i] = uint64_t(8) << (i / 7 % 4);
    return present;
}

double mean_of(const std::vector<uint64_t>& counts) {
    return double(std::accumulate(counts.begin(), counts.end(), uint64_t(0))) /
           double(counts.size());
}

}  // namespace

TEST(TopUpPlaces, PowersOfTwoInProportionWithTheMeanThatWasAskedFor) {
    const std::vector<float> priority = some_priority(1);
    const std::vector<uint64_t> none(priority.size(), 0), present = some_present();
    for (const double mean : {40.0, 64.0, 333.0}) {
        const auto counts = layers::place_samples(window, priority, none, mean);
        EXPECT_NEAR(mean_of(counts), mean, 0.03 * mean);
        double min = 1e9, max = 0;
        for (size_t i = 0; i < counts.size(); ++i) {
            EXPECT_TRUE(std::has_single_bit(counts[i]));
            min = std::min(min, double(counts[i]) / double(priority[i]));
            max = std::max(max, double(counts[i]) / double(priority[i]));
        }
        // A rounding to powers of two, and the factors of the tiles
        EXPECT_LT(max / min, 2.4);

        const auto more = layers::place_samples(window, priority, present, mean);
        EXPECT_NEAR(mean_of(more), mean, 0.03 * mean);
        for (size_t i = 0; i < more.size(); ++i) {
            EXPECT_GE(more[i], present[i]);
            EXPECT_TRUE(std::has_single_bit(more[i]));
        }
    }
    // Fewer than there are: none are added
    EXPECT_EQ(layers::place_samples(window, priority, present, 2), present);
}

TEST(TopUpPlaces, WhatAPixelHasSeenDoesNotDecideOnItsSamples) {
    // A pixel's samples enter into the priorities up to top_up_reach away, not into its own
    const std::vector<float> priority = some_priority(4);
    const std::vector<uint64_t> present = some_present();
    const auto counts = layers::place_samples(window, priority, present, 120);
    size_t changed = 0;
    for (const auto& [px, py] :
         {std::pair(-5, 3), {10, 18}, {11, 19}, {26, 34}, {43, 50}, {90, 66}}) {
        for (const float factor : {0.0f, 30.0f, 1e30f, std::numeric_limits<float>::infinity()}) {
            std::vector<float> other = priority;
            for (int y = std::max(py - layers::top_up_reach, window.y0);
                 y <= std::min(py + layers::top_up_reach, window.y1 - 1); ++y) {
                for (int x = std::max(px - layers::top_up_reach, window.x0);
                     x <= std::min(px + layers::top_up_reach, window.x1 - 1); ++x)
                    if (x != px || y != py) other[window.index(x, y)] *= factor;
            }
            const auto others = layers::place_samples(window, other, present, 120);
            EXPECT_EQ(others[window.index(px, py)], counts[window.index(px, py)])
                << px << ", " << py;
            for (size_t i = 0; i < counts.size(); ++i) changed += size_t(others[i] != counts[i]);
        }
    }
    EXPECT_GT(changed, 100u);
}

TEST(TopUpPlaces, ImagesWithoutNoiseOrNeighborsAreEven) {
    const Window tiny{0, 0, 4, 3};
    const std::vector<float> priority(12, 0.3f);
    EXPECT_EQ(layers::place_samples(tiny, priority, std::vector<uint64_t>(12, 8), 20),
              std::vector<uint64_t>(12, 20));
    // Nothing to do where nothing is noisy
    const std::vector<float> none(window.pixel_count(), 0.0f);
    const std::vector<uint64_t> present = some_present();
    EXPECT_EQ(layers::place_samples(window, none, present, 100), present);
}

TEST(TopUpPlaces, NumbersThatAreNoneAddNoSamples) {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN(),
                    infinite = std::numeric_limits<float>::infinity();
    const std::vector<float> priority = some_priority(6);
    const std::vector<uint64_t> present = some_present();
    for (const double mean : {double(nan), -5.0, 0.0, -double(infinite)})
        EXPECT_EQ(layers::place_samples(window, priority, present, mean), present) << mean;
    for (const double mean : {double(infinite), 1e300})
        EXPECT_EQ(layers::place_samples(window, priority, present, mean),
                  layers::place_samples(window, priority, present, 0xffffffffu))
            << mean;

    // Pixels whose priority says nothing stay as they are; so do those that have more than any may
    // get
    std::vector<float> holes = priority;
    std::vector<uint64_t> more = present;
    for (size_t i = 0; i < holes.size(); i += 5)
        holes[i] = std::array{nan, infinite, -infinite, -1.0f, 0.0f}[i / 5 % 5];
    for (size_t i = 2; i < more.size(); i += 5)
        more[i] = std::array{uint64_t(1) << 20, uint64_t(0xffffffffu),
                             (uint64_t(1) << 31) + 1}[i / 5 % 3];
    const auto counts = layers::place_samples(window, holes, more, 1e9);
    const auto few = layers::place_samples(window, holes, more, 40);
    size_t grown = 0;
    for (size_t i = 0; i < counts.size(); ++i) {
        EXPECT_GE(counts[i], more[i]);
        if (i % 5 == 0) {
            EXPECT_EQ(counts[i], more[i]);
        }
        if (i % 5 == 2) {
            EXPECT_EQ(few[i], more[i]);
        }
        grown += size_t(counts[i] > more[i]);
    }
    EXPECT_GT(grown, counts.size() / 2);
}

TEST(TopUpRequests, ComeBackAsTheyWereWritten) {
    layers::TopUpRequest request;
    request.scene_hash = "12ab";
    request.settings_hash = "34cd";
    request.samples = 77.5;
    request.look_json = R"({"controls":[]})";
    request.window = window;
    request.priority = some_priority(5);
    request.present = some_present();
    const std::string path = temporary("request.json");
    ASSERT_TRUE(layers::write_top_up(path, request).has_value());
    const auto read = layers::read_top_up(path);
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_EQ(read->scene_hash, request.scene_hash);
    EXPECT_EQ(read->settings_hash, request.settings_hash);
    EXPECT_EQ(read->samples, request.samples);
    EXPECT_EQ(read->look_json, request.look_json);
    EXPECT_EQ(read->window, request.window);
    EXPECT_EQ(read->priority, request.priority);
    EXPECT_EQ(read->present, request.present);
}

TEST(TopUpRequests, DamagedMapsAreErrors) {
    layers::TopUpRequest request;
    request.samples = 12;
    request.window = window;
    request.priority = some_priority(7);
    request.present = some_present();
    const std::string path = temporary("damaged_map.json"),
                      map_path = temporary("damaged_map.priority.exr");
    ASSERT_TRUE(layers::write_top_up(path, request).has_value());
    const Image good = *read_exr(map_path);
    ASSERT_EQ(good.parts.size(), 1u);

    const size_t pixels = window.pixel_count();
    const std::vector<std::pair<const char*, std::vector<Channel>>> bad = {
        {"no priority", {*good.find("present")}},
        {"no counts", {*good.find("priority")}},
        {"halves", {Channel::make("priority", ChannelType::Half, pixels), *good.find("present")}},
        {"counts with fractions",
         {*good.find("priority"), Channel::make("present", ChannelType::Float, pixels)}},
        {"other names",
         {Channel::make("a.priority", ChannelType::Float, pixels),
          Channel::make("a.present", ChannelType::Uint, pixels)}},
    };
    for (const auto& [why, channels] : bad) {
        Image map = good;
        map.parts[0].channels = channels;
        ASSERT_TRUE(write_exr(map_path, map).has_value());
        EXPECT_EQ(layers::read_top_up(path).error().code, "bad-request") << why;
    }
    // Parts over other pixels, a file that ends too early, no image, none at all
    make_exr(map_path,
             {{"a", window, {}, {"priority"}, {}}, {"b", {-5, 3, 91, 60}, {}, {}, {"present"}}});
    EXPECT_EQ(layers::read_top_up(path).error().code, "io-read");
    ASSERT_TRUE(write_exr(map_path, good).has_value());
    const std::string bytes = *read_file(map_path);
    for (size_t size = 0; size < bytes.size(); size += bytes.size() / 40) {
        ASSERT_TRUE(write_file_atomically(map_path, bytes.substr(0, size)).has_value());
        EXPECT_FALSE(layers::read_top_up(path).has_value()) << size;
    }
    std::filesystem::remove(map_path);
    EXPECT_EQ(layers::read_top_up(path).error().code, "io-open");
}

TEST(TopUpRequests, MoreSamplesThanTheMapHasRoomForAreNotWritten) {
    layers::TopUpRequest request;
    request.window = {0, 0, 2, 1};
    request.priority = {1, 2};
    request.present = {3, 0xffffffffu};
    const std::string path = temporary("room.json");
    request.samples = 0xffffffffu;
    ASSERT_TRUE(layers::write_top_up(path, request).has_value());
    EXPECT_EQ(layers::read_top_up(path)->present, request.present);
    for (const double samples : {0x1p32, -1.0, double(std::numeric_limits<float>::quiet_NaN())}) {
        request.samples = samples;
        EXPECT_EQ(layers::write_top_up(path, request).error().code, "bad-request") << samples;
    }
    request.samples = 8;
    request.present[1] += 1;
    EXPECT_EQ(layers::write_top_up(path, request).error().code, "bad-request");
}

TEST(TopUpRequests, DamagedOnesAreErrors) {
    const std::string path = temporary("bad.json");
    for (const char* text :
         {"", "[]", "{}", R"({"schema": "velatura.look/1", "controls": []})",
          R"({"schema": "velatura.topup/1"})",
          R"({"schema": "velatura.topup/1", "sceneHash": 1, "settingsHash": "", "samples": 1,
             "map": "x.exr", "look": {}})"}) {
        ASSERT_TRUE(write_file_atomically(path, text).has_value());
        const auto read = layers::read_top_up(path);
        ASSERT_FALSE(read.has_value()) << text;
        EXPECT_EQ(read.error().code, "bad-request");
    }
    // Nested so deeply that printing it again would take all of the stack
    const std::string deep = std::string(200000, '[') + std::string(200000, ']');
    ASSERT_TRUE(
        write_file_atomically(
            path,
            R"({"schema": "velatura.topup/1", "sceneHash": "", "settingsHash": "", "samples": 1,
                "map": "x.exr", "look": )" +
                deep + "}")
            .has_value());
    EXPECT_EQ(layers::read_top_up(path).error().code, "bad-request");
    ASSERT_TRUE(
        write_file_atomically(
            path,
            R"({"schema": "velatura.topup/1", "sceneHash": "", "settingsHash": "", "samples": 1,
                "map": "nowhere.exr", "look": {}})")
            .has_value());
    EXPECT_FALSE(layers::read_top_up(path).has_value());
}

}  // namespace velatura::image
