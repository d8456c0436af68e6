// SPDX-License-Identifier: Apache-2.0
// Samples that follow a mix: the mean stays, the error falls as forecast, and however often the
// work is stopped the bits stay.
#include "compositor/noise/top_up.h"

#include "base/hash.h"
#include "integrator/schedule.h"
#include "layers/sums_part.h"
#include "transport/mixes.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace velatura::test {

namespace {

using compositor::LayerStack;
using compositor::Look;

constexpr int size_px = 48;
constexpr film::Window window{0, 0, size_px, size_px};
constexpr double rare = 0.02, usual = 0.2;  ///< chances that a sample meets the lamp

film::LayerSet two_rows() {
    film::LayerSet layers;
    layers.last_bounce = 0;
    layers.groups = {{"lamp", {}, false}, {"fill", {}, false}};
    layers.data_layers = false;
    layers.halves = layers.float_layers = true;
    return layers;
}

double number(uint64_t seed, int x, int y, uint64_t sample) {
    uint64_t h = hash_combine(seed, uint64_t(x));
    h = hash_combine(hash_combine(h, uint64_t(y)), sample);
    return double(h >> 11) * 0x1p-53;
}

/// A lamp of mean 1 that few samples meet, on the left more seldom looked for; other light of mean
/// 1 with some noise.
integrator::SampleFunction lamp_and_fill(uint64_t seed, double chance = rare) {
    return [seed, chance](int x, int y, uint64_t s, film::SampleRadiance& out,
                          integrator::RayCounts& counts) {
        ++counts.camera;
        out.alpha = 1;
        const double p = x < size_px / 2 ? chance : std::min(1.0, 5 * chance);
        if (number(2 * seed, x, y, s) < p) out.add(0, 0, Rgb(float(1 / p)));
        out.add(0, 1, Rgb(float(0.5 + number(2 * seed + 1, x, y, s))));
    };
}

integrator::RenderOptions options_of(uint64_t samples) {
    integrator::RenderOptions options;
    options.tile_size = 16;
    options.end_sample = samples;
    return options;
}

film::Film first_render(uint64_t seed, uint64_t samples, double chance = rare) {
    film::Film film(window, two_rows());
    integrator::run_schedule(film, options_of(samples), lamp_and_fill(seed, chance), {});
    return film;
}

Look lamp_by(double stops) {
    Look look;
    look.controls.push_back(gain("lamp", stops));
    return look;
}

std::vector<uint64_t> counts_of(const film::Film& film) {
    std::vector<uint64_t> counts;
    for (int y = 0; y < size_px; ++y) {
        for (int x = 0; x < size_px; ++x) counts.push_back(film.next_sample(x, y));
    }
    return counts;
}

compositor::noise::TopUpPlan plan_for(const film::Film& film, const Look& look, double samples) {
    auto plan = compositor::noise::plan_top_up(through_file(film), counts_of(film), look,
                                               {.target = {}, .samples = samples});
    EXPECT_TRUE(plan.has_value());
    return std::move(*plan);
}

integrator::RenderResult top_up(film::Film& film,
                                const layers::TopUpRequest& request,
                                uint64_t samples,
                                const integrator::SampleFunction& sample,
                                const std::atomic<bool>* stop = nullptr) {
    const integrator::TopUpCounts counts(
        film, layers::place_samples(window, request.priority, request.present, double(samples)),
        samples);
    integrator::RenderCallbacks callbacks;
    callbacks.stop = stop;
    return integrator::run_schedule(film, options_of(samples), sample, callbacks, &counts);
}

/// Mean over the pixels of the lamp's row.
double lamp_mean(const film::Film& film) {
    double mean = 0;
    const uint32_t row = film.sums().table().group(0);
    for (int y = 0; y < size_px; ++y) {
        for (int x = 0; x < size_px; ++x)
            mean += film.sums().total(x, y, row).x / double(film.next_sample(x, y));
    }
    return mean / (size_px * size_px);
}

struct Mean {
    double sum = 0, square = 0;
    int count = 0;

    void add(double value) {
        sum += value;
        square += value * value;
        ++count;
    }

    double value() const { return sum / count; }

    double error() const {
        return std::sqrt(std::max(0.0, square / count - value() * value()) / (count - 1));
    }

