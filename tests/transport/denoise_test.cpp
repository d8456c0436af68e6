// SPDX-License-Identifier: Apache-2.0
// What denoising is worth to mixes of real renders: error before and after, against many samples.
#include "compositor/denoise/denoise.h"

#include "compositor/mix/mix.h"
#include "compositor/noise/noise.h"
#include "transport/mixes.h"
#include "transport/transport_scene.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <vector>

namespace velatura::test {

namespace {

using compositor::LayerStack;
using compositor::Look;

constexpr int width = 144, height = 108;
constexpr uint64_t samples = 16, reference_samples = 256;

image::Image mixed(const LayerStack& stack, const Look& look) {
    return compositor::mix::apply_mix(stack, *compositor::mix::plan_mix(stack, look), look, false);
}

/// What is left of the noise in the mix itself, as relMSE, from its half images.
double noise_of(const LayerStack& stack, const Look& look) {
    const auto mix =
        compositor::noise::mix_error(stack, *compositor::mix::plan_mix(stack, look), look);
    EXPECT_TRUE(mix.has_value());
    double sum = 0;
    for (size_t c = 0; c < 3; ++c) {
        for (size_t i = 0; i < mix->mean[c].size(); ++i) {
            const auto m = double(mix->mean[c][i]);
            sum += mix->variance(c, i) / (m * m + 0.01);
        }
    }
    return sum / (3.0 * double(width) * height);
}

/// relMSE (docs/engineering/numerics.md).
double error(const image::Image& test, const image::Image& reference) {
    double sum = 0;
    for (const char* c : {"R", "G", "B"}) {
        const image::Channel *a = test.find(c), *b = reference.find(c);
        for (size_t i = 0; i < a->size(); ++i) {
            const double d = double(a->value(i)) - double(b->value(i)), r = double(b->value(i));
            sum += d * d / (r * r + 0.01);
        }
    }
    return sum / (3.0 * double(width) * height);
}

class DenoiseOfMixes : public testing::TestWithParam<const char*> {};

/// Weights are found once for all layers, so what counts is the error of mixes that come after.
TEST_P(DenoiseOfMixes, IsThreeTimesBetter) {
    const scene::Scene scene = load_scene(GetParam(), width, height);
    TransportRenderer renderer(scene, default_technique());
    film::LayerSet layers = renderer.beauty_layers();
    layers.matrix_layers = layers.halves = layers.data_layers = true;
    layers.last_bounce = 3;
    const LayerStack noisy = through_file(renderer.render_film(1, samples, {}, layers));
    compositor::denoise::DenoiseReport report;
    auto filtered = compositor::denoise::denoise(noisy, report);
    ASSERT_TRUE(filtered.has_value()) << filtered.error().message;
    const auto clean = LayerStack::from_image(std::move(*filtered));
    ASSERT_TRUE(clean.has_value());
    layers.data_layers = false;
    const LayerStack reference =
        through_file(renderer.render_film(2, reference_samples, {}, layers));

    for (const std::vector<compositor::Control>& controls :
         {std::vector{gain("indirect", 2)}, std::vector{gain("indirect", 2), gain("direct", -3)}}) {
        Look look;
        look.controls = controls;
        const image::Image truth = mixed(reference, look);
        // The reference has noise of its own, which both errors contain
        const double rest = noise_of(reference, look);
        const double before = error(mixed(noisy, look), truth) - rest,
                     after = error(mixed(*clean, look), truth) - rest;
        std::printf("%s: relMSE %.2e before, %.2e after (reference %.1e): %.1f times better\n",
                    GetParam(), before, after, rest, before / after);
        EXPECT_LT(rest, 0.7 * (after + rest));
        EXPECT_GT(before, 3 * after);
    }
}

INSTANTIATE_TEST_SUITE_P(
    Scenes,
    DenoiseOfMixes,
    testing::Values("cornell/cornell", "transport/gloss", "transport/lens", "transport/window"),
    name_of);

}  // namespace

}  // namespace velatura::test
