// SPDX-License-Identifier: Apache-2.0
// Images of volumes against closed forms (H34, H35) and furnaces.
#include "hard_case.h"
#include "volume_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::test {

TEST(VolumeFurnace, WhiteSmokeKeepsAllLight) {
    for (const float g : {0.0f, 0.8f, -0.5f}) {
        expect_close(
            render(furnace(white(g)), {.size = 16, .samples = 64, .estimator = by_paths}).beauty(),
            1.0, 1e-6, fmt::format("white smoke by paths, g {}", g));
        expect_close(render(furnace(white(g)), {.size = 32, .samples = 128}).beauty(), 1.0, 2e-2,
                     fmt::format("white smoke, g {}", g));
    }
}

TEST(VolumeFurnace, ColoredExtinctionKeepsAllLight) {
    const RenderedLayers layers =
        render(furnace(white(0.3f, Rgb(1.0f, 0.4f, 0.1f))), {.size = 32, .samples = 256});
    for (int c = 0; c < 3; ++c)
        expect_close(layers.beauty(c), 1.0, 2e-2,
                     fmt::format("colored white smoke, channel {}", c));
}

TEST(H35ThickMedia, WhiteSlabReflectsAndTransmitsAll) {
    TestScene test;
    add_slab(test, 100.0f).optics = white(0.0f);
    test.add_light(LightKind::Dome, Mat4d()).is_camera_visible = true;
    test.look_with_perspective(0.2);
    // Roulette would end one path in 1024 at each scattering behind the first 1024, and weigh the
    // others more
    const RenderedLayers layers =
        render(test, {.size = 16,
                      .samples = 16,
                      .estimator = {.light_sampling = integrator::LightSampling::Bsdf,
                                    .roulette = integrator::Roulette::None}});
    expect_close(layers.beauty(), 1.0, 1e-3, "slab of 100 mean free paths, R + T");
    hardcase::expect_within({"flights and paths that were cut",
                             double(layers.rays.tracking.capped + layers.rays.depth_limited), 0, 0,
                             "counters"});
}

TEST(Volumes, LightSeenThroughASlabIsTheClosedForm) {
    for (const double tau : {0.1, 2.0}) {
        TestScene test;
        add_slab(test, float(tau));
        test.add_light(LightKind::Dome, Mat4d()).is_camera_visible = true;
        test.look_at_point(0.1);
        const RenderedLayers layers = render(test, {.size = 32, .samples = 256});
        expect_close(layers.bounce(0), std::exp(-tau), 5e-3,
                     fmt::format("dome behind tau {}", tau));
        expect_close(layers.beauty(), std::exp(-tau), 5e-3, "nothing else");
    }
}

TEST(H34ThinMedia, ScatterOnce) {
    // Light and camera on the same side: albedo · p · (1 − e^−2τ) / 2
    constexpr double tau = 1e-3, albedo = 0.8, g = 0.5;
    TestScene test;
    scene::VolumeOptics& optics = add_slab(test, float(tau)).optics;
    optics.albedo = Rgb(float(albedo));
    optics.anisotropy = float(g);
    add_sun(test);
    test.look_at_point(0.1);
    const double back = (1 - g * g) / (4 * pi_d * std::pow(1 + g, 3.0));
    const double expected = -albedo * back * std::expm1(-2 * tau) / 2;
    const Estimate once =
        over_seeds(test, {.size = 4, .samples = hardcase::sized(1 << 15, 1 << 20, 1 << 22)}, 4,
                   [](const RenderedLayers& l) { return l.bounce(1).mean; });
    hardcase::expect_within({"smoke of depth 1e-3: light scattered once, relative",
                             std::abs(once.mean / expected - 1), thin_media_bound(),
                             once.detectable() / expected, "closed form"});
}

