// SPDX-License-Identifier: Apache-2.0
#include "camera/shutter_curve.h"

#include "camera/camera_model.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace velatura::camera {
namespace {

/// How open the shutter is.
double opening(double full, double falling, double t) {
    const double rise = full > 0 ? t / full : 1.0,
                 fall = falling < 1 ? (1 - t) / (1 - falling) : 1.0;
    return std::min({rise, fall, 1.0});
}

TEST(ShutterCurve, MakesTimesAsOftenAsLightComesThrough) {
    const double curves[][2] = {{0.25, 0.75}, {0.5, 0.5}, {0, 0.5},  {0.1, 1},
                                {0, 0},       {1, 1},     {0.3, 0.3}};
    for (const auto& [full, falling] : curves) {
        const ShutterCurve curve(full, falling);
        EXPECT_FALSE(curve.is_box());
        // The integral up to each time, in the middle of small steps
        constexpr int steps = 100000;
        double whole = 0;
        for (int i = 0; i < steps; ++i) whole += opening(full, falling, (i + 0.5) / steps) / steps;
        EXPECT_NEAR(whole, (1 + falling - full) / 2, 1e-9);
        double sum = 0;
        int reached = 0;
        float before = -1;
        for (int k = 0; k < 64; ++k) {
            const float u = (float(k) + 0.5f) / 64, time = curve.time(u);
            EXPECT_GT(time, before);
            EXPECT_GE(time, 0.0f);
            EXPECT_LE(time, 1.0f);
            before = time;
            for (; reached < steps && (reached + 1.0) / steps <= double(time); ++reached)
                sum += opening(full, falling, (reached + 0.5) / steps) / steps;
            EXPECT_NEAR(sum / whole, double(u), 3e-5) << full << " " << falling;
        }
    }
}

TEST(ShutterCurve, OfABoxChangesNoBit) {
    const CameraModel camera(scene::Camera{}, 4, 4);
    for (int k = 0; k < 1000; ++k) {
        const float u = float(k) / 1000.0f;
        EXPECT_EQ(ShutterCurve(0, 1).time(u), u);
        EXPECT_EQ(camera.shutter_time(u), u);
    }
}

}  // namespace
}  // namespace velatura::camera
