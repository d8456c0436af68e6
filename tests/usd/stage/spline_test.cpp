// SPDX-License-Identifier: Apache-2.0
#include "stage_fixture.h"
#include "usd/stage/spline_evaluation.h"
#include "usd/stage/stage.h"

#include <gtest/gtest.h>

#include <cmath>

// Oracle: closed forms (lines, parabolas as Bezier curves, Hermite's polynomials).

namespace velatura::usd::stage {
namespace {

using layer::SplineCurve;
using layer::SplineExtrapolationMode;
using layer::SplineInterpolation;
using layer::SplineKnot;
using layer::SplineValue;

SplineKnot knot(double time, double value, SplineInterpolation next) {
    SplineKnot k;
    k.time = time;
    k.value = value;
    k.next = next;
    return k;
}

SplineValue line(SplineInterpolation next) {
    SplineValue spline;
    spline.knots = {knot(0, 0, next), knot(10, 20, next)};
    return spline;
}

double value(const SplineValue& spline, double time) {
    return evaluate_spline(spline, time).value_or(-999.0);
}

TEST(Spline, SegmentsHoldOrGoStraightOrHaveNoValue) {
    EXPECT_EQ(value(line(SplineInterpolation::Held), 9), 0);
    EXPECT_EQ(value(line(SplineInterpolation::Linear), 5), 10);
    EXPECT_EQ(value(line(SplineInterpolation::None), 5), -999);
    EXPECT_EQ(value(line(SplineInterpolation::Held), 10), 20);
    EXPECT_EQ(value(SplineValue{}, 0), -999);
}

TEST(Spline, KnotsNeedNotBeSorted) {
    SplineValue spline = line(SplineInterpolation::Linear);
    std::swap(spline.knots[0], spline.knots[1]);
    EXPECT_EQ(value(spline, 5), 10);
}

TEST(Spline, DualKnotsJump) {
    SplineValue spline = line(SplineInterpolation::Linear);
    spline.knots[1].is_dual = true;
    spline.knots[1].pre_value = 10;
    EXPECT_EQ(value(spline, 5), 5);
    EXPECT_EQ(value(spline, 10), 20);
}

TEST(Spline, BezierWithThirdsIsAPolynomialOfTime) {
    // Tangents of a third of the segment make time linear: v(u) is the cubic of its own controls
    SplineValue spline = line(SplineInterpolation::Curve);
    spline.knots[0].post = {10.0 / 3.0, 6.0};
    spline.knots[1].pre = {10.0 / 3.0, -3.0};
    for (double u = 0.0; u <= 1.0; u += 0.125) {
        const double v = 1.0 - u;
        const double expected = 3 * v * v * u * 20.0 + 3 * v * u * u * 30.0 + u * u * u * 20.0;
        EXPECT_NEAR(value(spline, 10 * u), expected, 1e-9) << u;
    }
}

TEST(Spline, HermiteMeetsValuesAndSlopes) {
    SplineValue spline = line(SplineInterpolation::Curve);
    spline.curve = SplineCurve::Hermite;
    spline.knots[0].post.slope = 1.0;
    spline.knots[1].pre.slope = -2.0;
    EXPECT_NEAR(value(spline, 1e-6), 1e-6, 1e-9);
    EXPECT_NEAR(value(spline, 10 - 1e-6), 20 + 2e-6, 1e-9);
    EXPECT_NEAR(value(spline, 5), 10 + 10 * (1.0 + 2.0) / 8.0, 1e-9);
}

TEST(Spline, TangentsThatRunBackInTimeAreShortened) {
    SplineValue spline = line(SplineInterpolation::Curve);
    spline.knots[0].post = {40.0, 0.0};
    spline.knots[1].pre = {40.0, 0.0};
    // Flat tangents: the values rise all the way, and the shape is symmetrical
    double before = -1.0;
    for (double t = 0.0; t <= 10.0; t += 0.25) {
        EXPECT_GE(value(spline, t), before) << t;
        before = value(spline, t);
        // In the middle the curve is vertical, where time tells the value only so well
        EXPECT_NEAR(value(spline, t) + value(spline, 10 - t), 20, 1e-3) << t;
    }
}

TEST(Spline, Extrapolates) {
    SplineValue spline = line(SplineInterpolation::Linear);
    EXPECT_EQ(value(spline, -5), 0);
    EXPECT_EQ(value(spline, 15), 20);
    spline.pre.mode = spline.post.mode = SplineExtrapolationMode::Linear;
    EXPECT_EQ(value(spline, -5), -10);
    EXPECT_EQ(value(spline, 15), 30);
    spline.post.mode = SplineExtrapolationMode::Sloped;
    spline.post.slope = -1;
    EXPECT_EQ(value(spline, 15), 15);
    spline.post.mode = SplineExtrapolationMode::None;
    EXPECT_EQ(value(spline, 15), -999);
    SplineValue held = line(SplineInterpolation::Held);
    held.post.mode = SplineExtrapolationMode::Linear;
    EXPECT_EQ(value(held, 15), 20);
}

TEST(Spline, ExtrapolatesByLoops) {
    SplineValue spline = line(SplineInterpolation::Linear);
    spline.pre.mode = spline.post.mode = SplineExtrapolationMode::LoopReset;
    EXPECT_EQ(value(spline, 12), 4);
    EXPECT_EQ(value(spline, -2), 16);
    spline.pre.mode = spline.post.mode = SplineExtrapolationMode::LoopRepeat;
    EXPECT_EQ(value(spline, 12), 24);
    EXPECT_EQ(value(spline, 32), 64);
    EXPECT_EQ(value(spline, -2), -4);
    spline.pre.mode = spline.post.mode = SplineExtrapolationMode::LoopOscillate;
    EXPECT_EQ(value(spline, 12), 16);
    EXPECT_EQ(value(spline, 22), 4);
    EXPECT_EQ(value(spline, -2), 4);
}

TEST(Spline, LoopsInside) {
    // A prototype of [0, 10) with a knot at 4, twice after it and once before, 100 more each time
    SplineValue spline;
    spline.knots = {
        knot(-20, 7, SplineInterpolation::Held), knot(0, 0, SplineInterpolation::Linear),
        knot(4, 8, SplineInterpolation::Linear), knot(15, 55, SplineInterpolation::Held),
        knot(40, 9, SplineInterpolation::Held)};
    spline.loop = {0, 10, 1, 2, 100};
    EXPECT_EQ(value(spline, 2), 4);
    EXPECT_EQ(value(spline, 12), 104);
    EXPECT_EQ(value(spline, 24), 208);
    EXPECT_EQ(value(spline, -8), -96);
    // From the last knot of a copy to the first of the next
    EXPECT_EQ(value(spline, 7), 8 + (100 - 8) * 0.5);
    // Authored knots under the copies do not count, those outside do
    EXPECT_EQ(value(spline, 15), 100 + 8 + (100 - 8) / 6.0);
    EXPECT_EQ(value(spline, -15), 7);
    EXPECT_EQ(value(spline, 40), 9);
    EXPECT_NEAR(value(spline, 35), 300 + (9 - 300) * 0.5, 1e-9);
}

TEST(Spline, CostsNothingForManyLoops) {
    SplineValue spline = line(SplineInterpolation::Linear);
    spline.loop = {0, 10, 0, 2'000'000'000, 0};
    EXPECT_EQ(value(spline, 1e9 + 5), 0.0 + 0);  // the copy of knot 0 closes the prototype
}

using SplineStageTest = StageTest;

TEST_F(SplineStageTest, SplinesAreValuesOfAttributes) {
    write("weak.usda", R"(
def "P" {
    double x = 3
    double x.spline = { bezier, 0: 0; post linear, 10: 20 }
    float y.spline = { bezier, 0: 1; post linear, 1: 2 }
    double z = 4
    double z.spline = { bezier, 0: 1; post linear, 1: 2 }
}
)");
    open(
        "( subLayers = [@weak.usda@ (offset = 100)] )\nover \"P\" { double z = AnimationBlock }\n");
    const Prim prim = stage().prim_at("/P");
    EXPECT_EQ(prim.attribute("x").get<double>(105.0), 10.0);
    EXPECT_EQ(prim.attribute("x").get<double>(), 3.0);
    EXPECT_EQ(prim.attribute("x").value_source(), ValueSource::Spline);
    EXPECT_TRUE(prim.attribute("x").might_be_time_varying());
    EXPECT_TRUE(prim.attribute("y").value(100.5).holds<float>());
    EXPECT_EQ(prim.attribute("z").get<double>(100.5), 4.0);
}

}  // namespace
}  // namespace velatura::usd::stage
