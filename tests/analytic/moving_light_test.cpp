// SPDX-License-Identifier: Apache-2.0
// What gives light, or scatters it, and moves while the shutter is open: closed forms, and the mean
// of images at single times.
#include "volume_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace velatura::test {

namespace {

using integrator::LightSampling;

constexpr LightSampling all_strategies[] = {LightSampling::Mis, LightSampling::Light,
                                            LightSampling::Bsdf};

/// A mean over images at stratified times of the scene as it stands then.
Estimate mean_of_stills(const std::function<TestScene(double)>& at_time,
                        const TestRenderOptions& options,
                        int strata,
                        int seeds) {
    double sum = 0, squares = 0;
    uint64_t state = 12345;
    for (int seed = 0; seed < seeds; ++seed) {
        double mean = 0;
        for (int i = 0; i < strata; ++i) {
            state = state * 6364136223846793005ull + 1442695040888963407ull;
            const double jitter = double(state >> 11) * 0x1p-53;
            TestRenderOptions of_still = options;
            of_still.seed = uint64_t(1000 + seed * strata + i);
            mean += render(at_time((i + jitter) / strata), of_still).beauty().mean / strata;
        }
        sum += mean;
        squares += mean * mean;
    }
    const double mean = sum / seeds;
    return {mean, std::sqrt(std::max(0.0, squares / seeds - mean * mean) / (seeds - 1))};
}

/// Expects the scene that moves to be the mean of the stills.
void expect_mean_of_stills(const std::function<TestScene(double)>& at_time,
                           const TestScene& moving,
                           double relative,
                           const std::string& what) {
    const TestRenderOptions options{.size = 4, .samples = 16, .last_bounce = 2, .max_depth = 2};
    constexpr int strata = 16, seeds = 8;
    const Estimate stills = mean_of_stills(at_time, options, strata, seeds);
    TestRenderOptions of_moving = options;
    for (const LightSampling strategy : all_strategies) {
        // Of small lamps that are found by chance
        const double noisier = strategy == LightSampling::Bsdf ? 4.0 : 1.0;
        of_moving.samples = uint64_t(noisier * 16 * strata);
        of_moving.estimator.light_sampling = strategy;
        const Estimate blurred = over_seeds(
            moving, of_moving, seeds, [](const RenderedLayers& l) { return l.beauty().mean; });
        const double sigma = std::hypot(stills.standard_error, blurred.standard_error);
        fmt::print("{}, strategy {}: {:.5f} and {:.5f}, z {:.2f}, detectable {:.1e}\n", what,
                   int(strategy), blurred.mean, stills.mean, (blurred.mean - stills.mean) / sigma,
                   5.2816 * sigma / stills.mean);
        EXPECT_LT(std::abs(blurred.mean - stills.mean), 4.0 * sigma) << what << int(strategy);
        // The test would see as much
        EXPECT_LT(5.2816 * sigma, noisier * relative * stills.mean) << what << int(strategy);
    }
}

/// A matte floor below the camera.
TestScene floor_scene() {
    TestScene test;
    test.look_at_point(1e-3);
    test.add_square(-5.0f, 20.0f, test.add_matte(Rgb(0.5f)));
    return test;
}

Mat4d pose(double angle, const Vec3d& to) {
    Mat4d m;
    m.setAxisAngle(Vec3d(0.3, 1.0, 0.2).normalized(), angle);
    for (int k = 0; k < 3; ++k) m[3][k] = to[k];
    return m;
}

/// Where a lamp is, beside the view: keys so close that what is between them is nearly rigid.
std::vector<Mat4d> lamp_keys() {
    std::vector<Mat4d> keys;
    for (int k = 0; k <= 16; ++k) {
        const double way = k / 16.0;
        keys.push_back(pose(0.2 - 0.5 * way, {-1.5 + 2.5 * way, 2.0 - 0.2 * way, -3.0 - way}));
    }
    return keys;
}

Mat4d between(const std::vector<Mat4d>& keys, double t) {
    const double x = t * double(keys.size() - 1);
    const size_t segment = std::min(size_t(x), keys.size() - 2);
    const double f = x - double(segment);
    return keys[segment] * (1.0 - f) + keys[segment + 1] * f;
}

}  // namespace

