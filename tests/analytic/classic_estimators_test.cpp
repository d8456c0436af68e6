// SPDX-License-Identifier: Apache-2.0
// The classic estimators against each other and against what theory says of each: means by closed
// form, variances of single samples by quadrature, slopes of the error.
#include "hard_case.h"
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace velatura::test {

namespace {

using integrator::LightSampling;
using integrator::Roulette;
using lights::SelectionKind;
using sampling::SamplerKind;

constexpr double albedo = 0.6;

/// A square lamp of radiance 1 that looks down on a point of the floor at z = −1 below the camera.
struct Lamp {
    Vec3d center;
    double half = 0;

    double area() const { return 4 * half * half; }
};

/// What quadrature over lamps says of one sample at the point (0, 0, −1): second moments by the
/// density that it has.
struct Theory {
    double mean = 0;
    double hemisphere = 0, cosine = 0, area = 0, solid_angle = 0;
    double mis = 0, mean_by_light = 0, mean_by_bsdf = 0;

    double variance(double second_moment) const { return second_moment - mean * mean; }

    /// Two samples, each with its own mean.
    double mis_variance() const {
        return mis - mean_by_light * mean_by_light - mean_by_bsdf * mean_by_bsdf;
    }
};

/// share: of the samples that choose the lamp.
void add_lamp(Theory& theory, const Lamp& lamp, double share) {
    constexpr int steps = 512;
    const double cell = lamp.area() / (steps * steps);
    const auto for_each_point = [&](auto visit) {
        for (int i = 0; i < steps * steps; ++i) {
            const Vec3d d =
                lamp.center + Vec3d(2 * lamp.half * ((i % steps + 0.5) / steps - 0.5),
                                    2 * lamp.half * ((i / steps + 0.5) / steps - 0.5), 1.0);
            const double squared = d.dot(d), cosine = d.z / std::sqrt(squared);
            visit(cosine, squared, cell * cosine / squared);
        }
    };
    double omega = 0;
    for_each_point([&](double, double, double solid_angle) { omega += solid_angle; });
    for_each_point([&](double cosine, double squared, double solid_angle) {
        const double f = albedo / pi_d * cosine, by_cosine = cosine / pi_d,
                     by_light = share / omega;
        theory.mean += f * solid_angle;
        theory.hemisphere += f * f * 2 * pi_d * solid_angle;
        theory.cosine += f * f / by_cosine * solid_angle;
        theory.area += f * f / (share * squared / (cosine * lamp.area())) * solid_angle;
        theory.solid_angle += f * f / by_light * solid_angle;
        // The power heuristic
        const double light_weight =
                         by_light * by_light / (by_light * by_light + by_cosine * by_cosine),
                     bsdf_weight = 1 - light_weight;
        theory.mis +=
            f * f *
            (light_weight * light_weight / by_light + bsdf_weight * bsdf_weight / by_cosine) *
            solid_angle;
        theory.mean_by_light += f * light_weight * solid_angle;
        theory.mean_by_bsdf += f * bsdf_weight * solid_angle;
    });
}

TestScene lamps_over_floor(const std::vector<Lamp>& lamps) {
    TestScene test;
    test.add_square(-1.0f, 50.0f, test.add_matte(Rgb(float(albedo))));
    for (const Lamp& lamp : lamps) {
        scene::Light& light = test.add_light(scene::LightKind::Rect, at(lamp.center));
        light.width = light.height = float(2 * lamp.half);
        light.Le = Rgb(1.0f);
    }
    return test;
}

struct Way {
    const char* name;
    LightSampling sampling = LightSampling::Light;
    bool by_area = false;
    SelectionKind selection = SelectionKind::Tree;
};

constexpr int size_px = 64;
constexpr uint64_t sample_count = 64;

/// Direct light by independent samples.
Estimate direct(const TestScene& test, const Way& way) {
    TestRenderOptions options{.size = size_px,
                              .samples = sample_count,
                              .max_depth = 1,
                              .estimator = {.light_sampling = way.sampling}};
    options.light_selection = way.selection;
    options.samples_light_area = way.by_area;
    options.sampler = SamplerKind::Independent;
    return render(test, options).bounce(1);
}

/// Of one sample; the relative standard error of this is sqrt(2 / pixels) = 2.2 %, more where
/// values are rare.
double sample_variance(const Estimate& e) {
    return e.standard_error * e.standard_error * size_px * size_px * double(sample_count);
}

/// Expects mean and variance to be what theory says; returns the variance.
double expect_theory(const TestScene& test, const Way& way, double mean, double variance) {
    const Estimate e = direct(test, way);
    const double measured = sample_variance(e);
    fmt::print(
        "{:24} variance of a sample {:10.4g}, by quadrature {:10.4g}; mean {:.5f}, closed {:.5f}, "
        "detectable {:.2g} of it\n",
        way.name, measured, variance, e.mean, mean, e.detectable() / mean);
    EXPECT_NEAR(e.mean, mean, 4 * e.standard_error) << way.name;
    EXPECT_LT(e.detectable(), 0.05 * mean) << way.name << " cannot be judged";
    EXPECT_NEAR(measured / variance, 1.0, 0.12) << way.name;
    return measured;
}

TEST(ClassicEstimators, OrderOnASmallLampIsWhatTheorySays) {
    const std::vector<Lamp> lamps = {{{0.25, 0, -0.85}, 0.1}};
    const TestScene test = lamps_over_floor(lamps);
    Theory t;
    add_lamp(t, lamps[0], 1.0);
    const double hemisphere = expect_theory(test, {"hemisphere", LightSampling::Hemisphere}, t.mean,
                                            t.variance(t.hemisphere));
    const double cosine = expect_theory(test, {"hemisphere by the cosine", LightSampling::Cosine},
                                        t.mean, t.variance(t.cosine));
    const double naive =
        expect_theory(test, {"naive", LightSampling::Bsdf}, t.mean, t.variance(t.cosine));
    const double area =
        expect_theory(test, {"area", LightSampling::Light, true}, t.mean, t.variance(t.area));
    const double solid_angle = expect_theory(test, {"solid angle", LightSampling::Light}, t.mean,
                                             t.variance(t.solid_angle));
    const double mis = expect_theory(test, {"MIS", LightSampling::Mis}, t.mean, t.mis_variance());
    fmt::print(
        "variance: naive {:.1f} x, hemisphere {:.1f} x, area {:.2f} x that of solid angle; MIS "
        "{:.2f} x\n",
        naive / solid_angle, hemisphere / solid_angle, area / solid_angle, mis / solid_angle);
    // Naive paths are hemisphere sampling by the cosine on matte surfaces: neither looks where the
    // lamp is
    EXPECT_NEAR(naive / cosine, 1.0, 0.15);
    EXPECT_GT(std::min(naive, hemisphere), 10 * area);
    EXPECT_GT(area, 2 * solid_angle);
    // Matte surfaces leave BSDF sampling nothing to add, and the power heuristic lets it cost
    // nothing: section 9.2.3 of Veach 1997. By the balance heuristic this was 2.7 x
    EXPECT_LT(mis, 1.1 * solid_angle);
}

TEST(ClassicEstimators, MisIsTheBestWhereNeitherSamplingIs) {
    TestScene test;
    scene::Material brushed;
    brushed.metallic = scene::Input(1.0f);
    brushed.roughness = scene::Input(0.3f);
    brushed.diffuse_color = scene::Input(Rgb(0.8f));
    test.add_square(-1.0f, 50.0f, test.add_material(brushed));
    scene::Light& light = test.add_light(scene::LightKind::Rect, at({0, 0, -0.4}));
    light.width = light.height = 0.25f;
    light.Le = Rgb(1.0f);
    const auto variance = [&](LightSampling sampling) {
        return sample_variance(direct(test, {"", sampling}));
    };
    const double solid_angle = variance(LightSampling::Light), bsdf = variance(LightSampling::Bsdf),
                 mis = variance(LightSampling::Mis);
    fmt::print(
        "brushed metal below a lamp, variance: solid angle {:.2f} x, BSDF {:.2f} x that of MIS\n",
        solid_angle / mis, bsdf / mis);
    EXPECT_LT(mis, solid_angle);
    EXPECT_LT(mis, bsdf);
}

TEST(ClassicEstimators, PointsOfAllLampsLoseToPointsOfOneWhereTheLargeOneIsFar) {
    const std::vector<Lamp> lamps = {{{0.25, 0, -0.7}, 0.1}, {{0, 3, 2}, 0.5}};
    const TestScene test = lamps_over_floor(lamps);
    const double all_area = lamps[0].area() + lamps[1].area();
    Theory by_one, by_all;
    for (const Lamp& lamp : lamps) {
        add_lamp(by_one, lamp, 0.5);
        add_lamp(by_all, lamp, lamp.area() / all_area);
    }
    const double one = expect_theory(
        test, {"area of either lamp", LightSampling::Light, true, SelectionKind::Uniform},
        by_one.mean, by_one.variance(by_one.area));
    const double all =
        expect_theory(test, {"area of all lamps", LightSampling::Light, true, SelectionKind::Area},
                      by_all.mean, by_all.variance(by_all.area));
    EXPECT_GT(all, 3 * one);
}

TEST(ClassicEstimators, EmissiveSurfacesHaveTheMeanOfTheClosedForm) {
    const Lamp lamp{{0.3, 0, -0.7}, 0.1};
    Theory t;
    add_lamp(t, lamp, 1.0);
    TestScene test = lamps_over_floor({});
    test.add_square(float(lamp.center.z), float(lamp.half), test.add_matte(Rgb(0.0f), Rgb(1.0f)));
    for (Vec3& p : std::get<scene::Mesh>(test.scene.shapes.back().geometry).points)
        p.x += float(lamp.center.x);
    for (const Way& way : {Way{"hemisphere", LightSampling::Hemisphere},
                           {"cosine", LightSampling::Cosine},
                           {"area", LightSampling::Light, true},
                           {"global area", LightSampling::Light, true, SelectionKind::Area}})
        expect_close(direct(test, way), t.mean, way.by_area ? 0.01 : 0.08, way.name);
}

constexpr int slope_size = 48;
constexpr std::array<uint64_t, 4> slope_counts = {1, 4, 16, 64};

/// Error of pixels at one number of samples, from two seeds.
double rms_error(const TestScene& test, SamplerKind sampler, uint64_t samples) {
    TestRenderOptions options{.size = slope_size,
                              .samples = samples,
                              .max_depth = 1,
                              .estimator = {.light_sampling = LightSampling::Light}};
    options.sampler = sampler;
    const RenderedLayers a = render(test, options);
    options.seed = 2;
    const RenderedLayers b = render(test, options);
    double squares = 0;
    for (int y = 0; y < options.size; ++y) {
        for (int x = 0; x < options.size; ++x) {
            const double difference =
                a.film.sums().total(x, y, accumulate::AccumulatorTable::beauty).x -
                b.film.sums().total(x, y, accumulate::AccumulatorTable::beauty).x;
            squares += difference * difference / (2 * double(samples) * double(samples));
        }
    }
    return std::sqrt(squares / (options.size * options.size));
}

/// d log error / d log samples, by least squares.
double slope(const TestScene& test, SamplerKind sampler) {
    double sum = 0, squares = 0;
    for (size_t i = 0; i < slope_counts.size(); ++i) {
        const double x = (double(i) - 1.5) * std::log(4.0);
        sum += x * std::log(rms_error(test, sampler, slope_counts[i]));
        squares += x * x;
    }
    return sum / squares;
}

/// Standard error of a slope: a root mean square of n independent differences is known to 1 /
/// sqrt(2 n) of itself.
double slope_error() {
    double squares = 0;
    for (size_t i = 0; i < slope_counts.size(); ++i)
        squares += std::pow((double(i) - 1.5) * std::log(4.0), 2.0);
    return 1 / std::sqrt(2.0 * slope_size * slope_size * squares);
}

// RMSE ~ spp^-0.5 of independent samples; strata and nets are steeper where what they integrate is
// smooth
TEST(H45Slopes, OfTheErrorOfSmoothDirectLight) {
    TestScene test = lamps_over_floor({{{0.5, 0.2, 0.2}, 0.5}});
    test.look_with_perspective(0.3);
    const double independent = slope(test, SamplerKind::Independent),
                 stratified = slope(test, SamplerKind::Stratified),
                 sobol = slope(test, SamplerKind::Sobol);
    fmt::print(
        "slopes of RMSE against samples: independent {:.3f}, stratified {:.3f}, Sobol'-Owen "
        "{:.3f}\n",
        independent, stratified, sobol);
    hardcase::expect_within({"slope of the error of independent samples, from -1/2",
                             std::abs(independent + 0.5), 0.03, 5.2816 * slope_error(),
                             "central limit theorem"});
    EXPECT_LT(stratified, -0.65);
    hardcase::expect_within(
        {fmt::format("slope of the error of Sobol' points {:.2f}: above -0.65 by", sobol),
         hardcase::larger(0.0, sobol + 0.65), 0, 0, "smooth integrand",
         fmt::format("a slope of {:.2f}", 5.2816 * slope_error() - 0.65)});
}

/// Variance of one sample over the squared mean, in the mean over pixels, from the spread of four
/// seeds.
double relative_variance(const TestScene& test, SelectionKind selection) {
    constexpr int runs = 4, size = 32;
    constexpr uint64_t samples = 16;
    std::vector<std::array<double, 2>> sums(size_t(size) * size);
    for (int run = 0; run < runs; ++run) {
        TestRenderOptions options{.size = size,
                                  .samples = samples,
                                  .max_depth = 1,
                                  .estimator = {.light_sampling = LightSampling::Light}};
        options.seed = uint64_t(run) + 1;
        options.light_selection = selection;
        options.sampler = SamplerKind::Independent;
        const RenderedLayers layers = render(test, options);
        for (int i = 0; i < size * size; ++i) {
            const double v = layers.film.sums()
                                 .total(i % size, i / size, accumulate::AccumulatorTable::beauty)
                                 .x /
                             double(samples);
            sums[size_t(i)][0] += v / runs;
            sums[size_t(i)][1] += v * v / runs;
        }
    }
    double total = 0;
    for (const auto& [mean, squares] : sums)
        total += (squares / (mean * mean) - 1) * runs / (runs - 1) * double(samples);
    return total / (size * size);
}

TEST(ClassicEstimators, SelectionAmong64UnequalLamps) {
    TestScene test = lamps_over_floor({});
    test.look_with_perspective(1.0);
    std::mt19937 random(64);
    std::uniform_real_distribution<double> unit;
    for (int i = 0; i < 64; ++i) {
        scene::Light& lamp = test.add_light(scene::LightKind::Rect,
                                            at({(i % 8 - 3.5) * 0.4, (i / 8 - 3.5) * 0.4, -0.6}));
        lamp.width = lamp.height = 0.05f;
        lamp.Le = Rgb(float(std::pow(10.0, 3.0 * unit(random))));
    }
    const double uniform = relative_variance(test, SelectionKind::Uniform),
                 power = relative_variance(test, SelectionKind::Power),
                 tree = relative_variance(test, SelectionKind::Tree);
    fmt::print(
        "64 unequal lamps, relative variance of a sample: uniform {:.3g}, power {:.3g}, tree "
        "{:.3g}: uniform needs {:.1f} x the samples of power, {:.1f} x those of the tree\n",
        uniform, power, tree, uniform / power, uniform / tree);
    EXPECT_GT(uniform, 1.5 * power);
    EXPECT_GT(power, 2 * tree);
}

TEST(H32Roulette, OfEveryKindIsUnbiasedPerBounce) {
    constexpr integrator::RouletteGains few{{0.4f, 0.6f, 0.5f, 0.8f}};
    for (const Roulette roulette : {Roulette::Albedo, Roulette::Efficiency, Roulette::Constant}) {
        TestRenderOptions options{.size = 32,
                                  .samples = 128,
                                  .last_bounce = 6,
                                  .estimator = {.light_sampling = LightSampling::Bsdf,
                                                .roulette = roulette,
                                                .roulette_start = 1},
                                  .shadow_layers = false};
        options.roulette = &few;
        const RenderedLayers layers = render(closed_room(0.5f, 0.5f), options);
        for (int k = 0; k <= 6; ++k)
            expect_close(layers.bounce(k), 0.5 * std::pow(0.5, k), 0.15,
                         fmt::format("roulette {}, bounce {}", int(roulette), k));
    }
}

TEST(ClassicEstimators, CutoffTakesAwayWhatPathsCarryBelowIt) {
    TestRenderOptions options{
        .size = 16,
        .samples = 16,
        .last_bounce = 6,
        .estimator = {
            .light_sampling = LightSampling::Bsdf, .roulette = Roulette::Cutoff, .cutoff = 0.1f}};
    const RenderedLayers layers = render(closed_room(0.5f, 0.5f), options);
    // 0.5³ = 0.125 goes on, 0.5⁴ does not
    EXPECT_NEAR(layers.bounce(3).mean, 0.5 * 0.125, 1e-4);
    EXPECT_EQ(layers.bounce(4).mean, 0.0);
}

}  // namespace

}  // namespace velatura::test
