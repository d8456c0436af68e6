// SPDX-License-Identifier: Apache-2.0
// A lamp that one sample in a hundred meets: 16 pilot samples miss it with probability 0.85. A
// pixel that stopped for it would be too dark, one that went on for it as well (H46). Where samples
// are placed by noise, means stay all the same.
#include "accumulate/pixel_means.h"
#include "base/hash.h"
#include "hard_case.h"
#include "integrator/path_tracer.h"
#include "integrator/sample_placement.h"
#include "integrator/schedule.h"
#include "integrator/world.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::test {

namespace {

using integrator::pilot_samples;
using integrator::PilotNoise;
using integrator::SampleRates;

constexpr double chance = 0.01;
constexpr double bound = 0.01;  ///< of the truth

// A number in [0, 1) of one sample.
double number(uint64_t seed, int x, int y, uint64_t sample) {
    uint64_t h = hash_combine(seed, uint64_t(x));
    h = hash_combine(hash_combine(h, uint64_t(y)), sample);
    return double(h >> 11) * 0x1p-53;
}

class Mean {
  public:
    void add(double value) {
        ++count_;
        sum_ += value;
        square_ += value * value;
    }

    double value() const { return sum_ / count_; }

    double error() const {
        return std::sqrt(std::max(0.0, square_ / count_ - value() * value()) / (count_ - 1));
    }

    /// The smallest deviation that a test at 99 % would see with 90 % power.
    double detectable() const { return (2.58 + 1.28) * error(); }

  private:
    double sum_ = 0, square_ = 0, count_ = 0;
};

/// An image some of whose pixels meet the lamp, which has a mean of 1 there.
struct RareLamp {
    const char* name;
    int side;
    bool (*sees)(int x,
                 int y);  ///< the pixels that can meet the lamp; only their means are looked at
    double (*noise)(int x, int y, double u);  ///< other light of a sample
    double other;                             ///< mean of that where the lamp is
    double p = chance;

    double value(uint64_t seed, int x, int y, uint64_t s) const {
        const double lamp = sees(x, y) && number(2 * seed, x, y, s) < p ? 1 / p : 0.0;
        return lamp + noise(x, y, number(2 * seed + 1, x, y, s));
    }

    double mean(uint64_t seed, int x, int y, uint64_t samples) const {
        double sum = 0;
        for (uint64_t s = 0; s < samples; ++s) sum += value(seed, x, y, s);
        return sum / double(samples);
    }
};

SampleRates rates_of(const RareLamp& lamp, uint64_t seed) {
    PilotNoise noise({0, 0, lamp.side, lamp.side});
    for (int y = 0; y < lamp.side; ++y) {
        for (int x = 0; x < lamp.side; ++x) {
            for (uint64_t s = 0; s < pilot_samples; ++s)
                noise.add(x, y, Rgb(float(lamp.value(seed, x, y, s))), 3);
        }
    }
    return SampleRates(noise);
}

/// The rule that is not used: a pixel goes on only if its own pilot is noisy.
uint64_t naive_count(const RareLamp& lamp, uint64_t seed, int x, int y, uint64_t samples) {
    double sum = 0, square = 0;
    for (uint64_t s = 0; s < pilot_samples; ++s) {
        const double v = lamp.value(seed, x, y, s);
        sum += v;
        square += v * v;
    }
    const double n = double(pilot_samples), variance = (square - sum * sum / n) / (n - 1) / n;
    return std::sqrt(variance) > 0.5 * sum / n ? samples : pilot_samples;
}

void expect_no_bias(const RareLamp& lamp, uint64_t samples, int seeds) {
    const double truth = 1 + lamp.other;
    Mean placed, fixed, naive;
    uint64_t min = ~uint64_t(0), max = 0;
    for (uint64_t seed = 0; seed < uint64_t(seeds); ++seed) {
        const SampleRates rates = rates_of(lamp, seed);
        Mean by_placed, by_fixed, by_naive;
        for (int y = 0; y < lamp.side; ++y) {
            for (int x = 0; x < lamp.side; ++x) {
                if (!lamp.sees(x, y)) continue;
                const uint64_t count = rates.count(x, y, samples);
                min = std::min(min, count);
                max = std::max(max, count);
                by_placed.add(lamp.mean(seed, x, y, count));
                by_fixed.add(lamp.mean(seed, x, y, samples));
                by_naive.add(lamp.mean(seed, x, y, naive_count(lamp, seed, x, y, samples)));
            }
        }
        placed.add(by_placed.value());
        fixed.add(by_fixed.value());
        naive.add(by_naive.value());
    }
    fmt::print(
        "{}: {} to {} samples; off by {:+.3f} % (detectable {:.3f} %), fixed {:+.3f} %, by own "
        "noise {:+.1f} %\n",
        lamp.name, min, max, 100 * (placed.value() / truth - 1), 100 * placed.detectable() / truth,
        100 * (fixed.value() / truth - 1), 100 * (naive.value() / truth - 1));
    hardcase::expect_within(
        {fmt::format("a lamp of probability {}, {}: mean of placed samples, relative", lamp.p,
                     lamp.name),
         std::abs(placed.value() / truth - 1), bound, placed.detectable() / truth, "closed form"});
    EXPECT_NEAR(placed.value(), truth, 2.58 * placed.error());
    EXPECT_NEAR(fixed.value(), truth, 2.58 * fixed.error());
    EXPECT_NEAR(placed.value(), fixed.value(), 2.58 * std::hypot(placed.error(), fixed.error()));
    // The test of the test
    EXPECT_GT(std::abs(naive.value() / truth - 1), 5 * bound);
    EXPECT_GT(std::abs(naive.value() - truth), 10 * naive.error());
}

double none(int, int, double) {
    return 0;
}

double one(int, int, double) {
    return 1;
}

}  // namespace

