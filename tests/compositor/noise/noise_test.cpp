// SPDX-License-Identifier: Apache-2.0
#include "compositor/noise/noise.h"

#include "compositor/noise/error_map.h"
#include "compositor/test_stack.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace velatura::compositor::noise {
namespace {

const image::Window window{0, 0, 20, 17};

film::Film make_film(bool has_halves, uint64_t first, uint64_t end) {
    film::LayerSet set = film::test_layer_set();
    set.matrix_layers = set.shadow_layers = set.float_layers = true;
    set.halves = has_halves;
    film::Film film(window, set);
    film::render(film, first, end);
    return film;
}

using enum Control::Kind;

double sum_of(const std::vector<RowNoise>& rows) {
    double sum = 0;
    for (const RowNoise& row : rows) sum += row.share;
    return sum;
}

TEST(Noise, AUnitLookHasTheErrorThatTheRendererStates) {
    // Odd counts too, where the halves differ in samples
    for (const uint64_t samples : {4, 7, 16}) {
        const film::Film film = make_film(true, 0, samples);
        const auto forecast = forecast_noise(through_file(film), {}, std::nullopt);
        ASSERT_TRUE(forecast.has_value());
        const film::NoiseEstimate stated = film.noise();
        for (const statistics::RelativeError* e : {&forecast->rendered, &forecast->mix}) {
            EXPECT_NEAR(e->value, stated.error.value, 1e-5 * stated.error.value);
            EXPECT_NEAR(e->low, stated.error.low, 1e-4 * stated.error.low);
            EXPECT_NEAR(e->high, stated.error.high, 1e-4 * stated.error.high);
        }
        EXPECT_EQ(forecast->advice.sample_factor, 1.0);
        EXPECT_TRUE(forecast->advice.caps.empty());
        EXPECT_EQ(forecast->error.storage, 0.0);
    }
}

TEST(Noise, SharesOfRowsAddUp) {
    const LayerStack stack = through_file(make_film(true, 0, 8));
    const auto forecast = forecast_noise(
        stack, look_of({{Gain, "indirect=+2st"}, {Tint, "fill=1,.5,0"}, {Shadow, "key=0.7"}}),
        std::nullopt);
    ASSERT_TRUE(forecast.has_value());
    EXPECT_EQ(forecast->groups.size(), 4u);
    EXPECT_EQ(forecast->bounces.size(), 4u);
    ASSERT_EQ(forecast->shadows.size(), 1u);
    EXPECT_EQ(forecast->shadows[0].name, "S_key");
    const double shadows = sum_of(forecast->shadows);
    EXPECT_NEAR(sum_of(forecast->groups) + shadows, 1.0, 1e-5);
    EXPECT_NEAR(sum_of(forecast->bounces) + shadows, 1.0, 1e-5);
    for (const auto* rows : {&forecast->groups, &forecast->bounces})
        EXPECT_TRUE(std::is_sorted(rows->begin(), rows->end(),
                                   [](const auto& a, const auto& b) { return a.share > b.share; }));
}

TEST(Noise, ACapHoldsTheTarget) {
    const LayerStack stack = through_file(make_film(true, 0, 8));
    Look look = look_of({{Gain, "key=0.5"}, {Gain, "tail=+4st"}, {Shadow, "fill=1"}});
    // Slightly above the render's error, which the lifted shadow of `fill` exceeds by itself
    const auto rendered = forecast_noise(stack, {}, std::nullopt);
    ASSERT_TRUE(rendered.has_value());
    const double target = 1.05 * rendered->rendered.value;
    const auto forecast = forecast_noise(stack, look, target);
    ASSERT_TRUE(forecast.has_value());
    const NoiseAdvice& advice = forecast->advice;
    EXPECT_EQ(advice.target, target);
    EXPECT_GT(advice.sample_factor, 1.5);
    const double ratio = forecast->mix.value / target;
    EXPECT_NEAR(advice.sample_factor, ratio * ratio, 1e-9 * ratio * ratio);
    // A gain below 1 is none to take back
    ASSERT_EQ(advice.caps.size(), 2u);
    EXPECT_EQ(advice.caps[0].control.target, "tail");
    EXPECT_EQ(advice.caps[1].control.target, "fill");
    ASSERT_TRUE(advice.caps[0].max.has_value());
    look.controls[1].factor.fill(float(*advice.caps[0].max));
    const auto capped = forecast_noise(stack, look, std::nullopt);
    ASSERT_TRUE(capped.has_value());
    EXPECT_LE(capped->mix.value, advice.target * (1 + 1e-6));
    EXPECT_GT(capped->mix.value, advice.target * 0.97);
    // Out of reach of any gain
    const auto hopeless = forecast_noise(stack, look, 1e-6);
    ASSERT_TRUE(hopeless.has_value());
    for (const ControlCap& cap : hopeless->advice.caps) EXPECT_FALSE(cap.max.has_value());
}

/// Independent renders of the same made-up image: the spread among them is what is forecast.
TEST(Noise, ForecastsTheSpreadOfMixes) {
    constexpr uint64_t runs = 64, samples = 8;
    const Look looks[] = {look_of({{Gain, "all=1"}}),
                          look_of({{Gain, "indirect=+3st"}}),
                          look_of({{Solo, "key"}, {Kelvin, "key=3000"}}),
                          look_of({{Mute, "b1"}, {Gain, "fill=4"}}),
                          look_of({{Shadow, "key=1"}, {Shadow, "fill=0.5"}}),
                          look_of({{Gain, "tail=0"}, {Gain, "sky:b2=+5st"}})};
    constexpr size_t count = std::size(looks);
    const size_t pixels = window.pixel_count();
    std::vector<double> forecast(count, 0.0);
    std::vector<std::vector<double>> sum(count, std::vector<double>(3 * pixels, 0.0)), square = sum;
    for (uint64_t run = 0; run < runs; ++run) {
        const LayerStack stack = through_file(make_film(true, run * samples, (run + 1) * samples));
        for (size_t l = 0; l < count; ++l) {
            const auto mix = mix_error(stack, *mix::plan_mix(stack, looks[l]), looks[l]);
            ASSERT_TRUE(mix.has_value());
            for (size_t c = 0; c < 3; ++c) {
                for (size_t i = 0; i < pixels; ++i) {
                    const auto v = double(mix->mean[c][i]);
                    sum[l][3 * i + c] += v;
                    square[l][3 * i + c] += v * v;
                    forecast[l] += mix->variance(c, i) / double(runs);
                }
            }
        }
    }
    for (size_t l = 0; l < count; ++l) {
        double spread = 0;
        for (size_t k = 0; k < 3 * pixels; ++k)
            spread += (square[l][k] - sum[l][k] * sum[l][k] / double(runs)) / double(runs - 1);
        EXPECT_NEAR(std::sqrt(forecast[l] / spread), 1.0, 0.1) << "look " << l;
    }
}

TEST(Noise, PooledErrorsAreMeansOverWindows) {
    const LayerStack stack = through_file(make_film(true, 0, 4));
    const Look look = look_of({{Gain, "b2=3"}});
    const auto mix = mix_error(stack, *mix::plan_mix(stack, look), look);
    ASSERT_TRUE(mix.has_value());
    const image::Image errors = error_image(stack, *mix);
    for (const auto& [x, y] : {std::pair{0, 0}, {10, 8}, {19, 3}, {2, 16}}) {
        double green = 0, relative = 0, n = 0;
        for (int v = std::max(0, y - 3); v <= std::min(16, y + 3); ++v) {
            for (int u = std::max(0, x - 3); u <= std::min(19, x + 3); ++u) {
                green += mix->variance(1, window.index(u, v));
                for (size_t c = 0; c < 3; ++c)
                    relative += mix->relative_square(c, window.index(u, v)) / 3;
                n += 1;
            }
        }
        const size_t at = window.index(x, y);
        EXPECT_NEAR(double(errors.find("G")->value(at)), std::sqrt(green / n),
                    1e-5 * std::sqrt(green / n));
        EXPECT_NEAR(double(errors.find("relative")->value(at)), std::sqrt(relative / n),
                    1e-5 * std::sqrt(relative / n));
    }
}

TEST(Noise, WithoutHalvesSaysWhatToRender) {
    const auto forecast = forecast_noise(through_file(make_film(false, 0, 4)), {}, std::nullopt);
    ASSERT_FALSE(forecast.has_value());
    EXPECT_EQ(forecast.error().code, "halves-not-stored");
    EXPECT_NE(forecast.error().message.find("--halves"), std::string::npos);
}

}  // namespace
}  // namespace velatura::compositor::noise
