// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "lights/light_set.h"
#include "sampling/sampler.h"

#include <cmath>
#include <functional>

namespace velatura::lights {

/// A scene with lights and nothing else.
inline scene::Scene scene_of(std::vector<scene::Light> lights) {
    scene::Scene scene;
    scene.lights = std::move(lights);
    scene.groups.resize(2);
    return scene;
}

inline scene::Light light_of(scene::LightKind kind, const Mat4d& m = Mat4d()) {
    scene::Light light;
    light.kind = kind;
    light.name = "/Light";
    light.render_from_light = m;
    return light;
}

inline Mat4d matrix_of(const Vec3d& x, const Vec3d& y, const Vec3d& z, const Vec3d& origin) {
    return Mat4d(x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, origin.x, origin.y, origin.z,
                 1);
}

inline Mat4d translation(double x, double y, double z) {
    return matrix_of({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {x, y, z});
}

/// Mean of independent runs and its standard error.
struct Estimate {
    double mean = 0, standard_error = 0;

    /// Smallest deviation that a two-sided test at 4 standard errors finds with probability 0.9.
    double detectable() const { return (4.0 + 1.2816) * standard_error; }
};

/// Mean of f over Owen-scrambled points, from 16 independent scrambles.
inline Estimate integrate(int samples_per_run, const std::function<double(const Vec2&)>& f) {
    constexpr int runs = 16;
    double sum = 0, squares = 0;
    for (int run = 0; run < runs; ++run) {
        double total = 0;
        for (int i = 0; i < samples_per_run; ++i) {
            const sampling::PixelSampler sampler(7, run, 3, uint64_t(i));
            total += f(sampler.get_2d(0, sampling::Purpose::LightSurface));
        }
        const double mean = total / samples_per_run;
        sum += mean;
        squares += mean * mean;
    }
    const double mean = sum / runs;
    const double variance = std::max(0.0, squares / runs - mean * mean) / (runs - 1);
    return {mean, std::sqrt(variance)};
}

/// Irradiance (red) at p with unit normal n by sampling the light.
inline Estimate irradiance(const LightSet& lights,
                           const Vec3& p,
                           const Vec3& n,
                           int samples_per_run = 4096) {
    return integrate(samples_per_run, [&](const Vec2& u) {
        const auto s = lights.sample(0, p, u);
        if (!s) return 0.0;
        return double(s->Le.x) * std::max(0.0, double(n.dot(s->wi))) / double(s->pdf);
    });
}

/// Direction uniform over the sphere.
inline Vec3 uniform_direction(const Vec2& u) {
    const double z = 1.0 - 2.0 * double(u.x);
    const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
    const double phi = 2.0 * pi_d * double(u.y);
    return {float(r * std::cos(phi)), float(r * std::sin(phi)), float(z)};
}

}  // namespace velatura::lights
