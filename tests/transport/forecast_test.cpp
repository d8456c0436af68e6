// SPDX-License-Identifier: Apache-2.0
// What `velatura-comp noise` forecasts of a mix, from one render, against what many renders show.
#include "base/hash.h"
#include "compositor/noise/noise.h"
#include "transport/mixes.h"
#include "transport/transport_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

namespace velatura::test {

namespace {

using compositor::LayerStack;
using compositor::Look;
using compositor::noise::MixError;

constexpr int size_px = 24;  ///< images are size_px × size_px
constexpr size_t mix_count = 20;
const TransportRenderer::Placement even = {false, integrator::Guiding::Off, false};

/// Up to two stops up or down on every group and every bounce.
Look random_look(uint64_t number, const LayerStack& stack) {
    Look look;
    uint64_t key = mix64(number + 1);
    for (const auto& names : {stack.group_names(), stack.column_names()}) {
        for (const std::string& name : names) {
            key = mix64(key);
            look.controls.push_back(gain(name, 4.0 * double(key >> 40) * 0x1p-24 - 2.0));
        }
    }
    return look;
}

MixError mix_of(const LayerStack& stack, const Look& look) {
    auto mix = compositor::noise::mix_error(stack, *compositor::mix::plan_mix(stack, look), look);
    EXPECT_TRUE(mix.has_value());
    return std::move(*mix);
}

/// Of a mix over many renders.
class Spread {
  public:
    void add(const MixError& mix) {
        if (sum_.empty()) sum_.resize(3 * mix.share.size()), square_ = sum_;
        for (size_t c = 0; c < 3; ++c) {
            for (size_t i = 0; i < mix.share.size(); ++i) {
                const double v = double(mix.mean[c][i]);
                sum_[3 * i + c] += v;
                square_[3 * i + c] += v * v;
                forecast_variance_ += mix.variance(c, i);
                forecast_relative_ += mix.relative_square(c, i) / double(3 * mix.share.size());
            }
        }
        ++runs_;
    }

    /// Sums over pixels of the variance of one render: forecast, in the mean, and found.
    double forecast_variance() const { return forecast_variance_ / runs_; }

    double found_variance() const {
        double result = 0;
        for (size_t k = 0; k < sum_.size(); ++k)
            result += (square_[k] - sum_[k] * sum_[k] / runs_) / (runs_ - 1);
        return result;
    }

    /// √relMSE of one render.
    double forecast_error() const { return std::sqrt(forecast_relative_ / runs_); }

  private:
    std::vector<double> sum_, square_;
    double forecast_variance_ = 0, forecast_relative_ = 0, runs_ = 0;
};

class Forecast : public testing::TestWithParam<const char*> {
  protected:
    Forecast()
        : scene_(load_scene(GetParam(), size_px, size_px)), renderer_(scene_, default_technique()) {
        layers_ = renderer_.beauty_layers();
        layers_.matrix_layers = layers_.halves = true;
        layers_.last_bounce = 3;
    }

    LayerStack render(uint64_t seed, uint64_t samples) {
        return through_file(renderer_.render_film(seed, samples, even, layers_));
    }

    scene::Scene scene_;
    TransportRenderer renderer_;
    film::LayerSet layers_;
};

using ForecastOfMixes = Forecast;
using ForecastOfSamples = Forecast;

/// The forecast is an estimate of the variance for every mix, whatever its layers have in common.
TEST_P(ForecastOfMixes, AgreesWithTheSpreadOfRenders) {
    constexpr uint64_t runs = 64, samples = 16;
    std::vector<Spread> spreads(mix_count);
    for (uint64_t run = 0; run < runs; ++run) {
        const LayerStack stack = render(run, samples);
        for (size_t m = 0; m < mix_count; ++m) spreads[m].add(mix_of(stack, random_look(m, stack)));
    }
    double mean = 0, min = 1e30, max = 0;
    for (const Spread& s : spreads) {
        const double ratio = std::sqrt(s.forecast_variance() / s.found_variance());
        mean += ratio / double(mix_count);
        min = std::min(min, ratio);
        max = std::max(max, ratio);
    }
    std::printf("%s: forecast over found %.3f (%.3f to %.3f)\n", GetParam(), mean, min, max);
    EXPECT_NEAR(mean, 1.0, 0.1);
    EXPECT_NEAR(min, 1.0, 0.2);
    EXPECT_NEAR(max, 1.0, 0.2);
}

/// As many times the samples bring the lifted mix back to the error that the render had.
TEST_P(ForecastOfSamples, HoldTheError) {
    constexpr uint64_t runs = 16, samples = 64;
    Look lifted;
    lifted.controls.push_back(gain("indirect", 2));
    Spread rendered, mixed, advised;
    for (uint64_t run = 0; run < runs; ++run) {
        const LayerStack stack = render(run, samples);
        rendered.add(mix_of(stack, {}));
        mixed.add(mix_of(stack, lifted));
    }
    const double ratio = mixed.forecast_error() / rendered.forecast_error();
    ASSERT_GT(ratio, 1.05);
    const auto more = uint64_t(std::ceil(double(samples) * ratio * ratio));
    for (uint64_t run = 0; run < runs; ++run) advised.add(mix_of(render(runs + run, more), lifted));
    const double reached = advised.forecast_error() / rendered.forecast_error();
    std::printf(
        "%s: error %.4f, with indirect light two stops up %.4f; %.2f times the samples: %.3f of "
        "the first\n",
        GetParam(), rendered.forecast_error(), mixed.forecast_error(),
        double(more) / double(samples), reached);
    EXPECT_NEAR(reached, 1.0, 0.15);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes,
    ForecastOfMixes,
    testing::Values("cornell/cornell", "transport/sun", "transport/gloss", "transport/linked"),
    name_of);
INSTANTIATE_TEST_SUITE_P(Scenes,
                         ForecastOfSamples,
                         testing::Values("cornell/cornell",
                                         "transport/lens",
                                         "transport/gloss",
                                         "transport/window",
                                         "transport/sheets"),
                         name_of);

}  // namespace

}  // namespace velatura::test
