// SPDX-License-Identifier: Apache-2.0
// Light and shadow linking, through the whole integrator: closed forms, and scenes without what is
// not linked. By every strategy of finding lights and of choosing among them.
#include "strategies.h"
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::test {

namespace {

using integrator::LightSampling;
using lights::SelectionKind;
using scene::LinkClass;
using scene::LinkSet;
using scene::LinkSetId;

constexpr float lamp_z = -0.25f;
constexpr float patch_z = -1.25f;  ///< one unit below the lamp
constexpr float blocker_z = -0.75f;
/// Irradiance of a point one unit below the center of a 2×2 square of radiance 1:
/// 4·√½·atan √½.
constexpr double square_irradiance = 1.7408395;
/// What a light is linked to.
enum class Link { Patch, Blocker };

/// Sets of one class each: 1 is the patch, 2 what stands above it.
LinkSetId set_of(scene::Scene& scene, std::initializer_list<LinkClass> classes) {
    scene.linking.class_count = 3;
    LinkSet set(3);
    for (const LinkClass c : classes) set.add(c);
    scene.linking.sets.push_back(set);
    return LinkSetId(scene.linking.sets.size() - 1);
}

/// A white patch of class 1 that the camera sees through whatever is above it.
TestScene patch_scene() {
    TestScene test;
    test.add_square(patch_z, 0.01f, test.add_matte(Rgb(1.0f)));
    test.scene.shapes.back().link = 1;
    test.scene.camera.clip_near = 0.9;
    return test;
}

/// Of class 2, between the lamp and the patch.
void add_blocker(TestScene& test, scene::MaterialId material) {
    test.add_square(blocker_z, 3.0f, material);
    test.scene.shapes.back().link = 2;
}

scene::Light& add_rect(TestScene& test, float radiance = 1.0f) {
    scene::Light& light = test.add_light(scene::LightKind::Rect, at(Vec3(0, 0, lamp_z)));
    light.width = light.height = 2.0f;
    light.Le = Rgb(radiance);
    return light;
}

/// A light of 20×20 above everything; as a mesh it also blocks what is behind it.
scene::LightLinks& add_wall(TestScene& test, bool is_mesh) {
    if (is_mesh) {
        test.add_square(1.0f, 10.0f, test.add_matte(Rgb(0.0f)));
        return test.make_mesh_light().links;
    }
    scene::Light& light = test.add_light(scene::LightKind::Rect, at(Vec3(0, 0, 1)));
    light.width = light.height = 20.0f;
    return light.links;
}

scene::MeshLight& add_lamp(TestScene& test) {
    test.add_square(lamp_z, 1.0f, test.add_matte(Rgb(0.0f)));
    return test.make_mesh_light();
}

RenderedLayers render_direct(const TestScene& test,
                             LightSampling strategy,
                             SelectionKind selection = SelectionKind::Tree,
                             uint64_t samples = 1024) {
    return render(test, {.size = 16,
                         .samples = samples,
                         .last_bounce = 1,
                         .max_depth = 1,
                         .estimator = {.light_sampling = strategy},
                         .light_selection = selection});
}

Estimate irradiance(Estimate radiance) {
    radiance.mean *= pi_d;
    radiance.standard_error *= pi_d;
    return radiance;
}

}  // namespace

TEST(LightLinking, ALightThatIsNotLinkedLightsNothing) {
    for (const LightSampling strategy : strategies) {
        for (const bool is_mesh : {false, true}) {
            TestScene test = patch_scene();
            scene::LightLinks& links = is_mesh ? add_lamp(test).links : add_rect(test).links;
            links.lit = set_of(test.scene, {2});
            const RenderedLayers layers = render_direct(test, strategy, SelectionKind::Tree, 16);
            EXPECT_EQ(layers.bounce(1).mean, 0.0) << name_of(strategy);
            EXPECT_EQ(layers.unoccluded(0).mean, 0.0) << name_of(strategy);
        }
    }
}

TEST(LightLinking, EachLightGivesWhatItWouldGiveAlone) {
    for (const LightSampling strategy : strategies) {
        for (const SelectionKind kind :
             {SelectionKind::Uniform, SelectionKind::Power, SelectionKind::Tree}) {
            TestScene test = patch_scene();
            add_rect(test).links.lit = set_of(test.scene, {1});
            add_rect(test, 50.0f).links.lit = set_of(test.scene, {0, 2});
            add_lamp(test).links.lit = test.scene.lights[0].links.lit;
            add_lamp(test).links.lit = test.scene.lights[1].links.lit;
            const RenderedLayers layers = render_direct(test, strategy, kind);
            const std::string what = fmt::format("{} {}", name_of(strategy), int(kind));
            expect_close(irradiance(layers.bounce(1, 0)), square_irradiance, 8e-3, what);
            EXPECT_EQ(layers.bounce(1, 1).mean, 0.0) << what;
            expect_close(irradiance(layers.bounce(1, 2)), square_irradiance, 8e-3, what);
            EXPECT_EQ(layers.bounce(1, 3).mean, 0.0) << what;
        }
    }
}

TEST(LightLinking, TheCameraSeesEveryLight) {
    TestScene test;
    scene::Light& light = test.add_light(scene::LightKind::Sphere, at(Vec3(0, 0, -5)));
    light.radius = 2.0f;
    light.is_camera_visible = true;
    light.links.lit = set_of(test.scene, {});
    EXPECT_EQ(render(test, {.size = 4, .samples = 4}).bounce(0, 0).mean, 1.0);
}

TEST(LightLinking, AMirrorShowsTheLightsThatAreLinkedToIt) {
    for (const bool is_mesh : {false, true}) {
        for (const bool is_linked : {true, false}) {
            TestScene test;
            test.add_square(-3.0f, 10.0f, test.add_material(mirror(Rgb(1.0f))));
            test.scene.shapes.back().link = 1;
            add_wall(test, is_mesh).lit = set_of(test.scene, {is_linked ? 1u : 2u});
            EXPECT_EQ(render(test, {.size = 4, .samples = 4}).bounce(1, 0).mean,
                      is_linked ? 1.0 : 0.0);
        }
    }
}

TEST(ShadowLinking, WhatIsNotLinkedCastsNoShadow) {
    for (const LightSampling strategy : strategies) {
        for (const bool is_mesh : {false, true}) {
            for (const bool casts : {false, true}) {
                TestScene test = patch_scene();
                add_blocker(test, test.add_matte(Rgb(0.5f)));
                scene::LightLinks& links = is_mesh ? add_lamp(test).links : add_rect(test).links;
                links.casters = set_of(test.scene, {casts ? 2u : 1u});
                const RenderedLayers layers =
                    render_direct(test, strategy, SelectionKind::Tree, 256);
                const std::string what = fmt::format("{} {} {}", name_of(strategy), is_mesh, casts);
                if (casts)
                    EXPECT_EQ(layers.bounce(1, 0).mean, 0.0) << what;
                else
                    expect_close(irradiance(layers.bounce(1, 0)), square_irradiance, 1e-2, what);
                expect_close(irradiance(layers.unoccluded(0)), square_irradiance, 1e-2, what);
            }
        }
    }
}

TEST(ShadowLinking, IsNoMatterOfHowRoughASurfaceIs) {
    // A mirror has no light sampling: what it shows of the light is found by the same rule
    for (const bool is_mesh : {false, true}) {
        TestScene test;
        test.add_square(-3.0f, 10.0f, test.add_material(mirror(Rgb(1.0f))));
        test.add_square(0.5f, 10.0f, test.add_matte(Rgb(0.0f)));
        test.scene.shapes.back().link = 2;
        scene::LightLinks& links = add_wall(test, is_mesh);
        EXPECT_EQ(render(test, {.size = 4, .samples = 4}).bounce(1, 0).mean, 0.0);
        links.casters = set_of(test.scene, {0, 1});
        EXPECT_EQ(render(test, {.size = 4, .samples = 4}).bounce(1, 0).mean, 1.0);
    }
}

TEST(ShadowLinking, SwitchedOffBesideOtherLinksLeavesAllTheLight) {
    // Nothing casts a shadow, yet there are classes: the lamp is still to be met among them
    for (const LightSampling strategy : strategies) {
        for (const bool is_mesh : {false, true}) {
            TestScene test = patch_scene();
            add_blocker(test, test.add_matte(Rgb(0.5f)));
            scene::LightLinks& links = is_mesh ? add_lamp(test).links : add_rect(test).links;
            test.scene.shapes.back().link = 2;
            links.lit = set_of(test.scene, {1});
            links.casters = set_of(test.scene, {});
            const RenderedLayers layers = render_direct(test, strategy, SelectionKind::Tree, 256);
            expect_close(irradiance(layers.bounce(1, 0)), square_irradiance, 1e-2,
                         name_of(strategy));
        }
    }
}

TEST(ShadowLinking, CutOutsAndThinWallsAreCountedOnce) {
    for (const LightSampling strategy : strategies) {
        for (const bool is_mesh : {false, true}) {
            for (const bool casts : {false, true}) {
                TestScene test = patch_scene();
                scene::Material veil;
                veil.diffuse_color = scene::Input(Rgb(0.0f));
                veil.has_specular = false;
                veil.opacity = scene::Input(0.25f);
                veil.presence = true;
                add_blocker(test, test.add_material(veil));
                scene::LightLinks& links = is_mesh ? add_lamp(test).links : add_rect(test).links;
                links.casters = set_of(test.scene, {casts ? 2u : 1u});
                const RenderedLayers layers =
                    render_direct(test, strategy, SelectionKind::Tree, 256);
                expect_close(irradiance(layers.bounce(1, 0)),
                             square_irradiance * (casts ? 0.75 : 1.0), 2e-2,
                             fmt::format("{} {} {}", name_of(strategy), is_mesh, casts));
            }
        }
    }
}

TEST(ShadowLinking, ReachesAsFarAsItIsSaidToAndFades) {
    // A square of 2·1.5 at half the height covers the whole lamp
    struct Case {
        float distance, falloff, gamma, color;
        double expected;  // of the light
    };

    for (const LightSampling strategy : strategies) {
        for (const bool is_mesh : {false, true}) {
            for (const Case& c : {Case{0.4f, 0, 1, 0, 1.0}, Case{5.0f, 0, 1, 0, 0.0},
                                  Case{5.0f, 0, 1, 0.25f, 0.25}, Case{0.45f, 0, 1, 0.25f, 1.0},
                                  // Everywhere within the zone: see below
                                  Case{1.2f, 1.2f, 1, 0, -1}, Case{1.2f, 5.0f, 3, 0, -1}}) {
                TestScene test = patch_scene();
                add_blocker(test, test.add_matte(Rgb(0.5f)));
                scene::LightLinks& links = is_mesh ? add_lamp(test).links : add_rect(test).links;
                links.shadow_distance = c.distance;
                links.shadow_falloff = std::min(c.falloff, c.distance);
                links.shadow_falloff_gamma = c.gamma;
                links.shadow_color = Rgb(c.color);
                const Estimate found = irradiance(
                    render_direct(test, strategy, SelectionKind::Tree, 256).bounce(1, 0));
                const std::string what = fmt::format(
                    "{} {} distance {} gamma {}", name_of(strategy), is_mesh, c.distance, c.gamma);
                double expected = c.expected * square_irradiance;
                if (c.expected < 0.0) {
                    // Midpoint rule over the lamp; the blocker is met half way
                    constexpr int n = 1000;
                    expected = 0.0;
                    for (int i = 0; i < n * n; ++i) {
                        const double x = (i % n + 0.5) * 2.0 / n - 1.0;
                        const double y = (i / n + 0.5) * 2.0 / n - 1.0;
                        const double r2 = 1.0 + x * x + y * y;
                        const double rest = 1.0 - 0.5 * std::sqrt(r2) / double(c.distance);
                        expected += (1.0 - std::pow(rest, double(c.gamma))) / (r2 * r2);
                    }
                    expected *= 4.0 / (n * n);
                }
                if (expected == 0.0)
                    EXPECT_EQ(found.mean, 0.0) << what;
                else
                    expect_close(found, expected, 1e-2, what);
            }
        }
    }
}

TEST(ShadowLinking, FadesInABodyThatAbsorbsOnTheWayToTheCasterOnly) {
    // Everything lies in a body of index 1; the nearest opaque caster decides, half way to the lamp
    scene::Material fog;
    fog.opacity = scene::Input(0.0f);
    fog.ior = scene::Input(1.0f);
    fog.roughness = scene::Input(0.0f);
    fog.transmission_depth = 0.5f;
    fog.transmission_color = scene::Input(Rgb(0.5f));
    const auto passes = [](double length) { return std::pow(0.5, 2.0 * length); };
    constexpr float reach = 2.0f;
    constexpr int n = 1000;
    double expected = 0.0;  // midpoint rule over the lamp
    for (int i = 0; i < n * n; ++i) {
        const double x = (i % n + 0.5) * 2.0 / n - 1.0;
        const double y = (i / n + 0.5) * 2.0 / n - 1.0;
        const double r2 = 1.0 + x * x + y * y;
        const double half = 0.5 * std::sqrt(r2);
        expected += passes(half) * half / double(reach) / (r2 * r2);
    }
    // The camera looks from its near clipping plane on
    expected *= 4.0 / (n * n) * passes(-double(patch_z) - 0.9);
    for (const LightSampling strategy : strategies) {
        for (const bool is_mesh : {false, true}) {
            TestScene test = patch_scene();
            add_blocker(test, test.add_matte(Rgb(0.5f)));
            scene::LightLinks& links = is_mesh ? add_lamp(test).links : add_rect(test).links;
            links.shadow_distance = links.shadow_falloff = reach;
            test.add_sphere(Vec3(0.0f), 10.0, test.add_material(fog));
            const Estimate found =
                irradiance(render_direct(test, strategy, SelectionKind::Tree, 256).bounce(1, 0));
            expect_close(found, expected, 1e-2, fmt::format("{} {}", name_of(strategy), is_mesh));
        }
    }
}

TEST(ShadowLinking, OfManyLightsIsThatOfEach) {
    // Two lights of which the blocker shades one, by a glossy surface and a matte one
    for (const float roughness : {0.1f, 0.5f}) {
        scene::Material gloss;
        gloss.roughness = scene::Input(roughness);
        const auto make = [&](bool with_blocker) {
            TestScene test;
            test.add_square(-3.0f, 10.0f, test.add_material(gloss));
            test.scene.shapes.back().link = 1;
            if (with_blocker) {
                test.add_sphere(Vec3(0, 0, 0.5f), 0.4, test.add_matte(Rgb(0.0f)));
                test.scene.shapes.back().link = 2;
            }
            scene::Light& light = test.add_light(scene::LightKind::Sphere, at(Vec3d(0.2, 0.1, 2)));
            light.radius = 0.7f;
            if (with_blocker) light.links.casters = set_of(test.scene, {0, 1});
            return test;
        };
        RenderedLayers reference = render(make(false), {.size = 16, .samples = 1024, .seed = 9});
        for (const LightSampling strategy : strategies) {
            const RenderedLayers found =
                render(make(true),
                       {.size = 16, .samples = 1024, .estimator = {.light_sampling = strategy}});
            expect_agreement(found, reference, 0.05,
                             fmt::format("roughness {} by {}", roughness, name_of(strategy)));
        }
    }
}

}  // namespace velatura::test