TEST(Volumes, SmokeScattersOnceAsMuchAsItShould) {
    constexpr double tau = 1.5, albedo = 0.6;
    TestScene test;
    add_slab(test, float(tau)).optics.albedo = Rgb(float(albedo), 0.0f, 1.0f);
    add_sun(test);
    test.look_at_point(0.1);
    const RenderedLayers layers = render(test, {.size = 32, .samples = 256});
    const double once = -std::expm1(-2 * tau) / (8 * pi_d);
    expect_close(layers.bounce(1, -1, 0), albedo * once, 1e-2, "slab, light scattered back once");
    expect_close(layers.bounce(1, -1, 2), once, 1e-2, "slab, blue");
    // Without occlusion light meets the point undimmed
    expect_close(layers.unoccluded(0), -albedo * std::expm1(-tau) / (4 * pi_d), 1e-2,
                 "slab, light scattered once, unoccluded");
}

TEST(Volumes, DimTheLightOfSurfacesAndTheirView) {
    // Light and view of a floor both go through the slab, which is turned and placed by a matrix
    TestScene test;
    Mat4d turned;
    turned.rotate(Vec3d(0.0, 0.0, 0.7));
    scene::Volume& slab = add_volume(
        test.scene, constant_box(Vec3d(-100, -100, 0), Vec3d(100, 100, 0.5), 0.8f), turned);
    slab.render_from_volume = slab.render_from_volume * at(Vec3d(3, 1, -3));
    test.add_square(-4.0f, 50.0f, test.add_matte(Rgb(0.5f)));
    add_sun(test);
    test.look_at_point(0.1);
    const RenderedLayers layers = render(test, {.size = 32, .samples = 256});
    expect_close(layers.bounce(1), 0.5 / pi_d * std::exp(-0.8), 1e-2, "floor through smoke");
    expect_close(layers.unoccluded(0), 0.5 / pi_d * std::exp(-0.4), 1e-2,
                 "floor through smoke, unoccluded");
}

TEST(Volumes, AreLookedThroughBehindCutOuts) {
    TestScene test;
    add_slab(test, 0.7f);
    scene::Material lattice;
    lattice.presence = true;
    lattice.opacity = scene::Input(0.25f);
    test.add_square(-1.0f, 50.0f, test.add_material(lattice));
    test.add_square(-4.0f, 50.0f, test.add_matte(Rgb(1.0f)));
    add_sun(test);
    test.look_at_point(0.1);
    // Through the lattice and the smoke, twice each; the lattice itself is lit in front of it
    const double floor = 0.75 * 0.75 * std::exp(-1.4) / pi_d, front = 0.25 * 0.18 / pi_d;
    const RenderedLayers layers =
        render(test, {.size = 32, .samples = 512, .last_bounce = 1, .max_depth = 1});
    const double specular = render(
                                [&] {
                                    TestScene alone;
                                    alone.add_square(-1.0f, 50.0f, alone.add_material(lattice));
                                    add_sun(alone);
                                    alone.look_at_point(0.1);
                                    return alone;
                                }(),
                                {.size = 32, .samples = 512, .last_bounce = 1, .max_depth = 1})
                                .bounce(1)
                                .mean;
    EXPECT_GT(specular, 0.5 * front);
    expect_close(layers.bounce(1), floor + specular, 1e-2, "floor behind lattice and smoke");
}

TEST(Volumes, TwoWaysToFindLightAgree) {
    const auto scene_of = [](const Rgb& extinction) {
        TestScene test;
        scene::VolumeOptics optics = white(0.6f, extinction);
        optics.albedo = Rgb(0.9f, 0.8f, 0.5f);
        add_volume(test.scene, smoke(4.0f)).optics = optics;
        Mat4d turned;
        turned.rotate(Vec3d(-pi_d / 2, 0, 0));
        scene::Light& lamp = test.add_light(LightKind::Rect, turned * at(Vec3d(0, 1.5, -4)));
        lamp.width = lamp.height = 3.0f;
        scene::Light& ball = test.add_light(LightKind::Sphere, at(Vec3d(1.2, -0.5, -4)));
        ball.radius = 0.4f;
        ball.Le = Rgb(0.5f, 1.0f, 2.0f);
        test.add_square(-6.0f, 5.0f, test.add_matte(Rgb(0.6f)));
        test.look_with_perspective(0.25);
        return test;
    };
    for (const Rgb& extinction : {Rgb(1.0f), Rgb(1.0f, 0.5f, 0.25f)}) {
        const TestScene test = scene_of(extinction);
        expect_strategies_agree(test, 1);
    }
}