TEST(H46RareLamps, ALampEverywhere) {
    expect_no_bias({"alone", 48, [](int, int) { return true; }, none, 0}, 64, 240);
    expect_no_bias({"on gray", 48, [](int, int) { return true; }, one, 1}, 64, 60);
}

// Hardly any neighborhood meets the lamp in its pilot
TEST(H46RareLamps, ALampThatWholeNeighborhoodsMiss) {
    expect_no_bias({"missed", 64, [](int, int) { return true; }, one, 1, 0.001}, 64, 600);
}

// Other light with noise on the left decides how many samples those on the right get
TEST(H46RareLamps, ALampBesideOtherNoise) {
    const auto right = [](int x, int) { return x >= 24; };
    expect_no_bias(
        {"beside noise", 48, right, [](int x, int, double u) { return x < 24 ? 2 * u : 1.0; }, 1},
        64, 120);
}

// No neighbor that reacts to a pixel's samples meets the lamp, and the other way round
TEST(H46RareLamps, PixelsThatAreAlone) {
    expect_no_bias({"isolated", 40, [](int x, int y) { return x % 5 == 2 && y % 5 == 2; }, one, 1},
                   256, 1400);
}

TEST(H46RareLamps, TheBorderOfTheImage) {
    const auto border = [](int x, int y) { return x == 0 || y == 0 || x == 39 || y == 39; };
    expect_no_bias({"border", 40, border, one, 1}, 128, 500);
}

TEST(H46RareLamps, ALoneBrightRegion) {
    const auto region = [](int x, int y) { return x >= 20 && x < 26 && y >= 9 && y < 15; };
    expect_no_bias({"region in the dark", 40, region, none, 0}, 128, 600);
    expect_no_bias({"region on noise", 40, region,
                    [](int x, int y, double u) { return x + y < 35 ? 1.0 : 2 * u; }, 1},
                   128, 1200);
}

// If one unit held for all rates, reckoned from all pixels, those that met the lamp would get fewer
// samples by it: 1 % too bright with 8×8 pixels, 8 % with 4×4
TEST(H46RareLamps, ASmallImage) {
    expect_no_bias({"4 x 4", 4, [](int, int) { return true; }, one, 1}, 64, 6000);
    expect_no_bias({"8 x 8", 8, [](int, int) { return true; }, one, 1}, 64, 4000);
    expect_no_bias({"16 x 16", 16, [](int, int) { return true; }, one, 1}, 64, 1000);
}

