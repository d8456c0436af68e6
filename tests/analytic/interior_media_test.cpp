// SPDX-License-Identifier: Apache-2.0
// Bodies filled with matter that scatters, with and without surfaces: closed forms, furnaces, and
// the same matter given as a volume.
#include "hard_case.h"
#include "volume_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::test {

namespace {

constexpr float absorbed[3] = {0.2f, 0.6f, 1.5f};
constexpr float scattered[3] = {0.9f, 0.3f, 0.5f};

const scene::MediumProperties murk{Rgb(absorbed[0], absorbed[1], absorbed[2]),
                                   Rgb(scattered[0], scattered[1], scattered[2]), 0.4f};

scene::MediumProperties white_matter(const Rgb& scattering, float g = 0.0f) {
    return {Rgb(0.0f), scattering, g};
}

double left_after(double distance, int c) {
    return std::exp(-double(absorbed[c] + scattered[c]) * distance);
}

/// A body that has no surface.
scene::Material bare(const scene::MediumProperties& interior) {
    scene::Material m = smooth_glass(1.0f);
    m.has_specular = false;
    m.is_bare = true;
    m.interior = interior;
    return m;
}

scene::Material filled(scene::Material surface, const scene::MediumProperties& interior) {
    surface.interior = interior;
    return surface;
}

void add_body_slab(TestScene& test, float top, float bottom, scene::MaterialId material) {
    test.add_box(Vec3(-100, -100, bottom), Vec3(100, 100, top), material);
}

void add_dome(TestScene& test) {
    test.add_light(LightKind::Dome, Mat4d()).is_camera_visible = true;
}

/// Lamps around a place that scatters: one large, one small.
void add_lamps(TestScene& test) {
    Mat4d turned;
    turned.rotate(Vec3d(-pi_d / 2, 0, 0));
    scene::Light& lamp = test.add_light(LightKind::Rect, turned * at(Vec3d(0, 2.5, -4)));
    lamp.width = lamp.height = 3.0f;
    scene::Light& ball = test.add_light(LightKind::Sphere, at(Vec3d(0.4, -0.3, -4)));
    ball.radius = 0.2f;
    ball.Le = Rgb(0.5f, 1.0f, 2.0f);
}

}  // namespace

TEST(InteriorMedia, PassWhatTheClosedFormSays) {
    TestScene test;
    add_body_slab(test, -2.0f, -2.6f, test.add_material(bare(murk)));
    add_dome(test);
    test.look_at_point(0.1);
    const RenderedLayers layers = render(test, {.size = 32, .samples = 1024});
    for (int c = 0; c < 3; ++c)
        expect_close(layers.bounce(0, -1, c), left_after(0.6, c), 1e-2,
                     fmt::format("dome behind bare matter, channel {}", c));
    EXPECT_GT(layers.rays.effects.of(scene::Effect::InteriorMedia), 0u);
}

TEST(InteriorMedia, AbsorbWithoutScatteringByTheClosedFormAlone) {
    TestScene test;
    add_body_slab(test, -2.0f, -2.5f,
                  test.add_material(bare({Rgb(0.5f, 1.0f, 4.0f), Rgb(0.0f), 0.0f})));
    add_dome(test);
    test.look_at_point(0.1);
    const RenderedLayers layers = render(test, {.size = 8, .samples = 4});
    for (int c = 0; c < 3; ++c) {
        const double sigma = c == 0 ? 0.5 : c == 1 ? 1.0 : 4.0;
        EXPECT_NEAR(layers.beauty(c).mean, std::exp(-0.5 * sigma), 1e-5 * std::exp(-0.5 * sigma));
    }
    EXPECT_EQ(layers.rays.effects.of(scene::Effect::InteriorMedia), 0u);
}

// What thin matter scatters once, light and camera on one side: albedo · p · (1 − e^−2τ) / 2
TEST(H34ThinMedia, OfBodiesScatterOnce) {
    constexpr double tau = 1e-3, g = 0.5;
    TestScene test;
    add_body_slab(test, -2.0f, -3.0f, test.add_material(bare({Rgb(2e-4f), Rgb(8e-4f), float(g)})));
    add_sun(test);
    test.look_at_point(0.1);
    const double back = (1 - g * g) / (4 * pi_d * std::pow(1 + g, 3.0));
    const double expected = -0.8 * back * std::expm1(-2 * tau) / 2;
    const Estimate once =
        over_seeds(test, {.size = 4, .samples = hardcase::sized(1 << 15, 1 << 21, 1 << 22)}, 4,
                   [](const RenderedLayers& l) { return l.bounce(1).mean; });
    hardcase::expect_within({"body of depth 1e-3: light scattered once, relative",
                             std::abs(once.mean / expected - 1), thin_media_bound(),
                             once.detectable() / expected, "closed form"});
}

