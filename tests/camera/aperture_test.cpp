// SPDX-License-Identifier: Apache-2.0
// Openings of lenses against the closed forms of regular polygons.
#include "camera/aperture.h"

#include "camera/camera_model.h"
#include "sampling/warp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace velatura::camera {
namespace {

Vec2d at(double radius, double angle) {
    return {radius * std::cos(angle), radius * std::sin(angle)};
}

/// Mean of f over the opening, by points of the square in equal steps.
template <class F>
Vec2d mean(const Aperture& aperture, const F& f) {
    constexpr int steps = 512;
    Vec2d sum(0.0);
    for (int i = 0; i < steps; ++i)
        for (int k = 0; k < steps; ++k)
            sum += f(aperture.from_disk(
                sampling::concentric_disk(Vec2d((i + 0.5) / steps, (k + 0.5) / steps))));
    return sum / double(steps * steps);
}

TEST(Aperture, OfStraightBladesIsThePolygon) {
    for (const int n : {3, 4, 5, 6, 9, 64}) {
        const double rotation = 17.0, turn = rotation * pi_d / 180;
        const Aperture aperture(n, rotation, 0);
        EXPECT_NEAR(aperture.area(), 0.5 * n * std::sin(2 * pi_d / n), 1e-14) << n;
        for (int k = 0; k < n; ++k) {
            // Corners are on the circle, middles of edges nearer
            const double corner = turn + 2 * pi_d * k / n, middle = corner + pi_d / n;
            EXPECT_NEAR((aperture.from_disk(at(1, corner)) - at(1, corner)).length(), 0, 1e-12)
                << n;
            EXPECT_NEAR(
                (aperture.from_disk(at(1, middle)) - at(std::cos(pi_d / n), middle)).length(), 0,
                1e-12)
                << n;
        }
        // The rim is on an edge, what is within is inside of all
        std::mt19937 random(11);
        std::uniform_real_distribution<double> uniform(0, 1);
        for (int i = 0; i < 1000; ++i) {
            const double r = i % 2 ? 1.0 : uniform(random);
            const Vec2d p = aperture.from_disk(at(r, 2 * pi_d * uniform(random)));
            double furthest = -1;
            for (int k = 0; k < n; ++k)
                furthest = std::max(furthest, p.dot(at(1, turn + 2 * pi_d * (k + 0.5) / n)));
            EXPECT_NEAR(furthest, r * std::cos(pi_d / n), 1e-12) << n;
        }
        const Vec2d moments =
            mean(aperture, [](const Vec2d& p) { return Vec2d(p.dot(p), p.x * p.y); });
        EXPECT_NEAR(moments.x, (2 + std::cos(2 * pi_d / n)) / 6, 1e-5) << n;
        EXPECT_NEAR(moments.y, 0, 1e-5) << n;
        EXPECT_LT(mean(aperture, [](const Vec2d& p) { return p; }).length(), 1e-5) << n;
    }
}

TEST(Aperture, KeepsAreasInOneRatio) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(0.05, 0.95);
    for (const int n : {3, 5, 8}) {
        for (const double roundness : {0.0, 0.3, 0.9, 1.0}) {
            const Aperture aperture(n, -33.0, roundness);
            int checked = 0;
            for (int i = 0; i < 500; ++i) {
                const Vec2d p = at(uniform(random), 2 * pi_d * uniform(random));
                const double h = 1e-6;
                const Vec2d dx =
                    (aperture.from_disk(p + Vec2d(h, 0)) - aperture.from_disk(p - Vec2d(h, 0))) /
                    (2 * h);
                const Vec2d dy =
                    (aperture.from_disk(p + Vec2d(0, h)) - aperture.from_disk(p - Vec2d(0, h))) /
                    (2 * h);
                const double ratio = dx.x * dy.y - dx.y * dy.x;
                // Not across the line to a corner, where the map bends
                if (std::abs(ratio - aperture.area() / pi_d) < 1e-6) ++checked;
            }
            EXPECT_GE(checked, 498) << n << " blades, roundness " << roundness;
        }
    }
}

TEST(Aperture, RoundEdgesGoFromThePolygonToTheDisk) {
    const int n = 5;
    for (const double roundness : {0.0, 0.25, 0.5, 1.0}) {
        const Aperture aperture(n, 0, roundness);
        // Area and moment by the reach at each angle
        constexpr int steps = 100000;
        double area = 0, moment = 0;
        for (int i = 0; i < steps; ++i) {
            const double angle = pi_d / n * (2 * (i + 0.5) / steps - 1);
            const double b = (1 - roundness) * std::cos(pi_d / n) / std::cos(angle) + roundness;
            area += b * b / 2 * (2 * pi_d / n / steps) * n;
            moment += b * b * b * b / 4 * (2 * pi_d / n / steps) * n;
        }
        EXPECT_NEAR(aperture.area(), area, 1e-9) << roundness;
        const Vec2d found = mean(aperture, [](const Vec2d& p) { return Vec2d(p.dot(p), 0); });
        EXPECT_NEAR(found.x, moment / area, 1e-5) << roundness;
    }
    const Aperture disk(7, 21, 1);
    for (int i = 0; i < 100; ++i) {
        const Vec2d p = at(i / 100.0, 0.7 * i);
        EXPECT_NEAR((disk.from_disk(p) - p).length(), 0, 1e-14);
    }
}

scene::Camera lens_of(int blades) {
    scene::Camera c;
    c.lens_radius = 0.5;
    c.focus_distance = 4;
    c.lens_blades = blades;
    c.lens_rotation_deg = 90;
    return c;
}

TEST(Aperture, IsWhereRaysLeaveTheLens) {
    const CameraModel camera(lens_of(3), 100, 100);
    double highest = -1, lowest = 1;
    for (int i = 0; i < 64; ++i) {
        for (int k = 0; k < 64; ++k) {
            const CameraRay ray =
                camera.generate_ray({50, 50}, {(float(i) + 0.5f) / 64, (float(k) + 0.5f) / 64});
            highest = std::max(highest, double(ray.o.y));
            lowest = std::min(lowest, double(ray.o.y));
            // Through the point in focus
            const double t = (-4 - double(ray.o.z)) / double(ray.d.z);
            EXPECT_NEAR((Vec3d(ray.o) + Vec3d(ray.d) * t - Vec3d(0, 0, -4)).length(), 0, 2e-6);
        }
    }
    // A triangle with a corner up
    EXPECT_NEAR(highest, 0.5, 0.03);
    EXPECT_NEAR(lowest, -0.25, 0.01);
}

TEST(Aperture, WithoutBladesIsTheDiskBitForBit) {
    scene::Camera turned = lens_of(0);
    turned.lens_roundness = 0.5;
    scene::Camera plain = lens_of(0);
    plain.lens_rotation_deg = 0;
    scene::Camera closed = lens_of(6), pinhole = lens_of(0);
    closed.lens_radius = pinhole.lens_radius = 0;
    const CameraModel a(turned, 30, 20), b(plain, 30, 20), c(closed, 30, 20), d(pinhole, 30, 20);
    for (int i = 0; i < 100; ++i) {
        const Vec2 film(float(i % 30), float(i % 20)), u(float(i) / 100, 0.3f);
        const CameraRay x = a.generate_ray(film, u), y = b.generate_ray(film, u);
        EXPECT_TRUE(x.o == y.o && x.d == y.d);
        EXPECT_TRUE(c.generate_ray(film, u).d == d.generate_ray(film, u).d);
    }
}

}  // namespace
}  // namespace velatura::camera
