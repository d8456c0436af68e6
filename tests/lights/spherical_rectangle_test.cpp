// SPDX-License-Identifier: Apache-2.0
#include "lights/spherical_rectangle.h"

#include "hard_case.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::lights {
namespace {

RectangleView view_of(double cx, double cy, double w, double l, double h) {
    return {cx - w / 2, cx + w / 2, cy - l / 2, cy + l / 2, w, l, h};
}

/// Second method: the integral of h / r³ as four arc tangents, in long double.
long double solid_angle_of_corners(const RectangleView& v) {
    const auto corner = [&](double x, double y) {
        const long double lx = x, ly = y, lh = v.height;
        return std::atan2(lx * ly, lh * std::sqrt(lx * lx + ly * ly + lh * lh));
    };
    return corner(v.x1, v.y1) - corner(v.x0, v.y1) - corner(v.x1, v.y0) + corner(v.x0, v.y0);
}

TEST(SphericalRectangle, SolidAngleOfTheHandbook) {
    EXPECT_NEAR(solid_angle(view_of(0, 0, 2, 2, 1)), 2.0 * 3.14159265358979323846 / 3.0, 1e-14);
}

TEST(H24SphericalRectangle, SolidAngleAgreesWithLongDoubleFromTinyToHemisphere) {
    // Values with few bits, so that x1 − x0 is exact and both methods see the same rectangle
    double smallest = 10, largest = 0, worst = 0;
    for (int size = -18; size <= 12; ++size) {
        for (const double aspect : {1.0, 0.125, 16.0}) {
            for (const double cx : {0.0, 0.5, 3.0, 64.0}) {
                for (const double cy : {0.0, 0.75, 40.0}) {
                    for (const double h : {1.0, 0.0009765625}) {
                        const double w = std::ldexp(1.0, size), l = w * aspect;
                        const RectangleView v = view_of(cx, cy, w, l, h);
                        const double expected = double(solid_angle_of_corners(v));
                        if (expected < 1e-12 || expected > 6.2831) continue;
                        const double error = std::abs(solid_angle(v) / expected - 1.0);
                        // The oracle itself rounds at 1e-19 of one of its four terms
                        worst = hardcase::larger(worst, error - 5e-19 / expected);
                        smallest = std::min(smallest, expected);
                        largest = std::max(largest, expected);
                    }
                }
            }
        }
    }
    EXPECT_LT(smallest, 1e-11);
    EXPECT_GT(largest, 6.2);
    hardcase::expect_within(
        {fmt::format("solid angle from {:.1g} to {:.3g} sr, relative", smallest, largest),
         hardcase::larger(0.0, worst), 1e-6, 0, "four arc tangents in long double"});
}

TEST(H24SphericalRectangle, SamplesSplitTheSolidAngleInProportion) {
    struct Case {
        RectangleView view;
        double bound;
    };

    const Case cases[] = {
        {view_of(0, 0, 2, 2, 1), 1e-12},       {view_of(1, -1, 2, 1, 0.05), 1e-10},
        {view_of(3, 5, 1, 1, 0.5), 1e-10},     {view_of(0.1, 0, 1, 1, 5), 1e-11},
        {view_of(0, 0, 100, 100, 0.01), 1e-8}, {view_of(0.2, 0.1, 1, 1, 250), 1e-8},
        {view_of(-40, 0, 1, 2, 0.02), 1e-6},
    };
    double worst = 0;
    for (const Case& c : cases) {
        const double omega = solid_angle(c.view);
        for (int i = 1; i < 16; ++i) {
            for (int j = 1; j < 16; ++j) {
                const Vec2 u(float(i) / 16.0f, float(j) / 16.0f);
                const Vec2d p = sample_solid_angle(c.view, omega, u);
                // The part to the left has the share u.x of the solid angle
                RectangleView left = c.view;
                left.x1 = p.x;
                left.width = p.x - left.x0;
                const double share = std::abs(solid_angle(left) / omega - double(u.x));
                EXPECT_LE(share, c.bound);
                worst = hardcase::larger(worst, share);
                // and the part of a thin strip below the share u.y, up to the square of its width
                RectangleView strip = c.view, below;
                const double thin = 1e-3 * std::min(c.view.height, c.view.width);
                strip.x0 = p.x - thin / 2;
                strip.x1 = p.x + thin / 2;
                strip.width = thin;
                below = strip;
                below.y1 = p.y;
                below.length = p.y - below.y0;
                EXPECT_NEAR(solid_angle(below) / solid_angle(strip), double(u.y), 1e-6 + c.bound);
            }
        }
    }
    hardcase::expect_within({"share of the solid angle on one side of a sample, less u", worst,
                             1e-6, 0, "inverse of the sampling"});
}

TEST(SphericalRectangle, SamplesStayInsideForEveryView) {
    for (const double h : {1e-12, 1e-6, 1e-2, 1.0, 1e3, 1e6}) {
        for (const double cx : {0.0, 0.5, 1.0, 1e3}) {
            const RectangleView v = view_of(cx, cx / 2, 1, 2, h);
            const double omega = solid_angle(v);
            for (const float ux : {0.0f, 0.3f, 0x1.fffffep-1f}) {
                for (const float uy : {0.0f, 0.6f, 0x1.fffffep-1f}) {
                    const Vec2d p = sample_solid_angle(v, omega, {ux, uy});
                    EXPECT_TRUE(p.x >= v.x0 && p.x <= v.x1 && p.y >= v.y0 && p.y <= v.y1)
                        << h << " " << cx << ": " << p.x << " " << p.y;
                }
            }
        }
    }
}

}  // namespace
}  // namespace velatura::lights