TEST(InteriorMedia, CountScatteringsAsBounces) {
    TestScene test;
    add_body_slab(test, -2.0f, -3.5f, test.add_material(bare(murk)));
    add_sun(test);
    test.look_at_point(0.1);
    const RenderedLayers all = render(test, {.size = 16, .samples = 256, .last_bounce = 3});
    const RenderedLayers two =
        render(test, {.size = 16, .samples = 256, .last_bounce = 3, .max_depth = 2});
    for (int c = 0; c < 3; ++c) {
        const double sigma = double(absorbed[c] + scattered[c]),
                     albedo = double(scattered[c]) / sigma;
        const double back = (1 - 0.16) / (4 * pi_d * std::pow(1.4, 3.0));
        expect_close(all.bounce(1, -1, c), -albedo * back * std::expm1(-3 * sigma) / 2, 5e-2,
                     fmt::format("scattered once, channel {}", c));
    }
    for (int k = 1; k <= 2; ++k) EXPECT_NEAR(all.bounce(k).mean, two.bounce(k).mean, 1e-9) << k;
    EXPECT_EQ(two.bounce(3).mean, 0.0);
}

TEST(InteriorMediaFurnace, KeepsAllLight) {
    scene::Material blurred = smooth_glass(1.4f);
    blurred.rough_transmission = true;
    blurred.roughness = scene::Input(0.4f);
    const Rgb gray(2.0f), colors(1.5f, 1.0f, 0.75f);

    const struct {
        const char* name;
        scene::Material material;
        double allowed;
    } cases[] = {
        {"bare", bare(white_matter(colors, 0.5f)), 5e-3},
        {"glass", filled(smooth_glass(1.5f), white_matter(gray)), 5e-3},
        {"glass, in colors", filled(smooth_glass(1.5f), white_matter(colors, -0.4f)), 5e-3},
        {"rough glass", filled(blurred, white_matter(colors)), 5e-3}};

    for (const auto& [name, material, allowed] : cases) {
        TestScene test;
        test.add_faceted_ball(1.0f, test.add_material(material));
        test.make_instance(Mat4(at(Vec3d(0, 0, -4))));
        add_dome(test);
        test.look_with_perspective(0.2);
        const RenderedLayers layers =
            render(test, {.size = 24,
                          .samples = 1024,
                          .estimator = {.light_sampling = integrator::LightSampling::Bsdf,
                                        .roulette = integrator::Roulette::None}});
        for (int c = 0; c < 3; ++c)
            expect_close(layers.beauty(c), 1.0, allowed, fmt::format("{}, channel {}", name, c));
        EXPECT_EQ(layers.rays.depth_limited, 0u);
    }
}

TEST(H35ThickMedia, WhiteBodyReflectsAndTransmitsAll) {
    TestScene test;
    add_body_slab(test, -2.0f, -3.0f, test.add_material(bare(white_matter(Rgb(100.0f)))));
    add_dome(test);
    test.look_with_perspective(0.2);
    const RenderedLayers layers =
        render(test, {.size = 16,
                      .samples = 16,
                      .estimator = {.light_sampling = integrator::LightSampling::Bsdf,
                                    .roulette = integrator::Roulette::None}});
    expect_close(layers.beauty(), 1.0, 1e-3, "slab of 100 mean free paths, R + T");
    EXPECT_EQ(layers.rays.depth_limited, 0u);
}

TEST(InteriorMedia, TwoWaysToFindLightAgree) {
    TestScene test;
    test.add_box(Vec3(-1, -1, -5), Vec3(1, 1, -3), test.add_material(bare(murk)));
    add_lamps(test);
    test.add_square(-6.0f, 5.0f, test.add_matte(Rgb(0.6f)));
    test.look_with_perspective(0.3);
    expect_strategies_agree(test, 0);
}

