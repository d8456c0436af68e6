// SPDX-License-Identifier: Apache-2.0
// Geometry that is a light (UsdLux MeshLightAPI), through the whole integrator: closed forms, and
// what must come out the same another way.
#include "strategies.h"
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::test {

namespace {

using integrator::LightSampling;

constexpr float lamp_z = -0.25f;
constexpr float patch_z = -1.25f;  ///< one unit below the lamp
/// Irradiance of a point one unit below the center of a 2×2 square of radiance 1:
/// 4·√½·atan √½.
constexpr double square_irradiance = 1.7408395;

/// A white patch; the camera looks through what is between it and the patch.
TestScene patch_scene() {
    TestScene test;
    test.add_square(patch_z, 0.01f, test.add_matte(Rgb(1.0f)));
    test.scene.camera.clip_near = 0.9;
    return test;
}

RenderedLayers render_direct(const TestScene& test,
                             uint64_t samples,
                             LightSampling strategy = LightSampling::Mis) {
    return render(test, {.size = 16,
                         .samples = samples,
                         .last_bounce = 1,
                         .estimator = {.light_sampling = strategy}});
}

/// Radiance of a white Lambert patch is E / π, and all of it is in the group.
void expect_irradiance(const TestScene& test,
                       double expected,
                       double relative,
                       const std::string& what,
                       LightSampling strategy = LightSampling::Mis,
                       uint64_t samples = 1024) {
    const RenderedLayers layers = render_direct(test, samples, strategy);
    Estimate e = layers.bounce(1, 0);
    e.mean *= pi_d;
    e.standard_error *= pi_d;
    expect_close(e, expected, relative, what);
    EXPECT_EQ(layers.bounce(1, 0).mean, layers.bounce(1).mean) << what << ": light in other rows";
    EXPECT_NEAR(layers.unoccluded(0).mean, layers.bounce(1, 0).mean, 1e-6 * expected) << what;
}

/// A camera that looks at a lamp whose material emits `glow`, straight or by a mirror.
double seen(const scene::MeshLight& like, float glow, bool by_mirror, int* group) {
    TestScene test;
    if (by_mirror) test.add_square(-3.0f, 10.0f, test.add_material(mirror(Rgb(1.0f))));
    test.add_square(by_mirror ? 1.0f : -2.0f, 10.0f, test.add_matte(Rgb(0.0f), Rgb(glow)));
    scene::MeshLight& light = test.make_mesh_light();
    const scene::GroupId own = light.group;
    light = like;
    light.group = own;
    const RenderedLayers layers = render(test, {.size = 8, .samples = 16, .last_bounce = 2});
    const int bounce = by_mirror ? 1 : 0;
    *group = layers.bounce(bounce, 0).mean > 0.0 ? 0 : 1;
    return layers.bounce(bounce).mean;
}

}  // namespace

TEST(MeshLight, SquareShinesLikeTheRectLight) {
    for (const LightSampling strategy : strategies) {
        TestScene test = patch_scene();
        test.add_square(lamp_z, 1.0f, test.add_matte(Rgb(0.0f)));
        test.make_mesh_light();
        expect_irradiance(test, square_irradiance, 3e-3, "2x2 mesh light", strategy);
    }
    TestScene rect = patch_scene();
    Mat4d above = at(Vec3d(0.0, 0.0, double(lamp_z)));
    rect.add_light(scene::LightKind::Rect, above).width = 2.0f;
    rect.scene.lights.back().height = 2.0f;
    expect_irradiance(rect, square_irradiance, 3e-3, "2x2 rect light");
}

TEST(MeshLight, NormalizedByTheAreaOfEachPlacement) {
    TestScene direct = patch_scene();
    direct.add_square(lamp_z, 1.0f, direct.add_matte(Rgb(0.0f)));
    direct.make_mesh_light().is_normalized = true;
    expect_irradiance(direct, square_irradiance / 4.0, 3e-3, "normalized 2x2 mesh light");

    // Of half size 1/2, stretched to half size 1 by a similarity and by a map that is none
    for (const Mat4& map : {Mat4(2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, lamp_z, 1),
                            Mat4(-2, 0, 0, 0, 0, 2, 0, 0, 0.5f, 0.25f, 3, 0, 0, 0, lamp_z, 1)}) {
        TestScene test = patch_scene();
        test.add_square(0.0f, 0.5f, test.add_matte(Rgb(0.0f)));
        test.make_mesh_light().is_normalized = true;
        test.make_instance(map);
        // Another instance, far away and of another size, is normalized by its own
        scene::Instance other = test.scene.instances[0];
        other.render_from_prototype = Mat4(64, 0, 0, 0, 0, 64, 0, 0, 0, 0, 64, 0, 0, 0, 1e5f, 1);
        test.scene.instances.push_back(other);
        for (const LightSampling strategy : strategies)
            expect_irradiance(test, square_irradiance / 4.0, 3e-3,
                              "normalized instance of a mesh light", strategy);
    }
}

TEST(MeshLight, InstancesAddUp) {
    TestScene test = patch_scene();
    // Two halves of the square
    test.add_square(0.0f, 1.0f, test.add_matte(Rgb(0.0f)));
    test.make_mesh_light();
    test.make_instance(Mat4(0.5f, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -0.5f, 0, lamp_z, 1));
    scene::Instance other = test.scene.instances[0];
    other.render_from_prototype = Mat4(0.5f, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.5f, 0, lamp_z, 1);
    test.scene.instances.push_back(other);
    for (const LightSampling strategy : strategies)
        expect_irradiance(test, square_irradiance, 3e-3, "two instances of a mesh light", strategy);
}

TEST(MeshLight, LightsByLightAndMaterialAsItsModeSays) {
    constexpr float glow = 0.5f;
    scene::MeshLight tinted, independent, no_response;
    tinted.Le = independent.Le = no_response.Le = Rgb(3.0f);
    tinted.is_tinted_by_emission = tinted.shows_material = independent.shows_material = true;

    const struct {
        const char* name;
        scene::MeshLight light;
        double lights, shows;
    } modes[] = {{"materialGlowTintsLight", tinted, 1.5, 0.5},
                 {"independent", independent, 3.0, 0.5},
                 {"noMaterialResponse", no_response, 3.0, 3.0}};

    for (const auto& mode : modes) {
        for (const LightSampling strategy : strategies) {
            TestScene test = patch_scene();
            test.add_square(lamp_z, 1.0f, test.add_matte(Rgb(0.0f), Rgb(glow)));
            scene::MeshLight& light = test.make_mesh_light();
            const scene::GroupId own = light.group;
            light = mode.light;
            light.group = own;
            expect_irradiance(test, mode.lights * square_irradiance, 3e-3, mode.name, strategy);
        }
        int group = -1;
        EXPECT_EQ(seen(mode.light, glow, false, &group), mode.shows) << mode.name;
        EXPECT_EQ(group, 0) << "what the camera sees of a light is in its row";
        EXPECT_NEAR(seen(mode.light, glow, true, &group), mode.shows, 1e-6) << mode.name;
        EXPECT_EQ(group, 0);
    }
}

TEST(MeshLight, TintedByGlowAtFullStrengthIsTheEmissiveMaterial) {
    const auto image = [](bool is_light) {
        TestScene test;
        test.look_with_perspective(0.4);
        test.add_square(-6.0f, 4.0f, test.add_matte(Rgb(0.5f)));
        test.add_sphere(Vec3(0.8f, 0.0f, -5.0f), 0.6, test.add_material(mirror(Rgb(0.9f))));
        test.add_sphere(Vec3(-1.0f, 0.5f, -4.5f), 0.4,
                        test.add_matte(Rgb(0.2f), Rgb(3.0f, 2.0f, 1.0f)));
        if (is_light) {
            scene::MeshLight& light = test.make_mesh_light();
            light.is_tinted_by_emission = light.shows_material = true;
        }
        return render(test, {.size = 16, .samples = 64});
    };
    const RenderedLayers light = image(true), material = image(false);
    EXPECT_GT(light.beauty().mean, 0.0);
    for (int bounce = 0; bounce <= 4; ++bounce) {
        for (int channel = 0; channel < 3; ++channel) {
            EXPECT_EQ(light.bounce(bounce, 0, channel).mean,
                      material.bounce(bounce, 0, channel).mean);
            EXPECT_EQ(light.bounce(bounce, 1, channel).mean, 0.0);
        }
    }
}

TEST(MeshLight, ShapedByACone) {
    // Within 30° of the axis a point sees a disk of the square: E = π sin²
    const double expected = pi_d * 0.25;
    scene::Shaping cone;
    cone.is_active = true;
    cone.cone_angle_deg = 30.0f;
    for (const LightSampling strategy : strategies) {
        TestScene direct = patch_scene();
        direct.add_square(lamp_z, 1.0f, direct.add_matte(Rgb(0.0f)));
        direct.make_mesh_light().shaping = cone;
        expect_irradiance(direct, expected, 2e-2, "mesh light with a cone", strategy);

        // Standing upright in the prototype, with the axis of its own space, laid flat
        TestScene placed = patch_scene();
        placed.add_square(0.0f, 1.0f, placed.add_matte(Rgb(0.0f)));
        scene::MeshLight& light = placed.make_mesh_light();
        light.shaping = cone;
        const Mat4d from_x(0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1);
        light.parent_from_light = from_x;  // the axis is +X of the holder
        Mat4 flat(0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, lamp_z, 1);
        auto& mesh = std::get<scene::Mesh>(placed.scene.shapes.back().geometry);
        for (Vec3& p : mesh.points) p = Vec3(p.z, p.y, p.x);
        placed.make_instance(flat);
        expect_irradiance(placed, expected, 2e-2, "instance of a mesh light with a cone", strategy);
    }
}

TEST(MeshLight, LobeMultipliersScaleWhatItLights) {
    const auto lit = [](float diffuse, float specular, bool is_glossy) {
        TestScene test = patch_scene();
        test.add_square(lamp_z, 1.0f, test.add_matte(Rgb(0.0f)));
        scene::MeshLight& light = test.make_mesh_light();
        light.diffuse_multiplier = diffuse;
        light.specular_multiplier = specular;
        if (is_glossy) {
            scene::Material gloss = mirror(Rgb(0.8f));
            gloss.roughness = scene::Input(0.5f);
            test.scene.shapes[0].material = test.add_material(gloss);
        }
        return render_direct(test, 256).bounce(1, 0).mean;
    };
    EXPECT_NEAR(lit(0.5f, 1.0f, false), 0.5 * lit(1.0f, 1.0f, false), 1e-6);
    EXPECT_NEAR(lit(1.0f, 0.25f, true), 0.25 * lit(1.0f, 1.0f, true), 1e-6);
    EXPECT_EQ(lit(0.0f, 1.0f, false), 0.0);
}

TEST(MeshLight, StrategiesAndSelectionsAgreeAmongAllKinds) {
    // Matte, glossy and mirroring things under a tinted ball, normalized instances with a cone, an
    // independent lamp and a plain emissive one
    TestScene test;
    test.look_with_perspective(0.4);
    test.add_square(-6.0f, 4.0f, test.add_matte(Rgb(0.5f)));
    scene::Material gloss;
    gloss.diffuse_color = scene::Input(Rgb(0.3f));
    gloss.roughness = scene::Input(0.3f);
    test.add_sphere(Vec3(0.4f, 0.0f, -5.0f), 0.8, test.add_material(gloss));
    test.add_sphere(Vec3(1.5f, -1.0f, -5.0f), 0.4, test.add_material(mirror(Rgb(0.9f))));
    test.add_square(0.0f, 0.3f, test.add_matte(Rgb(0.1f)));
    scene::MeshLight& lamp = test.make_mesh_light();
    lamp.Le = Rgb(4.0f);
    lamp.is_normalized = true;
    lamp.shaping.is_active = true;
    lamp.shaping.cone_angle_deg = 60.0f;
    lamp.shaping.cone_softness = 0.5f;
    lamp.diffuse_multiplier = 0.5f;
    test.make_instance(Mat4(1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 1.5f, 1.2f, -5, 1));
    scene::Instance second = test.scene.instances[0];
    second.render_from_prototype =
        Mat4(0.5f, 0, 0, 0, 0, 1.5f, 0, 0, 0, 0, 1, 0, -0.5f, -1.2f, -5.5f, 1);
    test.scene.instances.push_back(second);
    test.add_sphere(Vec3(-1.5f, 0.8f, -4.5f), 0.4,
                    test.add_matte(Rgb(0.2f), Rgb(3.0f, 2.0f, 1.0f)));
    scene::MeshLight& ball = test.make_mesh_light();
    ball.Le = Rgb(0.5f, 1.0f, 2.0f);
    ball.is_tinted_by_emission = ball.shows_material = true;
    test.add_sphere(Vec3(-0.5f, 1.5f, -5.0f), 0.2, test.add_matte(Rgb(0.4f), Rgb(0.2f)));
    scene::MeshLight& odd = test.make_mesh_light();
    odd.Le = Rgb(5.0f);
    odd.shows_material = true;
    test.add_sphere(Vec3(0.5f, 1.5f, -5.0f), 0.2, test.add_matte(Rgb(0.4f), Rgb(2.0f)));

    using lights::SelectionKind;
    const auto total = [&](LightSampling strategy, SelectionKind selection, uint64_t seed) {
        return render(test, {.size = 24,
                             .samples = 384,
                             .estimator = {.light_sampling = strategy},
                             .seed = seed,
                             .light_selection = selection});
    };
    const RenderedLayers mis = total(LightSampling::Mis, SelectionKind::Tree, 1);
    expect_agreement(total(LightSampling::Mis, SelectionKind::Power, 2), mis, 3e-2,
                     "selection by power against tree");
    expect_agreement(total(LightSampling::Light, SelectionKind::Tree, 3), mis, 3e-2,
                     "light sampling against MIS");
    expect_agreement(total(LightSampling::Bsdf, SelectionKind::Tree, 4), mis, 5e-2,
                     "BSDF sampling against MIS");
}

}  // namespace velatura::test
