// SPDX-License-Identifier: Apache-2.0
// Solid angles of triangles and points uniform in them (docs/engineering/hard_cases.md H25).
#include "lights/spherical_triangle.h"

#include "../sampling/chi_square.h"
#include "hard_case.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace velatura::lights {
namespace {

using sampling::testing::TestRandom;
using Real = long double;

struct Vec3l {
    Real x, y, z;
};

Vec3l to_real(const Vec3d& v) {
    return {v.x, v.y, v.z};
}

Vec3l operator+(const Vec3l& a, const Vec3l& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}

Vec3l operator-(const Vec3l& a, const Vec3l& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

Real dot(const Vec3l& a, const Vec3l& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

Vec3l cross(const Vec3l& a, const Vec3l& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

Real length(const Vec3l& a) {
    return std::sqrt(dot(a, a));
}

/// Second method, independent of the one under test where it matters: L'Huilier's theorem, arc
/// lengths from half chords. Loses digits in slivers only.
Real solid_angle_by_arcs(const TriangleView& view) {
    const Vec3l a = to_real(view.a), b = a + to_real(view.e1), c = a + to_real(view.e2);
    const auto arc = [](const Vec3l& p, const Vec3l& q) {
        return std::atan2(length(cross(p, q - p)), dot(p, q));
    };
    const Real x = arc(b, c), y = arc(c, a), z = arc(a, b), s = (x + y + z) / 2;
    const auto half_tan = [](Real angle) { return std::tan(std::max(Real(0), angle) / 2); };
    const Real product = half_tan(s) * half_tan(s - x) * half_tan(s - y) * half_tan(s - z);
    return 4 * std::atan(std::sqrt(std::max(Real(0), product)));
}

/// Van Oosterom & Strackee in long double.
Real solid_angle_in_long_double(const TriangleView& view) {
    const Vec3l a = to_real(view.a), b = a + to_real(view.e1), c = a + to_real(view.e2);
    const Real la = length(a), lb = length(b), lc = length(c);
    const Real triple = std::abs(dot(a, cross(to_real(view.e1), to_real(view.e2))));
    return 2 * std::atan2(triple, la * lb * lc + dot(a, b) * lc + dot(a, c) * lb + dot(b, c) * la);
}

/// Corners as of a mesh in float, seen from a point in float.
TriangleView random_view(TestRandom& random, double size) {
    const auto number = [&](double scale) {
        return double(float((2.0 * double(random.uniform()) - 1.0) * scale));
    };
    TriangleView view;
    view.a = Vec3d(number(1.0), number(1.0), number(1.0));
    view.e1 = Vec3d(number(size), number(size), number(size));
    view.e2 = Vec3d(number(size), number(size), number(size));
    return view;
}

TEST(SphericalTriangle, OctantIsHalfPi) {
    EXPECT_NEAR(solid_angle({{1, 0, 0}, {-1, 1, 0}, {-1, 0, 1}}), pi_d / 2, 1e-15);
    EXPECT_NEAR(solid_angle({{0, 0, 5}, {5, 0, -5}, {0, 5, -5}}), pi_d / 2, 1e-15);
}

TEST(H25SphericalTriangle, SolidAngleAgreesWithLongDouble) {
    TestRandom random(1);
    double worst = 0, worst_by_arcs = 0, smallest = 10, largest = 0;
    int count = 0;
    const uint64_t rounds = hardcase::sized(200000, 10000000, 200000000);
    for (uint64_t i = 0; i < rounds; ++i) {
        const double size = std::exp2(-18.0 + 30.0 * double(random.uniform()));
        const TriangleView view = random_view(random, size);
        const double omega = solid_angle(view), expected = double(solid_angle_in_long_double(view));
        if (expected < 1e-10 || expected > 6.2) continue;
        ++count;
        smallest = std::min(smallest, expected);
        largest = std::max(largest, expected);
        worst = hardcase::larger(worst, std::abs(omega / expected - 1.0));
        if (expected > 1e-4 && expected < 6.0)
            worst_by_arcs =
                std::max(worst_by_arcs, std::abs(omega / double(solid_angle_by_arcs(view)) - 1.0));
    }
    EXPECT_GT(count, 100000);
    EXPECT_LT(smallest, 2e-10);
    EXPECT_GT(largest, 6.1);
    hardcase::expect_within(
        {fmt::format("solid angle of {} triangles of {:.1g} to {:.3g} sr, relative", count,
                     smallest, largest),
         worst, 1e-8, 0, "long double"});
    hardcase::expect_within(
        {"the same of 1e-4 to 6 sr", worst_by_arcs, 1e-8, 0, "L'Huilier's theorem in long double"});
}

TEST(SphericalTriangle, CloseToTheTriangleItIsHalfTheSphere) {
    for (const double height : {1e-3, 1e-6, 1e-9}) {
        const TriangleView view{{-1, -1, height}, {3, 0, 0}, {0, 3, 0}};
        const double expected = double(solid_angle_in_long_double(view));
        EXPECT_NEAR(solid_angle(view), expected, 1e-14);
        EXPECT_GT(expected, 6.2);
    }
    EXPECT_EQ(solid_angle({{-1, -1, 0}, {-3, 0, 0}, {0, -3, 0}}), 0.0);  // edge on, from outside
}

/// Checks that a sample splits the solid angle in proportion to u: the part of the triangle on the
/// far side of the line from the second corner has the share u.x, and along that line the part of
/// a thin wedge has the share u.y, which is that of the squared chords.
void expect_proportional(const TriangleView& view, const Vec2& u, double bound) {
    const double omega = solid_angle(view);
    const Vec2d p = sample_solid_angle(view, omega, u);
    ASSERT_GE(p.x, 0.0);
    ASSERT_GE(p.y, 0.0);
    ASSERT_LE(p.x + p.y, 1.0 + 1e-15);
    if (p.x > 1.0 - 1e-6) return;  // the line from the second corner has no direction there
    TriangleView part = view;
    part.e2 = view.e2 * (p.y / (1.0 - p.x));
    const Real share = solid_angle_in_long_double(part) / solid_angle_in_long_double(view);
    EXPECT_NEAR(double(share), double(u.x), bound) << "omega " << omega;

    const auto unit = [](const Vec3l& v) {
        const Real l = length(v);
        return Vec3l{v.x / l, v.y / l, v.z / l};
    };
    const Vec3l a = to_real(view.a), b = unit(a + to_real(view.e1));
    const Vec3l far = unit(a + to_real(part.e2)) - b;
    const Vec3l near = unit(to_real(view.a + view.e1 * p.x + view.e2 * p.y)) - b;
    EXPECT_NEAR(double(dot(near, near) / dot(far, far)), double(u.y), bound) << "omega " << omega;
}

TEST(H25SphericalTriangle, SamplesSplitTheSolidAngleInProportion) {
    TestRandom random(2);
    int count = 0;
    for (int i = 0; i < 40000; ++i) {
        const double size = std::exp2(-16.0 + 24.0 * double(random.uniform()));
        const TriangleView view = random_view(random, size);
        const double omega = solid_angle(view);
        if (omega < 1e-10 || omega > 6.2) continue;
        ++count;
        expect_proportional(view, {random.uniform(), random.uniform()}, 1e-6);
    }
    EXPECT_GT(count, 20000);
    hardcase::expect_within(
        {fmt::format("samples of {} that split it otherwise than by 1e-6", count),
         ::testing::Test::HasFailure() ? 1.0 : 0.0, 0, 0,
         "solid angle of the part, in long double"});
}

TEST(H25SphericalTriangle, ExtremeViewsKeepWeightsInsideTheTriangle) {
    const float corners[] = {0.0f, 0x1p-24f, 0.5f, 0x1.fffffep-1f};
    int count = 0;
    double worst = 0;
    for (const double height : {1e-12, 1e-6, 1e-3, 1.0, 1e3, 1e6}) {
        for (const double aside : {-1.0, 0.0, 0.3, 1.0, 50.0}) {
            for (const double width : {1e-6, 1.0, 1e6}) {
                const TriangleView view{{aside, aside / 2, height}, {width, 0, 0}, {0, 1, 0}};
                const double omega = solid_angle(view);
                if (!(omega > 0.0)) continue;
                for (const float ux : corners) {
                    for (const float uy : corners) {
                        const Vec2d p = sample_solid_angle(view, omega, {ux, uy});
                        worst = std::max({worst, -p.x, -p.y, p.x + p.y - 1.0});
                        EXPECT_FALSE(std::isnan(p.x + p.y));
                        ++count;
                    }
                }
            }
        }
    }
    EXPECT_GT(count, 1000);
    hardcase::expect_within({"how far a sample is outside the triangle, in barycentrics", worst,
                             1e-6, 0, "weights not below 0 of sum 1"});
}

TEST(H25SphericalTriangle, AreaAndAngleSamplingHaveTheSameMeans) {
    // Irradiance on a surface facing +z: both estimates are averages over the same triangle
    TestRandom random(3);
    constexpr int samples = 1 << 14;
    int count = 0;
    double worst_detectable = 0, worst = 0;
    for (int round = 0; round < 60; ++round) {
        TriangleView view = random_view(random, std::exp2(-6.0 + 8.0 * double(random.uniform())));
        // Fully above the horizon, where the estimates are smooth
        view.a.z = std::abs(view.a.z) + std::max(0.0, -view.e1.z) + std::max(0.0, -view.e2.z) + 0.1;
        const double omega = solid_angle(view);
        if (omega < 1e-6) continue;
        double sum[2] = {}, squares[2] = {};
        for (int i = 0; i < samples; ++i) {
            const Vec2 u(random.uniform(), random.uniform()), w(random.uniform(), random.uniform());
            const Vec2d p = sample_solid_angle(view, omega, u), q = sample_triangle_area(w);
            const Vec3d by_angle = view.a + view.e1 * p.x + view.e2 * p.y;
            const Vec3d by_area = view.a + view.e1 * q.x + view.e2 * q.y;
            const double d = by_area.length();
            const double values[2] = {omega * by_angle.z / by_angle.length(),
                                      by_area.z / d * view.triple() / (2.0 * d * d * d)};
            for (int k = 0; k < 2; ++k) {
                sum[k] += values[k];
                squares[k] += values[k] * values[k];
            }
        }
        double mean[2], error = 0;
        for (int k = 0; k < 2; ++k) {
            mean[k] = sum[k] / samples;
            error += (squares[k] / samples - mean[k] * mean[k]) / samples;
        }
        error = std::sqrt(error);
        // Slivers seen from close by: too noisy by area to tell anything
        if (error > 0.02 * mean[0]) continue;
        ++count;
        worst_detectable = hardcase::larger(worst_detectable, 5.28 * error / mean[0]);
        worst = hardcase::larger(worst, std::abs(mean[0] - mean[1]) / error);
    }
    hardcase::expect_within(
        {fmt::format("means by area and by angle of {} triangles, in standard errors", count),
         worst, 4, 0, "second method", fmt::format("relative {:.2g}", worst_detectable)});
    EXPECT_GE(count, 30);
}

}  // namespace
}  // namespace velatura::lights
