// SPDX-License-Identifier: Apache-2.0
// Light through walls without thickness, against closed forms: it is not scattered there, and light
// sampling looks through.
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::test {

namespace {

constexpr double f0 = 0.04;
constexpr float tint[3] = {0.9f, 0.5f, 0.2f};

/// The sheet's closed form, by the cosine outside: index 1.5, tinted per perpendicular passage.
double straight_share(double cosine, int channel) {
    const double R = f0 + (1.0 - f0) * std::pow(1.0 - cosine, 5);
    const double inside = std::sqrt(1.0 - (1.0 - cosine * cosine) / 2.25);
    const double t = std::pow(double(tint[channel]), 1.0 / inside);
    return (1.0 - R) * (1.0 - R) * t / (1.0 - R * R * t * t);
}

scene::Material window_glass() {
    scene::Material m = smooth_glass();
    m.thin_walled = true;
    m.transmission_color = scene::Input(Rgb(tint[0], tint[1], tint[2]));
    return m;
}

/// A small matte patch that the camera sees, and a pane between it and what is above, out of sight.
TestScene patch_below_pane(const scene::Material& pane, int panes = 1) {
    TestScene test;
    test.add_square(-1.0f, 0.01f, test.add_matte(Rgb(1.0f)));
    const scene::MaterialId material = test.add_material(pane);
    for (int i = 0; i < panes; ++i) test.add_square(0.25f + 0.1f * float(i), 40.0f, material);
    return test;
}

constexpr integrator::LightSampling all_samplers[] = {integrator::LightSampling::Mis,
                                                      integrator::LightSampling::Light,
                                                      integrator::LightSampling::Bsdf};

}  // namespace

// A light without extent cannot be met by chance: light sampling has to look through
TEST(ThinWall, SunShinesThroughPanes) {
    for (const int panes : {1, 3}) {
        TestScene test = patch_below_pane(window_glass(), panes);
        scene::Light& sun = test.add_light(scene::LightKind::Distant, Mat4d());
        sun.angle_deg = 0.0f;
        TestScene open = patch_below_pane(window_glass(), 0);
        open.add_light(scene::LightKind::Distant, Mat4d()).angle_deg = 0.0f;
        const double without = render(open, {.size = 8, .samples = 4}).bounce(1).mean;
        ASSERT_GT(without, 0.0);
        const RenderedLayers layers = render(test, {.size = 8, .samples = 4});
        for (int c = 0; c < 3; ++c) {
            const double expected = without * std::pow(straight_share(1.0, c), panes);
            expect_close(layers.bounce(1, 0, c), expected, 1e-5,
                         fmt::format("{} panes, channel {}", panes, c));
            // What the panes take is shadow
            expect_close(layers.unoccluded(0, c), without, 1e-5, "without panes");
        }
    }
}

// One light by three samplers: a path that passes the pane is no other path
TEST(ThinWall, LightIsNotCountedTwice) {
    constexpr double height = 2.0, radius = 3.0;
    const double min = height / std::hypot(height, radius);
    double expected = 0;
    constexpr int steps = 20000;
    for (int i = 0; i < steps; ++i) {
        const double mu = min + (1.0 - min) * (i + 0.5) / steps;
        expected += (1.0 - min) * 2.0 * mu * straight_share(mu, 1) / steps;
    }
    for (const integrator::LightSampling sampler : all_samplers) {
        TestScene test = patch_below_pane(window_glass());
        test.add_light(scene::LightKind::Disk, at(Vec3d(0, 0, height - 1.0))).radius =
            float(radius);
        const RenderedLayers layers =
            render(test, {.size = 32, .samples = 256, .estimator = {.light_sampling = sampler}});
        expect_close(layers.bounce(1, 0, 1), expected, 1e-2,
                     fmt::format("disk behind a pane, sampler {}", int(sampler)));
    }
}

TEST(ThinWall, DepthLimitCountsNoPassage) {
    for (const int max_depth : {1, 4}) {
        TestScene test = patch_below_pane(window_glass(), 2);
        test.add_light(scene::LightKind::Dome, Mat4d());
        const Estimate e =
            render(test, {.size = 32, .samples = 128, .max_depth = max_depth}).bounce(1, 0, 1);
        static Estimate first = e;
        EXPECT_NEAR(e.mean, first.mean, 4.0 * std::hypot(e.standard_error, first.standard_error));
        EXPECT_LT(e.detectable(), 0.02 * e.mean);
    }
}

// Straight from the camera: what is behind has the bounce that it would have without the pane
TEST(ThinWall, CameraLooksThrough) {
    TestScene test;
    test.add_square(-1.0f, 1.0f, test.add_material(window_glass()));
    test.add_square(-2.0f, 1.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
    const RenderedLayers layers = render(test, {.size = 16, .samples = 256});
    for (int c = 0; c < 3; ++c)
        expect_close(layers.bounce(0, -1, c), straight_share(1.0, c), 5e-2,
                     fmt::format("glowing wall behind a pane, channel {}", c));
}

// Both sides of translucent paper under a sun: reflection on one, transmission on the other
TEST(ThinWall, PaperGlowsFromBehind) {
    for (const bool from_behind : {false, true}) {
        scene::Material paper;
        paper.has_specular = false;
        paper.diffuse_color = scene::Input(Rgb(0.8f));
        paper.thin_walled = true;
        paper.diffuse_transmission = scene::Input(0.25f);
        paper.diffuse_transmission_color = scene::Input(Rgb(0.6f, 0.5f, 0.4f));
        TestScene test;
        test.add_square(-1.0f, 1.0f, test.add_material(paper));
        Mat4d turn;
        if (from_behind) turn.setAxisAngle(Vec3d(1, 0, 0), pi_d);
        test.add_light(scene::LightKind::Dome, turn);
        // A dome lights both sides; a dark wall covers one
        test.add_square(from_behind ? 0.5f : -1.5f, 200.0f, test.add_matte(Rgb(0.0f)));
        const double expected = from_behind ? 0.25 * double(0.5f) : 0.75 * double(0.8f);
        expect_close(render(test, {.size = 32, .samples = 256}).bounce(1, 0, 1), expected, 1e-2,
                     from_behind ? "paper, lit from behind" : "paper, lit from the front");
    }
}

// docs/engineering/hard_cases.md H31: a ball of paper in a dome of radiance 1 is not to be seen
TEST(ThinWall, FurnaceOfPaperAndGlass) {
    for (const float roughness : {0.0f, 0.4f}) {
        scene::Material sheet;
        sheet.diffuse_color = scene::Input(Rgb(1.0f));
        sheet.roughness = scene::Input(roughness);
        sheet.opacity = scene::Input(0.5f);
        sheet.thin_walled = true;
        sheet.rough_transmission = true;
        sheet.diffuse_transmission = scene::Input(0.5f);
        TestScene test;
        test.add_sphere(Vec3(0.0f, 0.0f, -4.0f), 1.0, test.add_material(sheet));
        test.add_light(scene::LightKind::Dome, Mat4d()).is_camera_visible = true;
        test.look_with_perspective(0.16);
        expect_close(render(test, {.size = 32, .samples = 512}).beauty(), 1.0, 5e-3,
                     fmt::format("ball of paper and glass, roughness {}", roughness));
    }
}

// Interfaces of index 1 are looked through as well
TEST(ThinWall, IndexOneIsLookedThrough) {
    scene::Material nothing = smooth_glass(1.0f);
    TestScene test = patch_below_pane(nothing, 2);
    test.scene.shapes.back().flip_normals = true;
    scene::Light& sun = test.add_light(scene::LightKind::Distant, Mat4d());
    sun.angle_deg = 0.0f;
    TestScene open = patch_below_pane(nothing, 0);
    open.add_light(scene::LightKind::Distant, Mat4d()).angle_deg = 0.0f;
    expect_close(render(test, {.size = 8, .samples = 4}).bounce(1),
                 render(open, {.size = 8, .samples = 4}).bounce(1).mean, 1e-6,
                 "sun through index 1");
}

}  // namespace velatura::test