// π L r² / (h √(a² + h²)) is the mean over x in [−a, a] of π L r² h / (x² + h²)^(3/2).
TEST(MovingLight, SphereAboveAPlaneIsTheClosedForm) {
    constexpr double a = 2.0, h = 1.5, r = 0.25, albedo = 0.5;
    const double expected = albedo * r * r / (h * std::sqrt(a * a + h * h));
    for (const int segments : {1, 4}) {
        for (const LightSampling strategy : all_strategies) {
            TestScene test = floor_scene();
            scene::Light& light = test.add_light(scene::LightKind::Sphere, at({-a, 0, -5.0 + h}));
            light.radius = float(r);
            for (int k = 1; k <= segments; ++k)
                light.later_render_from_light.push_back(
                    at({-a + 2 * a * k / segments, 0, -5.0 + h}));
            TestRenderOptions options{.size = 16, .samples = 256, .last_bounce = 1};
            if (strategy == LightSampling::Bsdf) options.samples = 2048;
            options.estimator.light_sampling = strategy;
            expect_close(
                render(test, options).bounce(1), expected,
                strategy == LightSampling::Bsdf ? 8e-2 : 2e-2,
                fmt::format("sphere light over {} segments, strategy {}", segments, int(strategy)));
        }
    }
}

TEST(MovingLight, OfUsdLuxIsTheMeanOfStills) {
    const auto scene_of = [](const Mat4d& first, const std::vector<Mat4d>& later) {
        TestScene test = floor_scene();
        scene::Light& light = test.add_light(scene::LightKind::Rect, first);
        light.later_render_from_light = later;
        light.width = 1.5f;
        light.shaping.is_active = true;
        light.shaping.cone_angle_deg = 70.0f;
        light.shaping.cone_softness = 0.5f;
        scene::Light& sun = test.add_light(scene::LightKind::Distant, first);
        sun.later_render_from_light = later;
        sun.angle_deg = 30.0f;
        sun.Le = Rgb(0.05f);
        return test;
    };
    const std::vector<Mat4d> keys = lamp_keys();
    expect_mean_of_stills([&](double t) { return scene_of(between(keys, t), {}); },
                          scene_of(keys[0], {keys.begin() + 1, keys.end()}), 0.03,
                          "rect with a cone, and a sun");
}

TEST(MovingLight, OfEmissiveGeometryIsTheMeanOfStills) {
    // A mesh that bends, an instance that turns, and a mesh light with a cone on another
    const Mat4d opens = lamp_keys().front(), closes = lamp_keys().back();
    const auto scene_at = [&](double t, bool moves) {
        TestScene test = floor_scene();
        const auto glow = test.add_matte(Rgb(0.0f), Rgb(2.0f));
        const auto place = [](const Vec3& p, const Mat4d& m) {
            return to_float(transform_point(Vec3d(p), m));
        };
        const auto f = float(t);
        test.add_square(0.0f, 0.6f, glow);
        auto& mesh = std::get<scene::Mesh>(test.scene.shapes.back().geometry);
        std::vector<Vec3> last;
        for (Vec3& p : mesh.points) {
            last.push_back(place(p + Vec3(0.3f * p.y, 0, 0.2f * p.x), closes));
            p = place(p, opens);
        }
        if (moves)
            mesh.later_points = {last};
        else
            for (size_t i = 0; i < last.size(); ++i)
                mesh.points[i] += (last[i] - mesh.points[i]) * f;
        const auto instance = [&] {
            if (moves) {
                test.make_instance(Mat4(closes));
                test.scene.instances.back().later_render_from_prototype = {Mat4(opens)};
            } else {
                test.make_instance(Mat4(closes) * (1.0f - f) + Mat4(opens) * f);
            }
        };
        test.add_square(0.4f, 0.3f, glow);
        instance();
        test.add_square(0.2f, 0.5f, test.add_matte(Rgb(0.0f)));
        scene::MeshLight& light = test.make_mesh_light();
        light.Le = Rgb(2.0f);
        light.shaping.is_active = true;
        light.shaping.cone_angle_deg = 60.0f;
        instance();
        return test;
    };
    expect_mean_of_stills([&](double t) { return scene_at(t, false); }, scene_at(0.0, true), 0.045,
                          "emissive mesh and instances");
}

TEST(MovingVolume, IsTheMeanOfStills) {
    const auto scene_of = [](const Mat4d& first, const std::vector<Mat4d>& later) {
        TestScene test = floor_scene();
        scene::Volume& smoke =
            add_volume(test.scene, constant_box({-0.5, -0.5, -3}, {0.5, 0.5, -2}, 1.5f));
        smoke.optics.albedo = Rgb(0.8f);
        smoke.render_from_volume = first;
        smoke.later_render_from_volume = later;
        test.add_light(scene::LightKind::Distant, Mat4d()).angle_deg = 40.0f;
        return test;
    };
    // A box before the view, which it leaves as its shadow does
    Mat4d flat, steep;
    steep.setAxisAngle(Vec3d(0, 1, 0), 0.35);
    steep[3][1] = 0.2;
    expect_mean_of_stills([&](double t) { return scene_of(flat * (1.0 - t) + steep * t, {}); },
                          scene_of(flat, {steep}), 0.03, "box of smoke that turns away");
}

}  // namespace velatura::test