TEST(H37Trackers, OneMajorantGivesTheSameImage) {
    TestScene test;
    add_volume(test.scene, smoke(4.0f)).optics = white(0.0f);
    add_sun(test);
    test.look_with_perspective(0.25);
    const RenderedLayers bricks = render(test, {.size = 32, .samples = 128});
    const RenderedLayers one = render(
        test,
        {.size = 32, .samples = 128, .seed = 2, .media = {.majorants = media::Majorants::One}});
    expect_agreement(bricks, one, 4e-2, "bounds by bricks and one bound");
    EXPECT_EQ(bricks.rays.tracking.violations + one.rays.tracking.violations, 0u);
}

TEST(H36LowMajorants, AreNoticedInAnImage) {
    TestScene test;
    add_volume(test.scene, smoke(4.0f)).optics = white(0.0f);
    add_sun(test);
    test.look_with_perspective(0.25);
    Diagnostics diagnostics;
    const integrator::World world(
        test.scene, {.width = 8, .height = 8, .media = {.majorant_factor = 0.5f}}, {}, diagnostics);
    film::LayerSet layers;
    for (const scene::LightGroup& g : test.scene.groups)
        layers.groups.push_back({g.name, g.prims, g.is_environment});
    const integrator::PathTracer tracer(world, layers, {});
    film::SampleRadiance out(layers);
    integrator::RayCounts counts;
    for (uint64_t i = 0; i < 64; ++i) {
        out.clear();
        tracer.trace(4, 4, i, out, counts);
    }
    hardcase::expect_within({"64 paths with half the bound: violations that none noticed",
                             counts.tracking.violations > 0 ? 0.0 : 1.0, 0, 0, "counter"});
}

TEST(Volumes, AreSeenFromWithin) {
    // The camera in the middle of smoke that glows: ε/σ (1 − e^−σr) along every ray
    TestScene test;
    scene::Volume& glow =
        add_volume(test.scene, constant_box(Vec3d(-50, -50, -2), Vec3d(50, 50, 3), 1.0f));
    glow.emission =
        add_field(test.scene, constant_box(Vec3d(-50, -50, -2), Vec3d(50, 50, 3), 0.5f));
    test.scene.volumes[0].optics.emission = Rgb(1.0f);
    test.look_at_point(0.1);
    const RenderedLayers layers = render(test, {.size = 32, .samples = 1024});
    expect_close(layers.bounce(0), 0.5 * (1 - std::exp(-2.0)), 1e-2, "glow around the camera");
}

TEST(Volumes, GlowLightsSurfaces) {
    // A floor below an endless glowing layer without absorption sees it over every direction: the
    // radiance is ε·h / cosθ, the irradiance 2π·ε·h, but for what the sides of the layer miss
    constexpr double h = 0.1, side = 100, distance = 0.5;
    TestScene test;
    scene::Volume& layer = add_volume(
        test.scene, constant_box(Vec3d(-side, -side, -3), Vec3d(side, side, -3 + h), 0.0f));
    layer.emission = add_field(
        test.scene, constant_box(Vec3d(-side, -side, -3), Vec3d(side, side, -3 + h), 1.0f));
    test.scene.volumes[0].optics.emission = Rgb(1.0f);
    test.add_square(float(-3 - distance), 90.0f, test.add_matte(Rgb(1.0f)));
    test.look_at_point(0.1);
    const double missed = distance / (side * std::sqrt(2.0));
    const RenderedLayers layers = render(test, {.size = 32, .samples = 1024});
    const Estimate once = layers.bounce(1);
    EXPECT_NEAR(once.mean, 2 * h, 4 * once.standard_error + 2 * h * missed * 2);
    EXPECT_LT(once.standard_error, 0.01 * 2 * h);
}

}  // namespace velatura::test