namespace {

/// A matte floor of albedo 1/2 below a sky of radiance 4 and a lamp of 400, which fills 1 % of what
/// the floor sees by the cosine: straight above, (radius / height)². The camera sees so little of
/// it that this holds to 2e-4 everywhere.
constexpr const char* floor_and_lamp = R"usda(#usda 1.0
(
    upAxis = "Y"
)
def Camera "Cam"
{
    float focalLength = 50
    float horizontalAperture = 1
    float verticalAperture = 1
    float2 clippingRange = (0, 0)
    double3 xformOp:translate = (0, 0.5, 0)
    float xformOp:rotateX = -90
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
}
def Mesh "Floor"
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3)]
    uniform token subdivisionScheme = "none"
    color3f[] primvars:displayColor = [(0.5, 0.5, 0.5)]
}
def SphereLight "Lamp"
{
    float inputs:intensity = 400
    float inputs:radius = 0.1
    double3 xformOp:translate = (0, 1, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "Sky"
{
    float inputs:intensity = 4
}
)usda";

/// Mean of the image, and how unlike the counts of its pixels are.
struct Rendered {
    double mean = 0;
    uint64_t min = 0, max = 0;
};

Rendered render_by_bsdf(const integrator::World& world,
                        const film::LayerSet& layers,
                        uint64_t seed,
                        bool is_adaptive) {
    constexpr int side = 32;
    const integrator::PathTracer tracer(
        world, layers,
        {.seed = seed,
         .max_depth = 1,
         .estimator = {.light_sampling = integrator::LightSampling::Bsdf}});
    integrator::RenderOptions options;
    options.mode = integrator::RenderMode::Tile;
    options.end_sample = 64;
    options.adaptive = is_adaptive;
    film::Film film({0, 0, side, side}, layers);
    integrator::run_schedule(
        film, options,
        [&](int x, int y, uint64_t s, film::SampleRadiance& out, integrator::RayCounts& counts) {
            tracer.trace(x, y, s, out, counts);
        },
        {});
    const std::vector<float> rgba = accumulate::resolve_rgba(film.sums());
    const film::NoiseEstimate noise = film.noise();
    Rendered r{0, noise.samples_min, noise.samples_max};
    for (size_t i = 0; i < rgba.size(); i += 4) r.mean += double(rgba[i]) / (side * side);
    return r;
}

}  // namespace

// The same by the path tracer: a lamp that is found by nothing but chance, and its closed form
TEST(H46RareLamps, ALampThatPathsMeetByChance) {
    scene::Scene scene = scene_from_usda(floor_and_lamp, 32, 32);
    Diagnostics diagnostics;
    const integrator::World world(scene, {.width = 32, .height = 32, .compensate_mis = false}, {},
                                  diagnostics);
    film::LayerSet layers;
    layers.matrix_layers = layers.shadow_layers = layers.bounce_layers = layers.group_layers =
        layers.data_layers = false;
    for (const scene::LightGroup& g : scene.groups)
        layers.groups.push_back({g.name, g.prims, g.is_environment});
    Mean placed, fixed;
    constexpr double truth = 0.5 * (4 + 400 * chance);
    Rendered last;
    for (uint64_t seed = 0; seed < 90; ++seed) {
        last = render_by_bsdf(world, layers, seed, true);
        placed.add(last.mean);
        if (seed < 30) fixed.add(render_by_bsdf(world, layers, seed, false).mean);
    }
    fmt::print(
        "{} to {} samples; off by {:+.3f} % (detectable {:.3f} %), fixed {:+.3f} % ({:.3f} %)\n",
        last.min, last.max, 100 * (placed.value() / truth - 1), 100 * placed.detectable() / truth,
        100 * (fixed.value() / truth - 1), 100 * fixed.detectable() / truth);
    EXPECT_GT(last.max, 2 * last.min);
    hardcase::expect_within({"a lamp that paths meet by chance: mean of placed samples, relative",
                             std::abs(placed.value() / truth - 1), bound,
                             placed.detectable() / truth, "closed form"});
    EXPECT_NEAR(placed.value(), truth, 2.58 * placed.error());
    EXPECT_NEAR(fixed.value(), truth, 2.58 * fixed.error());
}

}  // namespace velatura::test