// The same matter as the inside of a body and as a volume
TEST(InteriorMedia, AgreeWithAVolumeOfTheSameDensity) {
    const Vec3 lo(-1, -1, -5), hi(1, 1, -3);
    const auto scene_of = [&](float of_body, float of_volume) {
        TestScene test;
        scene::MediumProperties part = murk;
        part.absorption *= of_body;
        part.scattering *= of_body;
        if (of_body > 0.0f) test.add_box(lo, hi, test.add_material(bare(part)));
        if (of_volume > 0.0f) {
            scene::Volume& volume =
                add_volume(test.scene, constant_box(Vec3d(lo), Vec3d(hi), of_volume));
            const Rgb sigma_t = murk.absorption + murk.scattering;
            volume.optics.extinction_color = sigma_t;
            volume.optics.albedo = murk.scattering / sigma_t;
            volume.optics.anisotropy = murk.anisotropy;
        }
        add_lamps(test);
        test.add_square(-6.0f, 5.0f, test.add_matte(Rgb(0.6f)));
        test.look_with_perspective(0.3);
        return test;
    };
    const RenderedLayers volume = render(scene_of(0.0f, 1.0f), {.size = 24, .samples = 768});
    for (const float share : {1.0f, 0.5f}) {
        const RenderedLayers body =
            render(scene_of(share, 1.0f - share), {.size = 24, .samples = 768, .seed = 2});
        expect_agreement(body, volume, 3e-2, fmt::format("{} of it in the body", share));
        for (int k = 0; k <= 3; ++k) {
            for (int c = 0; c < 3; ++c) {
                const Estimate a = body.bounce(k, -1, c), b = volume.bounce(k, -1, c);
                EXPECT_NEAR(a.mean, b.mean, 4.0 * std::hypot(a.standard_error, b.standard_error))
                    << k << " " << c;
            }
        }
    }
}

// What fills a body within another takes the place of what is around it
TEST(InteriorMedia, AreDisplacedByBodiesWithin) {
    for (const int priority : {0, 3}) {
        TestScene test;
        add_body_slab(test, -2.0f, -4.0f, test.add_material(bare(murk)));
        scene::Material clear = smooth_glass(1.0f);
        clear.dielectric_priority = priority;
        add_body_slab(test, -2.5f, -3.5f, test.add_material(clear));
        add_dome(test);
        test.look_at_point(0.1);
        const RenderedLayers layers =
            render(test, {.size = 32, .samples = 256, .last_bounce = 0, .max_depth = 1});
        for (int c = 0; c < 3; ++c)
            expect_close(layers.bounce(0, -1, c), left_after(1.0, c), 2e-2,
                         fmt::format("a gap in matter, priority {}, channel {}", priority, c));
    }
}

TEST(InteriorMedia, AreSeenFromWithin) {
    TestScene test;
    add_body_slab(test, 2.0f, -0.6f, test.add_material(bare(murk)));
    add_dome(test);
    test.look_at_point(0.1);
    const RenderedLayers layers = render(test, {.size = 32, .samples = 1024});
    for (int c = 0; c < 3; ++c)
        expect_close(layers.bounce(0, -1, c), left_after(0.6, c), 1e-2,
                     fmt::format("camera in matter, channel {}", c));
}

// Distances are those of the world, whatever places the body
TEST(InteriorMedia, InstancesScaleTheDistance) {
    TestScene test;
    test.add_box(Vec3(-1, -1, -0.1f), Vec3(1, 1, 0.1f), test.add_material(bare(murk)));
    Mat4d m;
    m.setScale(Vec3d(1.0, 1.0, 3.0));
    test.make_instance(Mat4(m * at(Vec3d(0, 0, -2))));
    add_dome(test);
    test.look_at_point(0.1);
    const RenderedLayers layers = render(test, {.size = 32, .samples = 1024});
    for (int c = 0; c < 3; ++c)
        expect_close(layers.bounce(0, -1, c), left_after(0.6, c), 1e-2,
                     fmt::format("matter in an instance, channel {}", c));
}

// A light that the matter, class 1, is not lit by; it still dims what is behind it
TEST(InteriorMedia, AreLinkedToLightsAsGeometryIs) {
    TestScene test;
    add_body_slab(test, -2.0f, -3.0f, test.add_material(bare({Rgb(0.5f), Rgb(0.5f), 0.0f})));
    test.scene.shapes.back().link = 1;
    test.add_square(-4.0f, 50.0f, test.add_matte(Rgb(1.0f)));
    test.scene.linking.class_count = 2;
    scene::LinkSet floor(2);
    floor.add(0);
    test.scene.linking.sets = {floor};
    add_sun(test).links.lit = 0;
    test.look_at_point(0.1);
    expect_close(render(test, {.size = 32, .samples = 256}).bounce(1), std::exp(-2.0) / pi_d, 2e-2,
                 "floor behind matter that is not lit");
}

}  // namespace velatura::test