    /// Smallest deviation that a test at 99 % would see with 90 % power.
    double detectable() const { return (2.58 + 1.28) * error(); }
};

}  // namespace

/// Samples that go by what a pixel met bias its mean. So its priority is the same to the last bit
/// whatever it met, and that of the pixel beside it is not.
TEST(TopUp, WhatAPixelMetDoesNotDecideOnItsOwnPriority) {
    constexpr int px = 20, py = 17;
    const auto with = [](double light) {
        film::Film film(window, two_rows());
        const integrator::SampleFunction made = lamp_and_fill(3, usual);
        const integrator::SampleFunction changed = [&](int x, int y, uint64_t s,
                                                       film::SampleRadiance& out,
                                                       integrator::RayCounts& counts) {
            made(x, y, s, out, counts);
            if (x == px && y == py && s == 5) out.add(0, 0, Rgb(float(light)));
        };
        integrator::run_schedule(film, options_of(8), changed, {});
        return plan_for(film, lamp_by(2), 40).request.priority;
    };
    const std::vector<float> dark = with(0), bright = with(400);
    EXPECT_EQ(dark[window.index(px, py)], bright[window.index(px, py)]);
    EXPECT_LT(dark[window.index(px + 1, py)], bright[window.index(px + 1, py)]);
}

TEST(TopUp, TheMeanOfAllSamplesStays) {
    Mean placed, by_own_noise;
    for (uint64_t seed = 0; seed < 120; ++seed) {
        film::Film film = first_render(seed, 8);
        const compositor::noise::TopUpPlan plan = plan_for(film, lamp_by(2), 40);
        top_up(film, plan.request, 40, lamp_and_fill(seed));
        placed.add(lamp_mean(film));

        // What the test can see: pixels that ask for samples by what they saw themselves
        if (seed >= 24) continue;
        film::Film biased = first_render(seed, 8);
        layers::TopUpRequest own = plan.request;
        for (size_t i = 0; i < window.pixel_count(); ++i)
            own.priority[i] = float(std::sqrt(plan.forecast.error.relative_square(0, i)) + 0.05);
        top_up(biased, own, 40, lamp_and_fill(seed));
        by_own_noise.add(lamp_mean(biased));
    }
    fmt::print("mean {:.5f} of 1, detectable {:.2g}; by own noise {:.4f}, detectable {:.2g}\n",
               placed.value(), placed.detectable(), by_own_noise.value(),
               by_own_noise.detectable());
    ASSERT_LT(placed.detectable(), 0.01);
    EXPECT_NEAR(placed.value(), 1, 2.58 * placed.error());
    EXPECT_GT(std::abs(by_own_noise.value() - 1), 10 * by_own_noise.error());
}

TEST(TopUp, BringsTheErrorThatItForecasts) {
    Mean before, after, forecast;
    double samples = 0;
    constexpr int runs = 30;
    for (uint64_t seed = 0; seed < runs; ++seed) {
        film::Film film = first_render(seed + 1000, 64, usual);
        const compositor::noise::TopUpPlan plan = plan_for(film, lamp_by(2), 256);
        top_up(film, plan.request, 256, lamp_and_fill(seed + 1000, usual));
        samples += film.noise().samples_mean / runs;
        const auto error = compositor::noise::mix_error(
            through_file(film), *compositor::mix::plan_mix(through_file(film), lamp_by(2)),
            lamp_by(2));
        ASSERT_TRUE(error.has_value());
        double relative = 0, relative_before = 0;
        for (size_t i = 0; i < window.pixel_count(); ++i) {
            relative += double(error->mean[0][i] - 5) * double(error->mean[0][i] - 5) / 25 /
                        double(window.pixel_count());
            const double old = double(plan.forecast.error.mean[0][i] - 5);
            relative_before += old * old / 25 / double(window.pixel_count());
        }
        after.add(relative);
        before.add(relative_before);
        forecast.add(plan.error_after * plan.error_after);
    }
    fmt::print("relMSE {:.3g} before, {:.3g} after {:.1f} samples; forecast {:.3g}\n",
               before.value(), after.value(), samples, forecast.value());
    EXPECT_NEAR(samples, 256, 0.03 * 256);
    // All noise of the lamp is on the left: evenly placed samples leave a quarter, these hardly
    // more than an eighth
    EXPECT_LT(after.value(), 0.65 * before.value() / 4);
    EXPECT_NEAR(std::sqrt(forecast.value() / after.value()), 1, 0.1);
}

