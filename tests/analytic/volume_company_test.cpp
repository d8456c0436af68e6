// SPDX-License-Identifier: Apache-2.0
// Volumes among lights with rules of their own, caustics, bodies that absorb; and what of them is
// written.
#include "hard_case.h"
#include "volume_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace velatura::test {

TEST(Volumes, GiveAlphaAndFirstHits) {
    TestScene test;
    add_slab(test, 0.5f).optics.albedo = Rgb(0.3f);
    test.look_at_point(0.1);
    const RenderedLayers layers = render(test, {.size = 16, .samples = 256});
    double alpha = 0, weight = 0;
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) {
            const accumulate::Triple t =
                layers.film.sums().total(x, y, accumulate::AccumulatorTable::coverage);
            alpha += t.x;
            weight += t.y;
        }
    EXPECT_NEAR(alpha / weight, 1 - std::exp(-0.5), 0.01);
}

TEST(Volumes, CountScatteringsAsBounces) {
    TestScene test = furnace(white(0.0f), 3.0f);
    const RenderedLayers all = render(test, {.size = 16, .samples = 128, .last_bounce = 3});
    const RenderedLayers two =
        render(test, {.size = 16, .samples = 128, .last_bounce = 3, .max_depth = 2});
    for (int k = 0; k <= 2; ++k) {
        EXPECT_GT(all.bounce(k).mean, 0.0) << k;
        EXPECT_NEAR(all.bounce(k).mean, two.bounce(k).mean, 1e-9) << k;
    }
    EXPECT_EQ(two.bounce(3).mean, 0.0);
}

TEST(H37Trackers, VolumesOfNothingChangeNoBit) {
    TestScene test;
    test.add_square(-4.0f, 5.0f, test.add_matte(Rgb(0.6f)));
    add_sun(test);
    test.look_with_perspective(0.25);
    const RenderedLayers without = render(test, {.size = 16, .samples = 16});
    add_volume(test.scene, smoke(0.0f));
    const RenderedLayers with = render(test, {.size = 16, .samples = 16});
    hardcase::expect_within({"picture with a volume of zeros, less that without",
                             std::abs(without.beauty().mean - with.beauty().mean), 0, 0,
                             "the picture without"});
    EXPECT_EQ(with.rays.effects.of(scene::Effect::Volumes), 0u);
}

TEST(Volumes, AreLinkedToLightsAsGeometryIs) {
    // A light that the smoke, class 1, is not lit by or casts no shadows of
    for (const bool is_lit : {false, true}) {
        TestScene test;
        scene::Volume& slab = add_slab(test, 1.0f);
        slab.optics.albedo = Rgb(0.5f);
        slab.link = 1;
        test.add_square(-4.0f, 50.0f, test.add_matte(Rgb(1.0f)));
        test.scene.linking.class_count = 2;
        scene::LinkSet floor(2);
        floor.add(0);
        test.scene.linking.sets = {floor};
        scene::Light& sun = add_sun(test);
        (is_lit ? sun.links.casters : sun.links.lit) = 0;
        test.look_at_point(0.1);
        const double T = std::exp(-1.0);
        const double floor_part = T * (is_lit ? 1.0 : T) / pi_d;
        const double smoke_part = is_lit ? 0.5 * (1 - T) / (4 * pi_d) : 0.0;
        expect_close(render(test, {.size = 32, .samples = 256}).bounce(1), floor_part + smoke_part,
                     1e-2, fmt::format("linked, lit {}", is_lit));
    }
}

TEST(Volumes, DimCaustics) {
    // A mirror shows a small bright ball to the floor, once found by paths and once solved for
    const auto scene_of = [] {
        TestScene test;
        add_volume(test.scene, constant_box(Vec3d(-100, -100, -4.5), Vec3d(100, 100, -1.5), 0.3f))
            .optics.albedo = Rgb(0.3f);
        test.add_square(-5.0f, 2.0f, test.add_matte(Rgb(0.8f)));
        test.add_sphere(Vec3(1.5f, 0, -3), 0.7, test.add_material(mirror(Rgb(0.9f))));
        scene::Light& ball = test.add_light(LightKind::Sphere, at(Vec3d(-1, 1, -3)));
        ball.radius = 0.3f;
        ball.Le = Rgb(4.0f);
        test.look_with_perspective(0.3);
        return test;
    }();
    const RenderedLayers paths =
        render(scene_of, {.size = 24, .samples = 1024, .last_bounce = 3, .max_depth = 3});
    const RenderedLayers solved = render(scene_of, {.size = 24,
                                                    .samples = 1024,
                                                    .last_bounce = 3,
                                                    .max_depth = 3,
                                                    .seed = 2,
                                                    .caustics = integrator::Caustics::Manifold});
    EXPECT_GT(solved.rays.caustics_found, 1000u);
    const Estimate a = paths.bounce(2), b = solved.bounce(2);
    EXPECT_NEAR(a.mean, b.mean, 4 * std::hypot(a.standard_error, b.standard_error));
    expect_agreement(paths, solved, 5e-2, "caustics through smoke");
}

TEST(Volumes, WithinBodiesThatAbsorbAreDimmedByBoth) {
    // The camera in colored glass of index 1 without end, before smoke that glows: ε/(σ + a)·(1 −
    // e^−(σ+a)d)·e^−a·b
    TestScene test;
    scene::Material glass;
    glass.ior = scene::Input(1.0f);
    glass.opacity = scene::Input(0.0f);
    glass.diffuse_color = scene::Input(Rgb(0.0f));
    glass.transmission_color = scene::Input(Rgb(std::exp(-0.4f)));
    glass.transmission_depth = 1.0f;
    test.add_faceted_ball(40.0f, test.add_material(glass));
    scene::Volume& glow =
        add_volume(test.scene, constant_box(Vec3d(-9, -9, -3), Vec3d(9, 9, -1), 0.6f));
    glow.emission = add_field(test.scene, constant_box(Vec3d(-9, -9, -3), Vec3d(9, 9, -1), 1.0f));
    test.scene.volumes[0].optics.emission = Rgb(1.0f);
    test.look_at_point(0.1);
    const double expected = std::exp(-0.4) * (1 - std::exp(-2.0)) / 1.0;
    expect_close(render(test, {.size = 32, .samples = 1024}).bounce(0), expected, 1e-2,
                 "glow and smoke within glass");
}

TEST(Volumes, CastShadowsWithRulesOfTheirOwn) {
    // A light whose shadows are lifted by a color, and one whose shadows end before the smoke
    for (const float end : {std::numeric_limits<float>::infinity(), 0.5f}) {
        TestScene test;
        add_slab(test, 1.0f);
        test.add_square(-4.0f, 50.0f, test.add_matte(Rgb(1.0f)));
        scene::Light& sun = add_sun(test);
        sun.links.shadow_color = Rgb(0.25f);
        sun.links.shadow_distance = end;
        test.look_at_point(0.1);
        const double T = std::exp(-1.0), arrives = end < 1.0f ? 1.0 : T + (1 - T) * 0.25;
        expect_close(render(test, {.size = 32, .samples = 256}).bounce(1), T * arrives / pi_d, 1e-2,
                     fmt::format("own shadow, ends at {}", end));
    }
}

}  // namespace velatura::test
