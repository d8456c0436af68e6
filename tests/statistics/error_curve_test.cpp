// SPDX-License-Identifier: Apache-2.0
// Curves of known slope: what is read off them, and where they are said to arrive.
#include "statistics/error_curve.h"

#include "statistics/image_change.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

namespace velatura::test {

namespace {

using statistics::ErrorCurve;
using statistics::ErrorForecast;
using statistics::ErrorObservation;

/// An observation of an image of uniform samples, known to within `deviation`.
ErrorObservation seen(uint64_t samples, double error, double deviation = 1e-4) {
    ErrorObservation o;
    o.samples_min = o.samples_max = samples;
    o.samples_mean = double(samples);
    o.time_s = 3 + 0.5 * double(samples);
    o.change = {error, error * std::exp(-1.96 * deviation), error * std::exp(1.96 * deviation)};
    return o;
}

/// Doublings up to `last` of an image whose error is `level` at one sample.
ErrorCurve curve_of(double level, double slope, uint64_t last) {
    ErrorCurve curve;
    for (uint64_t n = 2; n <= last; n *= 2) {
        const double error = level * std::pow(double(n), -slope),
                     before = level * std::pow(double(n) / 2, -slope);
        curve.add(seen(n, std::sqrt(before * before - error * error)));
    }
    return curve;
}

}  // namespace

TEST(ErrorCurve, ReadsSlopesAndErrorsOffChanges) {
    for (const double slope : {0.45, 0.5, 0.55, 0.65, 0.75, 0.9}) {
        constexpr double level = 0.05;
        const ErrorCurve curve = curve_of(level, slope, 64);
        EXPECT_NEAR(curve.slope().value, slope, 0.02);
        EXPECT_LT(curve.slope().deviation, 0.02);
        const auto points = curve.points();
        ASSERT_EQ(points.size(), 6u);
        for (const statistics::ErrorPoint& p : points) {
            const double error = level * std::pow(p.samples_mean, -slope);
            EXPECT_NEAR(p.error.value, error, 0.035 * error) << slope;
            EXPECT_LE(p.error.low, error);
            EXPECT_GE(p.error.high, error);
        }
        for (const double factor : {1.5, 2.0, 4.0, 7.5}) {
            const ErrorForecast f = curve.forecast(level * std::pow(64 * factor, -slope));
            ASSERT_EQ(f.kind, ErrorForecast::Kind::Known);
            // The slopes of other images have a say
            EXPECT_NEAR(f.samples, 64 * factor, 0.14 * 64 * factor) << slope;
            EXPECT_LE(f.samples_low, 64 * factor);
            EXPECT_GE(f.samples_high, 64 * factor);
            EXPECT_NEAR(f.time_s, 3 + 0.5 * f.samples, 1e-9 * f.time_s);
            EXPECT_NEAR(f.time_high_s, 3 + 0.5 * f.samples_high, 1e-9 * f.time_s);
        }
    }
}

TEST(ErrorCurve, SaysWhereItsKnowledgeEnds) {
    const ErrorCurve curve = curve_of(0.08, 0.5, 64);
    EXPECT_EQ(curve.forecast(0.0101).kind, ErrorForecast::Kind::Reached);
    EXPECT_EQ(curve.forecast(0.01 / 2.7).kind, ErrorForecast::Kind::Known);
    EXPECT_EQ(curve.forecast(0.01 / 3.3).kind, ErrorForecast::Kind::TooFar);
    // One observation alone: slopes as they usually are, and that is uncertain
    const ErrorCurve first = curve_of(0.08, 0.5, 2);
    EXPECT_GT(first.slope().deviation, 0.02);
    const ErrorForecast f = first.forecast(0.04);
    EXPECT_NEAR(f.samples, 4, 0.6);
    EXPECT_LT(f.samples_low, 4);
    EXPECT_GT(f.samples_high, 4);
}

/// Light that a pixel meets once in thousands of samples: each doubling finds as much new noise as
/// it averages away.
TEST(ErrorCurve, ErrorsThatDoNotFallAreNotForecast) {
    ErrorCurve curve;
    for (uint64_t n = 2; n <= 64; n *= 2) curve.add(seen(n, 0.2, 0.05));
    EXPECT_TRUE(curve.is_rare());
    for (const double target : {0.5, 0.1, 0.01})
        EXPECT_EQ(curve.forecast(target).kind, ErrorForecast::Kind::Rare);
    EXPECT_FALSE(curve_of(0.08, 0.45, 64).is_rare());
    EXPECT_FALSE(ErrorCurve().is_rare());
}

/// What few pixels hold is met too rarely to be known: the error is more than it says, by a factor
/// that stays as samples grow, so that a target needs more than the line says.
TEST(ErrorCurve, OfALowerBoundTheForecastIsOneToo) {
    ErrorCurve sure, bound;
    for (uint64_t n = 2; n <= 64; n *= 2) {
        ErrorObservation o = seen(n, 0.4 / std::sqrt(double(n)));
        sure.add(o);
        o.change.is_lower = n == 64;
        bound.add(o);
    }
    for (const double target : {0.5, 0.03, 0.001}) {
        const ErrorForecast a = sure.forecast(target), b = bound.forecast(target);
        EXPECT_FALSE(a.is_lower);
        EXPECT_TRUE(b.is_lower);
        EXPECT_EQ(a.kind, b.kind);
        EXPECT_EQ(a.samples, b.samples);
    }
}

TEST(ErrorCurve, ImagesWithoutNoiseHaveNoCurve) {
    ErrorCurve curve;
    curve.add(seen(2, 0));
    EXPECT_TRUE(curve.is_empty());
}

TEST(ErrorCurve, BetweenPowersOfTwoTheErrorFallsAsThatOfIndependentSamples) {
    const ErrorCurve curve = curve_of(0.08, 0.75, 64);
    const double last = curve.points().back().error.value;
    EXPECT_NEAR(curve.error_at(64).value, last, 1e-12);
    EXPECT_NEAR(curve.error_at(96).value, last * std::sqrt(64.0 / 96.0), 1e-9);
}

/// What places samples lowers the error at once; that is no slope.
TEST(ErrorCurve, OtherPlacementOfSamplesIsNoSlope) {
    ErrorCurve curve;
    const auto add = [&](uint64_t n, double factor, uint64_t min, uint64_t max) {
        ErrorObservation o = seen(n, factor * 0.08 / std::sqrt(double(n)));
        o.samples_min = min;
        o.samples_max = max;
        curve.add(o);
    };
    for (const uint64_t n : {2, 4, 8, 16}) add(n, 1, n, n);
    // Pixels that get little wait at 16 samples for a while
    for (const uint64_t n : {32, 64, 128}) add(n, 0.5, std::max<uint64_t>(16, n / 4), 8 * n);
    EXPECT_NEAR(curve.slope().value, 0.5, 0.01);
}

/// Made-up renders whose errors scatter as much as they say: intervals of forecasts hold the truth
/// as often as they claim.
TEST(ErrorCurve, IntervalsOfForecastsHoldTheTruth) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    constexpr int renders = 2000;
    int inside = 0, known = 0;
    for (int i = 0; i < renders; ++i) {
        const double slope = statistics::usual_slope +
                             statistics::usual_slope_deviation * normal(random),
                     deviation = 0.04;
        const auto error_at = [&](double n) { return 0.05 * std::pow(n, -slope); };
        ErrorCurve curve;
        for (uint64_t n = 2; n <= 64; n *= 2) {
            const double error = error_at(double(n)), before = error_at(0.5 * double(n));
            curve.add(seen(
                n,
                std::sqrt(before * before - error * error) * std::exp(deviation * normal(random)),
                deviation));
        }
        const ErrorForecast f = curve.forecast(error_at(256));
        if (f.kind != ErrorForecast::Kind::Known) continue;
        ++known;
        inside += f.samples_low <= 256 && 256 <= f.samples_high;
    }
    std::printf("inside the 95 %% interval: %d of %d\n", inside, known);
    EXPECT_GT(known, renders * 9 / 10);
    EXPECT_GT(inside, known * 93 / 100);
    EXPECT_LT(inside, known * 99 / 100);
}

}  // namespace velatura::test
