// SPDX-License-Identifier: Apache-2.0
// What a render says of its error, and of the samples that a smaller one needs, against what many renders show.
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "image/pixel_means.h"
#include "image/relative_error.h"
#include "transport/transport_scene.h"

namespace velatura::test {

namespace {

using integrator::ErrorForecast;

constexpr int width = 64, height = 48;
constexpr uint64_t seeds = 5, few = 64, many = 256;

/// √relMSE of one of several renders of a picture, by their spread.
double error_of(const std::vector<Pixels>& renders) {
    const Pixels mean = mean_of(renders);
    const auto n = double(renders.size());
    double sum = 0;
    for (size_t i = 0; i < mean.size(); ++i) {
        double variance = 0;
        for (const Pixels& r : renders) variance += (r[i] - mean[i]) * (r[i] - mean[i]) / (n - 1);
        sum += variance / (std::max(0.0, mean[i] * mean[i] - variance / n) + 0.01) / double(mean.size());
    }
    return std::sqrt(sum);
}

/// Where samples are spread evenly, and where noise places them.
class ErrorOfScenes : public testing::TestWithParam<std::tuple<const char*, bool>> {};

TEST_P(ErrorOfScenes, IsAsForetold) {
    const auto [name, is_adaptive] = GetParam();
    const scene::Scene scene = load_scene(name, width, height);
    TransportRenderer renderer(scene, default_technique());
    const TransportRenderer::Placement placement = {is_adaptive, integrator::Guiding::Off, false};
    std::vector<Pixels> early, late;
    std::vector<integrator::ErrorCurve> curves;
    for (uint64_t seed = 0; seed < seeds; ++seed) {
        early.push_back(renderer.render_scheduled(seed, few, placement));
        curves.push_back(renderer.curve());
        late.push_back(renderer.render_scheduled(seed, many, placement));
    }
    const double found = error_of(early), target = error_of(late), samples_late = renderer.curve().points().back().samples_mean;
    double stated = 0, logarithm = 0;
    int inside = 0;
    for (const integrator::ErrorCurve& curve : curves) {
        const integrator::ErrorPoint last = curve.points().back();
        stated += last.error.value / double(seeds);
        const ErrorForecast f = curve.forecast(target);
        ASSERT_NE(f.kind, ErrorForecast::Kind::Reached);
        if (f.kind == ErrorForecast::Kind::TooFar) continue;
        logarithm += std::log(f.samples / samples_late) / double(seeds);
        inside += f.samples_low <= samples_late && samples_late <= f.samples_high;
    }
    const integrator::ErrorSlope slope = curves[0].slope();
    std::printf("%s%s: error %.4f, stated %.4f (%+.1f %%), slope %.3f +- %.3f; error %.4f at %.0f spp, forecast at %.0f spp (%+.1f %%), inside %d of %d\n", name, is_adaptive ? ", adaptive" : "", found, stated,
                100 * (stated / found - 1), slope.value, slope.deviation, target, samples_late, samples_late * std::exp(logarithm), 100 * (std::exp(logarithm) - 1), inside, int(seeds));
    // What five renders of this size show of the error is itself no better known than to a tenth, and the samples go with its square
    EXPECT_NEAR(stated / found, 1, 0.2);
    EXPECT_NEAR(std::exp(logarithm), 1, 0.4);
    EXPECT_GE(inside, 3);
}

/// What the halves of a render say of 8×8 pixels.
struct Block {
    double mean = 0, square = 0;  ///< of the mean: the squared standard error
    double fourth = 0;            ///< sum of the squares of what its pixels add to that

    /// 95 % of Student's distribution. A pixel of two halves has one degree of freedom; Satterthwaite 1946 joins unequal ones, with
    /// E (σ² χ²)² = 3 σ⁴. Quantile: Abramowitz & Stegun 26.7.5, two terms.
    double quantile() const {
        if (fourth == 0) return 12.71;
        const double freedom = square * square / (fourth / 3);
        return 1.96 + 2.37 / freedom + 2.82 / (freedom * freedom);
    }
};

std::vector<Block> blocks_of(const film::Film& film) {
    constexpr int size = 8;
    std::vector<Block> blocks;
    for (int y0 = 0; y0 < height; y0 += size) {
        for (int x0 = 0; x0 < width; x0 += size) {
            Block rgb[3];
            for (int i = 0; i < size * size; ++i) {
                const image::PixelHalves h = image::resolve_halves(film.sums(), x0 + i % size, y0 + i / size, image::AccumulatorTable::beauty);
                for (size_t c = 0; c < 3; ++c) {
                    rgb[c].mean += h.mean[c] / (size * size);
                    const double square = h.variance[c] / (size * size * size * size);
                    rgb[c].square += square;
                    rgb[c].fourth += square * square;
                }
            }
            blocks.insert(blocks.end(), std::begin(rgb), std::end(rgb));
        }
    }
    return blocks;
}

class CoverageOfScenes : public testing::TestWithParam<const char*> {};

/// Samples placed by noise, two independent Sobol' sequences: 95 % intervals against the mean of all other renders.
TEST_P(CoverageOfScenes, IntervalsOfBlocksHoldTheTruth) {
    constexpr uint64_t runs = 24;
    const scene::Scene scene = load_scene(GetParam(), width, height);
    TransportRenderer renderer(scene, default_technique());
    film::LayerSet layers = renderer.beauty_layers();
    layers.halves = true;
    std::vector<std::vector<Block>> renders;
    for (uint64_t seed = 0; seed < runs; ++seed) renders.push_back(blocks_of(renderer.render_film(seed, few, {true, integrator::Guiding::Off, false}, layers)));
    int inside = 0, count = 0;
    for (size_t b = 0; b < renders[0].size(); ++b) {
        Block all;
        for (const auto& r : renders) {
            all.mean += r[b].mean / double(runs);
            all.square += r[b].square / double(runs);
        }
        if (all.square == 0) continue;
        for (const auto& r : renders) {
            const double others = (all.mean * double(runs) - r[b].mean) / double(runs - 1);
            const double square = r[b].square + (all.square * double(runs) - r[b].square) / double((runs - 1) * (runs - 1));
            inside += std::abs(r[b].mean - others) <= r[b].quantile() * std::sqrt(square);
            ++count;
        }
    }
    const double share = double(inside) / double(count);
    std::printf("%s: %.1f %% of %d intervals hold the truth\n", GetParam(), 100 * share, count);
    EXPECT_GT(share, 0.89);
    EXPECT_LT(share, 0.985);
}

const auto scenes = testing::Values("cornell/cornell", "transport/window", "transport/sheets", "transport/gloss");

INSTANTIATE_TEST_SUITE_P(Scenes, ErrorOfScenes, testing::Combine(scenes, testing::Bool()));
INSTANTIATE_TEST_SUITE_P(Scenes, CoverageOfScenes, scenes);

}  // namespace

}  // namespace velatura::test
