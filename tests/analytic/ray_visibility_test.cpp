// SPDX-License-Identifier: Apache-2.0
// Geometry that is invisible to rays of some kinds, and matte objects, through the whole
// integrator. Oracles: closed forms, and scenes without what is invisible.
#include "strategies.h"
#include "test_scene.h"
#include "volume_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

namespace velatura::test {

namespace {

using integrator::LightSampling;
using scene::LinkSet;
using scene::RayKind;
using scene::RayKinds;

constexpr float lamp_z = -0.25f;
constexpr float patch_z = -1.25f;  ///< one unit below the lamp
constexpr float blocker_z = -0.75f;
/// Irradiance of a point one unit below the center of a 2×2 square of radiance 1: 4·√½·atan √½.
constexpr double square_irradiance = 1.7408395;

RayKinds only(std::initializer_list<RayKind> list) {
    RayKinds kinds;
    for (const RayKind kind : list) kinds = kinds.with(kind);
    return kinds;
}

scene::LinkSetId add_set(scene::Scene& scene, const LinkSet& set) {
    scene.linking.sets.push_back(set);
    return scene::LinkSetId(scene.linking.sets.size() - 1);
}

/// Hides what is of class 1 from rays of these kinds, once all lights are there.
void hide_from(scene::Scene& scene, RayKinds kinds) {
    scene.linking.class_count = 2;
    LinkSet others(2), all(2);
    others.add(0);
    all.add(0);
    all.add(1);
    const scene::LinkSetId rest = add_set(scene, others), everything = add_set(scene, all);
    for (size_t k = 0; k < scene::ray_kind_count; ++k)
        if (kinds.has(RayKind(k))) scene.linking.visible[k] = rest;
    scene::LinkSetId& shadow = scene.linking.visible[size_t(RayKind::Shadow)];
    if (shadow == scene::none && kinds != only({RayKind::Camera})) shadow = everything;
    for (scene::Light& light : scene.lights) light.links = scene::plain_links(scene);
    for (scene::MeshLight& light : scene.mesh_lights) light.links = scene::plain_links(scene);
}

void make_matte(scene::Scene& scene) {
    scene.linking.class_count = 2;
    LinkSet mattes(2);
    mattes.add(1);
    scene.linking.mattes = add_set(scene, mattes);
}

/// Of the last shape, or of the instance that it became.
void set_class(TestScene& test) {
    test.scene.shapes.back().link = 1;
}

/// What a ray meets in each way that geometry comes in: 0 triangles, 1 a quadric, 2 an instance.
void add_wall(TestScene& test, int way, float z, scene::MaterialId material) {
    if (way == 1) {
        // A ball of such a size that its front is nearly flat
        test.add_sphere(Vec3(0, 0, z - 3.0f), 3.0, material);
        return set_class(test);
    }
    test.add_square(z, 10.0f, material);
    if (way == 0) return set_class(test);
    test.make_instance(Mat4());
    test.scene.linking.rows = {{1}};
    test.scene.instances.back().link_row = 0;
}

scene::Light& add_rect(TestScene& test) {
    scene::Light& light = test.add_light(scene::LightKind::Rect, at(Vec3(0, 0, lamp_z)));
    light.width = light.height = 2.0f;
    return light;
}

void add_lamp(TestScene& test, bool is_mesh_light) {
    if (!is_mesh_light) {
        test.add_square(lamp_z, 1.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
        return;
    }
    test.add_square(lamp_z, 1.0f, test.add_matte(Rgb(0.0f)));
    test.make_mesh_light();
}

/// A white patch below a lamp of one of three kinds, and between them a black wall.
TestScene shaded_patch(int lamp) {
    TestScene test;
    test.add_square(patch_z, 0.01f, test.add_matte(Rgb(1.0f)));
    test.scene.camera.clip_near = 0.9;
    if (lamp == 0)
        add_rect(test);
    else
        add_lamp(test, lamp == 1);
    test.add_square(blocker_z, 3.0f, test.add_matte(Rgb(0.0f)));
    set_class(test);
    return test;
}

RenderedLayers render_direct(const TestScene& test, LightSampling strategy, int bounces = 1) {
    return render(test, {.size = 16,
                         .samples = 1024,
                         .last_bounce = bounces,
                         .max_depth = bounces,
                         .estimator = {.light_sampling = strategy}});
}

void add_sky(TestScene& test) {
    test.add_light(scene::LightKind::Dome, Mat4d()).is_camera_visible = true;
}

double alpha_of(const RenderedLayers& layers) {
    const film::Film& film = layers.film;
    const film::Window& w = film.window();
    double sum = 0;
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            sum += double(film.sums().total(x, y, accumulate::AccumulatorTable::coverage).x);
    return sum;
}

}  // namespace

TEST(RayVisibility, WhatShadowRaysDoNotSeeCastsNoShadow) {
    for (const LightSampling strategy : strategies) {
        for (int lamp = 0; lamp < 3; ++lamp) {
            TestScene test = shaded_patch(lamp);
            hide_from(test.scene, only({RayKind::Shadow}));
            Estimate irradiance = render_direct(test, strategy).bounce(1);
            irradiance.mean *= pi_d;
            irradiance.standard_error *= pi_d;
            expect_close(irradiance, square_irradiance, 8e-3, name_of(strategy));
        }
    }
}

// Light is a matter of shadow rays, however it is found: paths that go through the wall find none
TEST(RayVisibility, WhatOnlyShadowRaysSeeShadowsForAllStrategies) {
    const RayKinds all_but_shadow = ~only({RayKind::Shadow});
    for (const LightSampling strategy : strategies) {
        for (int lamp = 0; lamp < 3; ++lamp) {
            TestScene test = shaded_patch(lamp);
            hide_from(test.scene, all_but_shadow);
            EXPECT_EQ(render_direct(test, strategy).bounce(1).mean, 0.0)
                << name_of(strategy) << " " << lamp;
        }
    }
}

TEST(RayVisibility, TheCameraLooksThroughWhatItDoesNotSee) {
    for (int way = 0; way < 3; ++way) {
        for (const bool is_hidden : {false, true}) {
            TestScene test;
            add_sky(test);
            add_wall(test, way, -1.0f, test.add_matte(Rgb(0.0f)));
            test.look_at_point(0.01);
            if (is_hidden) hide_from(test.scene, only({RayKind::Camera}));
            const RenderedLayers layers = render(test, {.size = 4, .samples = 4});
            EXPECT_EQ(layers.beauty().mean, is_hidden ? 1.0 : 0.0) << way;
            EXPECT_EQ(alpha_of(layers), is_hidden ? 0.0 : 64.0) << way;
        }
    }
}

// A mirror under a white sky, and a black wall above it, behind the camera
TEST(RayVisibility, AMirrorShowsWhatReflectionsSee) {
    for (int way = 0; way < 3; ++way) {
        for (const RayKind kind : {RayKind::Reflection, RayKind::Diffuse, RayKind::Refraction,
                                   RayKind::Camera, RayKind::Shadow}) {
            TestScene test;
            add_sky(test);
            test.add_square(-3.0f, 0.5f, test.add_material(mirror(Rgb(1.0f))));
            add_wall(test, way, way == 1 ? 7.0f : 1.0f, test.add_matte(Rgb(0.0f)));
            test.look_at_point(0.01);
            hide_from(test.scene, only({kind}));
            EXPECT_EQ(render(test, {.size = 4, .samples = 4}).bounce(1).mean,
                      kind == RayKind::Reflection ? 1.0 : 0.0)
                << way << " " << int(kind);
        }
    }
}

// Glass in front of a black wall shows the reflected share of a white sky, and all of it where
// neither kind of ray sees the wall
TEST(RayVisibility, GlassShowsWhatRefractionsSee) {
    for (const bool is_hidden : {false, true}) {
        TestScene test;
        add_sky(test);
        test.add_box(Vec3(-1, -1, -3), Vec3(1, 1, -2), test.add_material(smooth_glass()));
        add_wall(test, 0, -4.0f, test.add_matte(Rgb(0.0f)));
        test.look_at_point(0.01);
        hide_from(test.scene, is_hidden ? only({RayKind::Refraction}) : only({RayKind::Diffuse}));
        const Estimate seen = render(test, {.size = 16, .samples = 256, .last_bounce = 2}).beauty();
        // Both faces of the slab: 2R / (1 + R)
        constexpr double R = 0.04;
        if (is_hidden)
            expect_close(seen, 1.0, 1e-2, "glass in a furnace");
        else
            expect_close(seen, 2 * R / (1 + R), 5e-2, "glass before a wall");
    }
}

// The lobes of one surface, told apart: the specular one is the same with a black base
TEST(RayVisibility, LobesMeetWhatTheirRaysSee) {
    const auto bounced = [](float base, std::optional<RayKind> hidden) {
        TestScene test;
        scene::Material floor;
        floor.diffuse_color = scene::Input(Rgb(base));
        floor.roughness = scene::Input(0.5f);
        test.add_square(-2.0f, 0.02f, test.add_material(floor));
        test.add_box(Vec3(-1.5f, -1, -1.9f), Vec3(-0.2f, 1, -0.5f), test.add_matte(Rgb(0.9f)));
        set_class(test);
        scene::Light& sun = test.add_light(scene::LightKind::Sphere, at(Vec3(2, 0, -1.2f)));
        sun.radius = 0.4f;
        sun.Le = Rgb(10.0f);
        test.look_at_point(0.01);
        if (hidden) hide_from(test.scene, only({*hidden}));
        return render(test, {.size = 32, .samples = 512, .last_bounce = 2, .max_depth = 2})
            .bounce(2);
    };
    const auto expect_same = [](const Estimate& a, const Estimate& b, double factor,
                                const Estimate& minus, const char* what) {
        const double expected = b.mean - factor * minus.mean;
        const double error =
            std::sqrt(a.standard_error * a.standard_error + b.standard_error * b.standard_error +
                      factor * minus.standard_error * minus.standard_error);
        EXPECT_NEAR(a.mean, expected, 4 * error) << what;
        EXPECT_LT(error, 0.02 * expected) << what;
        EXPECT_GT(expected, 0.0) << what;
    };
    const Estimate all = bounced(0.8f, {}), specular = bounced(0.0f, {});
    expect_same(bounced(0.8f, RayKind::Diffuse), specular, 0, specular, "hidden from diffuse");
    expect_same(bounced(0.8f, RayKind::Reflection), all, 1, specular, "hidden from reflections");
}

TEST(RayVisibility, WhatNoPathMeetsLightsAsIfItWereNotThere) {
    const auto floor_light = [](bool has_block) {
        TestScene test;
        test.add_square(-2.0f, 1.0f, test.add_matte(Rgb(0.8f)));
        add_sky(test);
        if (has_block) {
            test.add_box(Vec3(-0.5f, -0.5f, -1.9f), Vec3(0.2f, 0.3f, -1.0f),
                         test.add_matte(Rgb(0.5f), Rgb(0.0f)));
            set_class(test);
            hide_from(test.scene, RayKinds::all());
        }
        test.look_with_perspective(0.3);
        return render(test, {.size = 16, .samples = 64});
    };
    const RenderedLayers without = floor_light(false), with = floor_light(true);
    expect_agreement(without, with, 2e-2, "hidden from all");
}

TEST(Mattes, AreBlackAndWithoutAlphaAndHideWhatIsBehind) {
    for (int way = 0; way < 3; ++way) {
        TestScene test;
        add_sky(test);
        add_wall(test, way, -1.0f, test.add_matte(Rgb(0.8f), Rgb(2.0f)));
        test.look_at_point(0.01);
        make_matte(test.scene);
        const RenderedLayers layers = render(test, {.size = 4, .samples = 4});
        EXPECT_EQ(layers.beauty().mean, 0.0);
        for (int column = 0; column < 5; ++column) EXPECT_EQ(layers.bounce(column).mean, 0.0);
        EXPECT_EQ(layers.unoccluded(0).mean, 0.0);
        EXPECT_EQ(alpha_of(layers), 0.0);
        EXPECT_GT(layers.rays.effects.of(scene::Effect::Mattes), 0u);
    }
}

// A slab of depth 1 in front of a white sky, above a white floor that the sun lights
TEST(RayVisibility, VolumesAreMetByTheRaysThatSeeThem) {
    const auto seen = [](bool has_floor, RayKinds hidden) {
        TestScene test;
        scene::Volume& slab = add_slab(test, 1.0f);
        slab.optics.albedo = Rgb(0.0f);
        slab.link = 1;
        if (has_floor) {
            test.add_square(-4.0f, 10.0f, test.add_matte(Rgb(1.0f)));
            add_sun(test);
        } else {
            add_sky(test);
        }
        test.look_at_point(0.01);
        hide_from(test.scene, hidden);
        return render(test, {.size = 16, .samples = 256, .last_bounce = 1, .max_depth = 1})
            .beauty();
    };
    expect_close(seen(false, only({RayKind::Reflection})), std::exp(-1.0), 2e-2, "seen");
    EXPECT_EQ(seen(false, only({RayKind::Camera})).mean, 1.0);
    const double lit = 1.0 / pi_d;
    EXPECT_NEAR(seen(true, only({RayKind::Camera, RayKind::Shadow})).mean, lit, 1e-6);
    expect_close(seen(true, only({RayKind::Camera})), lit * std::exp(-1.0), 2e-2, "in its shadow");
    expect_close(seen(true, only({RayKind::Shadow})), lit * std::exp(-1.0), 2e-2, "behind it");
}

TEST(Mattes, VolumesHoldOutByTheirDensity) {
    TestScene test;
    scene::Volume& slab = add_slab(test, 1.0f);
    slab.optics.albedo = Rgb(0.9f);
    slab.link = 1;
    add_sky(test);
    test.look_at_point(0.01);
    make_matte(test.scene);
    const RenderedLayers layers = render(test, {.size = 16, .samples = 256});
    expect_close(layers.beauty(), std::exp(-1.0), 2e-2, "sky behind a matte slab");
    EXPECT_EQ(layers.bounce(1).mean, 0.0);
    EXPECT_EQ(alpha_of(layers), 0.0);
}

TEST(Mattes, ShadowAndAreReflectedAsAnythingElse) {
    // Shadow
    TestScene test = shaded_patch(0);
    make_matte(test.scene);
    EXPECT_EQ(render_direct(test, LightSampling::Mis).bounce(1).mean, 0.0);
    // A mirror shows the glowing wall behind the camera
    TestScene mirrored;
    mirrored.add_square(-3.0f, 0.5f, mirrored.add_material(mirror(Rgb(1.0f))));
    add_wall(mirrored, 0, 1.0f, mirrored.add_matte(Rgb(0.0f), Rgb(2.0f)));
    mirrored.look_at_point(0.01);
    make_matte(mirrored.scene);
    EXPECT_EQ(render(mirrored, {.size = 4, .samples = 4}).bounce(1).mean, 2.0);
}

// The camera sees one thing or the other: two images that hold out each other's things add up to
// the image of both
TEST(Mattes, TwoHoldoutsAddUpToTheWhole) {
    const auto scene_of = [](int matte) {
        TestScene test;
        test.add_square(-3.0f, 4.0f, test.add_matte(Rgb(0.7f)));
        test.scene.shapes.back().link = matte == 0 ? 1 : 0;
        test.add_sphere(Vec3(0.3f, 0, -2), 0.7, test.add_material(mirror(Rgb(0.9f))));
        test.scene.shapes.back().link = matte == 1 ? 1 : 0;
        test.add_light(scene::LightKind::Sphere, at(Vec3(1, 2, 0))).Le = Rgb(20.0f);
        test.look_with_perspective(0.5);
        if (matte >= 0) make_matte(test.scene);
        // Trial paths would see other scenes
        return render(test, {.size = 24,
                             .samples = 16,
                             .estimator = {.roulette = integrator::Roulette::Throughput}});
    };
    const RenderedLayers whole = scene_of(-1), without_floor = scene_of(0),
                         without_ball = scene_of(1);
    const accumulate::SampleSums& sums = whole.film.sums();
    double largest = 0;
    for (uint32_t a = 0; a < sums.table().total_count(); ++a) {
        for (int y = 0; y < 24; ++y) {
            for (int x = 0; x < 24; ++x) {
                const double both = double(without_floor.film.sums().total(x, y, a).x) +
                                    double(without_ball.film.sums().total(x, y, a).x);
                const double expected = sums.total(x, y, a).x;
                ASSERT_NEAR(both, expected, 1e-9 * (1 + std::abs(expected))) << a;
                largest = std::max(largest, expected);
            }
        }
    }
    EXPECT_GT(largest, 1.0);
    EXPECT_NEAR(alpha_of(whole), alpha_of(without_floor) + alpha_of(without_ball), 0.0);
    EXPECT_GT(alpha_of(without_floor), 0.0);
    EXPECT_GT(alpha_of(without_ball), 0.0);
}

}  // namespace velatura::test
