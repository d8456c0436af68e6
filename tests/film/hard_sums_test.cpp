// SPDX-License-Identifier: Apache-2.0
// Sums of many samples (H38), samples that are no numbers (H39), filters that subtract (H49).
#include "accumulate/pixel_means.h"
#include "base/hash.h"
#include "film/film.h"
#include "film/film_scene.h"
#include "hard_case.h"
#include "layers/layer_file.h"
#include "layers/layer_header.h"
#include "sampling/filter.h"
#include "sampling/sampler.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

namespace velatura::film {
namespace {

LayerSet beauty_only() {
    LayerSet set;
    set.groups = {{"key", {"/Key"}, false}};
    set.bounce_layers = set.group_layers = set.data_layers = false;
    return set;
}

/// Sum of `count` samples of one pixel.
accumulate::Triple sum_of(uint64_t count, const std::function<float(uint64_t)>& value) {
    const LayerSet set = beauty_only();
    Film film({0, 0, 1, 1}, set);
    SampleRadiance s(set);
    PixelAccumulator acc(set);
    film.begin_pixel(acc, 0, 0, 0);
    for (uint64_t i = 0; i < count; ++i) {
        s.clear();
        s.add(1, 0, Rgb(value(i)));
        acc.add(s);
    }
    film.end_pixel(acc);
    return film.sums().total(0, 0, accumulate::AccumulatorTable::beauty);
}

TEST(H38Accumulation, MeanOfManySamplesIsTheirMean) {
    const uint64_t count = hardcase::sized(4000000, 100000000, 1000000000);
    const auto value = [](uint64_t i) { return 2.0f * float(mix64(i) >> 40) * 0x1p-24f; };
    // Multiples of 2^-23 below 2^41: long double adds them without rounding
    long double exact = 0;
    float naive = 0;
    for (uint64_t i = 0; i < count; ++i) {
        exact += static_cast<long double>(value(i));
        naive += value(i);
    }
    const double sum = sum_of(count, value).x;
    hardcase::expect_within(
        {fmt::format("mean of {} samples, relative (floats added in turn: {:.1e})", count,
                     std::abs(double(naive) / double(exact) - 1)),
         double(std::abs(static_cast<long double>(sum) - exact) / exact), 1e-7, 0,
         "exact sum in long double"});
}

TEST(H38Accumulation, DimLightIsKeptBesideABrightFlash) {
    const uint64_t count = hardcase::sized(1000000, 100000000, 1000000000);
    for (const uint64_t flash : {uint64_t(0), count / 3, count - 1}) {
        const double sum = sum_of(count, [&](uint64_t i) { return i == flash ? 1e6f : 1e-3f; }).x;
        const double dim = double(1e-3f) * double(count - 1);
        hardcase::expect_within(
            {fmt::format("{} samples of 1e-3 beside one of 1e6 at {}, relative", count, flash),
             std::abs((sum - 1e6) / dim - 1), 1e-6, 0, "closed form"});
    }
}

TEST(H39BadSamples, AreCountedNamedAndHarmNoOther) {
    constexpr uint64_t samples = 12;
    const Window window{0, 0, 24, 20};
    const LayerSet set = test_layer_set();
    const float nan = std::numeric_limits<float>::quiet_NaN(),
                inf = std::numeric_limits<float>::infinity();
    for (const size_t count : {size_t(1), size_t(16), size_t(50)}) {
        // In the order in which the film names them: index of the sample, then pixel
        std::set<uint64_t> bad;
        for (uint64_t key = 1; bad.size() < count; ++key)
            bad.insert(mix64(key) % (window.pixel_count() * samples));
        Film clean(window, set), film(window, set);
        SampleRadiance s(set);
        PixelAccumulator acc(set);
        std::set<uint64_t> touched;
        for (const uint64_t place : bad) touched.insert(place % window.pixel_count());
        const auto fill = [&](Film& to, bool has_bad) {
            for (uint64_t pixel = 0; pixel < window.pixel_count(); ++pixel) {
                const int x = int(pixel) % window.width(), y = int(pixel) / window.width();
                to.begin_pixel(acc, x, y, 0);
                for (uint64_t i = 0; i < samples; ++i) {
                    s.clear();
                    s.add(1, 0, Rgb(float(mix64(pixel * samples + i) >> 40)));
                    const uint64_t place = i * window.pixel_count() + pixel;
                    if (has_bad && bad.contains(place))
                        s.add(2, 1, Rgb(place % 3 == 0 ? nan : place % 3 == 1 ? inf : -1.0f, 0, 0));
                    acc.add(s);
                }
                to.end_pixel(acc);
            }
        };
        fill(clean, false);
        fill(film, true);
        hardcase::expect_within(
            {fmt::format("bad samples, NaN, infinite and negative, counted of {}, less that",
                         count),
             std::abs(double(film.invalid_count()) - double(count)), 0, 0, "count"});
        const std::vector<BadSample> named = film.bad_samples();
        ASSERT_EQ(named.size(), std::min(count, size_t(16)));
        auto next = bad.begin();
        size_t misnamed = 0, changed = 0;
        for (const BadSample& b : named) {
            misnamed += b.sample * window.pixel_count() + uint64_t(b.y) * uint64_t(window.width()) +
                            uint64_t(b.x) !=
                        *next++;
        }
        hardcase::expect_within(
            {"of the first 16, named wrongly", double(misnamed), 0, 0, "where they were put"});
        for (uint64_t pixel = 0; pixel < window.pixel_count(); ++pixel) {
            if (touched.contains(pixel)) continue;
            const int x = int(pixel) % window.width(), y = int(pixel) / window.width();
            changed += film.sums().total(x, y, 0) != clean.sums().total(x, y, 0);
        }
        hardcase::expect_within({"other pixels that changed", double(changed), 0, 0,
                                 "the film without them, bit for bit"});

        // And the file says so
        const std::string path = temporary_file("bad_samples.exr");
        ASSERT_TRUE(film.write(path, {}).has_value());
        const auto read = layers::read_layer_file(path);
        ASSERT_TRUE(read.has_value());
        const auto header = layers::read_layer_header(*read);
        ASSERT_TRUE(header.has_value());
        hardcase::expect_within({"count in the header of the file, less that",
                                 std::abs(double(header->samples.invalid) - double(count)), 0, 0,
                                 "count"});
    }
}

/// The brightest light that a sample may bring: weights may still add to its mean.
constexpr float brightest = std::numeric_limits<float>::max() / 16;

/// A pixel of eight samples, of which `fill` says what they bring.
Film film_of(const std::function<void(uint64_t, SampleRadiance&)>& fill) {
    const LayerSet set = test_layer_set();
    Film film({0, 0, 1, 1}, set);
    SampleRadiance s(set);
    PixelAccumulator acc(set);
    film.begin_pixel(acc, 0, 0, 0);
    for (uint64_t i = 0; i < 8; ++i) {
        s.clear();
        fill(i, s);
        acc.add(s);
    }
    film.end_pixel(acc);
    return film;
}

/// Each part is a number, and their sum is none that a file holds.
TEST(H39BadSamples, SumsBeyondFloatsAreCounted) {
    const Film film = film_of([](uint64_t i, SampleRadiance& s) {
        s.add(1, 0, Rgb(i == 3 || i == 5 ? brightest : 1.0f));
        if (i == 3) s.add(2, 0, Rgb(brightest, 0, 0));
        if (i == 5) s.weight = -1.5f;
        EXPECT_EQ(s.is_bad(), i == 3 || i == 5) << i;
    });
    hardcase::expect_within(
        {"samples beyond floats, by their parts and by the filter, counted, less 2",
         std::abs(double(film.invalid_count()) - 2), 0, 0, "count"});
    const std::string path = temporary_file("beyond_floats.exr");
    EXPECT_TRUE(film.write(path, {}).has_value());
    for (const BadSample& bad : film.bad_samples()) EXPECT_EQ(std::string(bad.reason), "infinite");
}

/// Squares of such light are beyond floats: the layer of the variance must not cost the image.
TEST(H50BrightestLight, IsWritten) {
    const Film film = film_of(
        [](uint64_t i, SampleRadiance& s) { s.add(1, 0, Rgb(i % 2 == 0 ? brightest : 0.0f)); });
    EXPECT_EQ(film.invalid_count(), 0u);
    const std::string path = temporary_file("brightest.exr");
    const auto written = film.write(path, {});
    ASSERT_TRUE(written.has_value()) << written.error().message;
    const auto read = layers::read_layer_file(path);
    ASSERT_TRUE(read.has_value());
    hardcase::expect_within(
        {"light of a sixteenth of the largest float, every other sample, as read from the file, "
         "relative",
         std::abs(double(read->find("R")->value(0)) / (0.5 * double(brightest)) - 1), 0x1p-23, 0,
         "closed form"});
}

/// How far the farthest pixel of an image of 1 everywhere is from that, by n samples of a filter.
double farthest_from_one(sampling::FilterKind kind, sampling::SamplerKind numbers, int n) {
    const LayerSet set = beauty_only();
    const sampling::PixelFilter filter(kind);
    const Window window{0, 0, 32, 32};
    Film film(window, set);
    SampleRadiance s(set);
    PixelAccumulator acc(set);
    for (int i = 0; i < int(window.pixel_count()); ++i) {
        film.begin_pixel(acc, i % 32, i / 32, 0);
        for (int k = 0; k < n; ++k) {
            const sampling::PixelSampler sampler(3, i % 32, i / 32, uint64_t(k), numbers);
            const Vec2 u = sampler.get_2d(0, sampling::Purpose::PixelFilter);
            s.clear();
            s.weight = filter.sample(u, sampler.get_1d(0, sampling::Purpose::FilterSign)).weight;
            s.alpha = 1.0f;
            s.add(1, 0, Rgb(1.0f));
            acc.add(s);
        }
        film.end_pixel(acc);
    }
    double worst = 0;
    for (const float v : accumulate::resolve_rgba(film.sums()))
        worst = hardcase::larger(worst, std::abs(double(v) - 1));
    return worst;
}

hardcase::Measurement even_image(sampling::FilterKind kind,
                                 int n,
                                 sampling::SamplerKind numbers = sampling::SamplerKind::BlueNoise) {
    return {fmt::format("{}, {} samples of sampler {}: farthest pixel of a picture of 1",
                        sampling::filter_name(kind), n, int(numbers)),
            farthest_from_one(kind, numbers, n), 1e-6, 0, "closed form"};
}

TEST(H49NegativeLobes, EvenImagesStayEven) {
    using enum sampling::FilterKind;
    for (const auto kind : {Box, Triangle, Gaussian, BlackmanHarris})
        for (const int n : {1, 2, 5, 64}) hardcase::expect_within(even_image(kind, n));
    using enum sampling::SamplerKind;
    for (const auto numbers :
         {Sobol, SobolHalves, BlueNoise, BlueNoiseHalves, Stratified, StratifiedHalves})
        for (const int n : {1, 2, 3, 4, 5, 7, 8, 64, 256})
            hardcase::expect_within(even_image(Mitchell, n, numbers));
}

}  // namespace
}  // namespace velatura::film
