// SPDX-License-Identifier: Apache-2.0
#include "translate/color/blackbody.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace velatura::translate::color {

namespace {

constexpr double first_kelvin = 1000.0, last_kelvin = 10000.0, kelvin_step = 500.0;

/// Black bodies of 1000, 1500 … 10000 K in linear Rec.709, brightest channel 1, as UsdLux has them.
/// Ref: Walker, "Colour Rendering of Spectra" (fourmilab.ch/documents/specrend), public domain.
const std::array<Vec3d, 19> knots = {{
    {1.0, 0.027490, 0.0},      {1.0, 0.149664, 0.0},      {1.0, 0.256644, 0.008095},
    {1.0, 0.372033, 0.067450}, {1.0, 0.476725, 0.153601}, {1.0, 0.570376, 0.259196},
    {1.0, 0.653480, 0.377155}, {1.0, 0.726878, 0.501606}, {1.0, 0.791543, 0.628050},
    {1.0, 0.848462, 0.753228}, {1.0, 0.898581, 0.874905}, {1.0, 0.942771, 0.991642},
    {0.906947, 0.890456, 1.0}, {0.828247, 0.841838, 1.0}, {0.765791, 0.801896, 1.0},
    {0.715255, 0.768579, 1.0}, {0.673683, 0.740423, 1.0}, {0.638992, 0.716359, 1.0},
    {0.609681, 0.695588, 1.0},
}};

/// Catmull-Rom spline through b at t = 0 and c at t = 1.
Vec3d spline(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d, double t) {
    const Vec3d slope = (c - a) / 2, next_slope = (d - b) / 2, rise = c - b;
    const Vec3d quadratic = rise * 3.0 - slope * 2.0 - next_slope;
    const Vec3d cubic = slope + next_slope - rise * 2.0;
    return b + (slope + (quadratic + cubic * t) * t) * t;
}

}  // namespace

Vec3d blackbody_rgb(double kelvin) {
    const double x = (std::clamp(kelvin, first_kelvin, last_kelvin) - first_kelvin) / kelvin_step;
    const int last = int(knots.size()) - 1;
    const int i = std::min(int(x), last - 1);
    // The end knots stand twice
    const auto knot = [&](int k) { return knots[size_t(std::clamp(k, 0, last))]; };
    Vec3d rgb = spline(knot(i - 1), knot(i), knot(i + 1), knot(i + 2), x - i);
    rgb /= 0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z;
    // The spline dips below zero in blue near 1300 K
    for (int c = 0; c < 3; ++c) rgb[c] = std::max(rgb[c], 0.0);
    return rgb;
}

}  // namespace velatura::translate::color
