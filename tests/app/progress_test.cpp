// SPDX-License-Identifier: Apache-2.0
#include "app/progress.h"

#include "film/film_scene.h"
#include "integrator/schedule.h"
#include "integrator/work_rate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace velatura::app {

using integrator::WorkRate;

TEST(Progress, EstimatesAreNoMorePreciseThanTheyCanBe) {
    EXPECT_EQ(format_estimate(0), "0 s");
    EXPECT_EQ(format_estimate(7.6), "8 s");
    EXPECT_EQ(format_estimate(47), "45 s");
    EXPECT_EQ(format_estimate(118), "2 min 00 s");
    EXPECT_EQ(format_estimate(334), "5 min 30 s");
    EXPECT_EQ(format_estimate(1000), "17 min 00 s");
    EXPECT_EQ(format_estimate(7540), "2 h 05 min");
    EXPECT_EQ(format_estimate(-1), "0 s");
}

TEST(Progress, SamplesDoNotExceedTheirTarget) {
    // Adaptive sampling gives 32 in the mean, and some part of one more
    EXPECT_EQ(format_samples(32.9, 32), "32/32 spp");
    EXPECT_EQ(format_samples(12.34, 32), "12.3/32 spp");
    EXPECT_EQ(format_samples(213.4, 0), "213 spp");
}

/// 10 s of work at a constant rate after a start of 2 s in which a hundredth of it is done. By all
/// of the time so far, the estimate at 3 s is 3 × 0.89/0.11: 24 s for 8.9.
TEST(Progress, EstimatesForgetTheStart) {
    constexpr double all = 1000, start_s = 2, done_at_start = 10;
    const double rate = (all - done_at_start) / (12 - start_s);
    WorkRate work;
    double done = 0;
    for (double t = 0.01; t < 12; t += 0.01) {
        done = t < start_s ? done_at_start * t / start_s : done_at_start + rate * (t - start_s);
        work.add(t, done);
        const std::optional<double> left = work.seconds_for(all - done, 50);
        if (t < 1) {
            EXPECT_FALSE(left.has_value()) << t;
        }
        if (left && t > 4.1) {
            EXPECT_NEAR(*left, 12 - t, 0.03 * (12 - t) + 0.05) << t;
        }
        // Twice too much at the worst
        if (left && t > 3) {
            EXPECT_LT(*left, 2 * (12 - t)) << t;
        }
    }
    EXPECT_EQ(work.seconds_for(0, 50), 0.0);
}

TEST(Progress, NoEstimateBeforeEnoughIsDone) {
    WorkRate work;
    work.add(0.5, 100);
    EXPECT_FALSE(work.seconds_for(900, 10).has_value());
    work.add(2, 101);
    EXPECT_FALSE(work.seconds_for(899, 10).has_value());
    work.add(11, 103);
    EXPECT_TRUE(work.seconds_for(897, 10).has_value());
}

namespace {

std::vector<double> fractions_of(const integrator::RenderOptions& options) {
    film::Film film({0, 0, 32, 32}, film::test_layer_set());
    std::vector<double> fractions;
    integrator::RenderCallbacks callbacks;
    callbacks.progress = [&](const integrator::RenderState& state) {
        fractions.push_back(state.fraction);
    };
    integrator::run_schedule(
        film, options,
        [](int x, int y, uint64_t s, film::SampleRadiance& out, integrator::RayCounts& counts) {
            // Noisy on one side, so that rates differ
            const float value = x < 16 ? 1.0f : float((uint64_t(x + 7 * y) + 5 * s) % 9);
            out.add(1, 0, Rgb(value));
            ++counts.camera;
        },
        callbacks);
    return fractions;
}

}  // namespace

/// Of samples 16 to 32 the first 16 are traced again, to place the others: that is half of the
/// work. It was shown as 0 % for as long as it took.
TEST(Progress, CountsAllThatIsTraced) {
    integrator::RenderOptions range;
    range.first_sample = 16;
    range.end_sample = 32;
    range.adaptive = true;
    integrator::RenderOptions whole = range;
    whole.first_sample = 0;
    for (const integrator::RenderMode mode :
         {integrator::RenderMode::Progressive, integrator::RenderMode::Tile}) {
        for (integrator::RenderOptions options : {range, whole}) {
            options.mode = mode;
            const std::vector<double> fractions = fractions_of(options);
            ASSERT_GT(fractions.size(), 60u);
            EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
            EXPECT_GT(fractions.front(), 0.0);
            EXPECT_LT(fractions.front(), 0.05);
            // The pilot, and one pass; a whole render has more passes of few samples
            if (options.first_sample > 0) {
                EXPECT_NEAR(fractions[fractions.size() / 2], 0.5, 0.1);
            }
            EXPECT_NEAR(fractions.back(), 1.0, 1e-12);
        }
    }
}

}  // namespace velatura::app