TEST(TopUp, HoweverOftenItIsStoppedTheBitsAreTheSame) {
    film::Film whole = first_render(5, 20);
    const compositor::noise::TopUpPlan plan = plan_for(whole, lamp_by(2), 60);
    top_up(whole, plan.request, 60, lamp_and_fill(5));
    EXPECT_EQ(counts_of(whole), layers::place_samples(window, plan.request.priority,
                                                      counts_of(first_render(5, 20)), 60));

    film::Film part = first_render(5, 20);
    std::atomic<bool> stop = false;
    std::atomic<int> left = 0;
    const integrator::SampleFunction value = lamp_and_fill(5);
    const integrator::SampleFunction counted =
        [&](int x, int y, uint64_t s, film::SampleRadiance& out, integrator::RayCounts& counts) {
            if (left.fetch_sub(1) <= 0) stop = true;
            value(x, y, s, out, counts);
        };
    int runs = 0;
    for (;; ++runs) {
        stop = false;
        left = 9000 + 1777 * runs;
        if (top_up(part, plan.request, 60, counted, &stop).reason ==
            integrator::StopReason::Complete)
            break;
    }
    EXPECT_GT(runs, 3);
    ASSERT_EQ(counts_of(part), counts_of(whole));
    for (const uint32_t a : whole.sums().used_accumulators()) {
        for (int y = 0; y < size_px; ++y) {
            for (int x = 0; x < size_px; ++x)
                ASSERT_EQ(part.sums().total(x, y, a), whole.sums().total(x, y, a));
        }
    }
}

// A render that was stopped in the middle of a pass, with pixels that have nothing at all, goes on
// to the same bits
TEST(Stopped, RendersGoOnWhereEveryPixelIs) {
    for (const bool is_adaptive : {false, true}) {
        for (const auto mode :
             {integrator::RenderMode::Tile, integrator::RenderMode::Progressive}) {
            integrator::RenderOptions options = options_of(48);
            options.adaptive = is_adaptive;
            options.mode = mode;
            film::Film whole(window, two_rows());
            integrator::run_schedule(whole, options, lamp_and_fill(3), {});

            std::atomic<bool> stop = false;
            std::atomic<int> left = 0;
            integrator::RenderCallbacks callbacks;
            callbacks.stop = &stop;
            int runs = 0;
            film::Film part(window, two_rows());
            for (bool is_done = false; !is_done; ++runs) {
                stop = false;
                left = 26000 + 7919 * runs;
                const integrator::SampleFunction value = lamp_and_fill(3);
                const auto result = integrator::run_schedule(
                    part, options,
                    [&](int x, int y, uint64_t s, film::SampleRadiance& out,
                        integrator::RayCounts& counts) {
                        if (left.fetch_sub(1) <= 0) stop = true;
                        value(x, y, s, out, counts);
                    },
                    callbacks);
                is_done = result.reason == integrator::StopReason::Complete;
                // Through the stored sums, as a file keeps them
                image::Image file;
                file.data = window;
                auto stored = layers::sums_parts(part.sums());
                ASSERT_TRUE(stored.has_value());
                file.parts = std::move(*stored);
                file.attributes["velatura/sums"] = layers::sums_json(part.layer_set(), file);
                auto sums = layers::read_sums(file);
                ASSERT_TRUE(sums.has_value());
                part = film::Film(std::move(*sums), {});
            }
            EXPECT_GT(runs, 2);
            for (int y = 0; y < size_px; ++y) {
                for (int x = 0; x < size_px; ++x) {
                    ASSERT_EQ(part.next_sample(x, y), whole.next_sample(x, y)) << x << ", " << y;
                    ASSERT_EQ(part.sums().record(x, y).rate, whole.sums().record(x, y).rate);
                    for (const uint32_t a : whole.sums().used_accumulators())
                        ASSERT_EQ(part.sums().total(x, y, a), whole.sums().total(x, y, a));
                }
            }
        }
    }
}

}  // namespace velatura::test
