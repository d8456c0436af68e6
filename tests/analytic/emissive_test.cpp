// SPDX-License-Identifier: Apache-2.0
// Emissive surfaces as area lights, through the whole integrator: closed forms, and strategies that
// must agree.
#include "strategies.h"
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::test {

namespace {

using integrator::LightSampling;

constexpr float patch_z = -1.0f;  ///< the patch lies one unit in front of the camera
constexpr float lamp_z = -0.25f;  ///< 0.75 above it
constexpr double height = 0.75;

/// The camera looks through what is between it and the patch.
TestScene patch_scene() {
    TestScene test;
    test.add_square(patch_z, 0.01f, test.add_matte(Rgb(1.0f)));
    test.scene.camera.clip_near = 0.9;
    return test;
}

/// Irradiance of a point below the center of a square with radiance 1: four times the
/// irradiance below the corner of a quarter of it.
double irradiance_of_square(double half_size) {
    const double a = half_size / height, q = std::sqrt(1.0 + a * a);
    return 4.0 * a / q * std::atan(a / q);
}

bool is_solid(const TestScene& test) {
    for (const scene::Material& m : test.scene.materials)
        if (m.presence) return false;
    return true;
}

/// Radiance of a white Lambert patch is E / π. The only group is `emissive`.
void expect_irradiance(const TestScene& test,
                       double expected,
                       double relative,
                       const std::string& what,
                       uint64_t samples,
                       LightSampling strategy = LightSampling::Mis) {
    const RenderedLayers layers = render(test, {.size = 16,
                                                .samples = samples,
                                                .last_bounce = 1,
                                                .estimator = {.light_sampling = strategy}});
    Estimate e = layers.bounce(1, 0);
    e.mean *= pi_d;
    e.standard_error *= pi_d;
    expect_close(e, expected, relative, fmt::format("{}, {}", what, name_of(strategy)));
    // Nothing hides the surface; where it is present by chance, the two are no longer of the very
    // same samples
    const double bound = is_solid(test) ? 1e-6 * expected : 8.0 * e.standard_error;
    EXPECT_NEAR(layers.unoccluded(0).mean, layers.bounce(1, 0).mean, bound) << what;
}

}  // namespace

TEST(H33Strategies, SquareByEachIsTheClosedForm) {
    for (const LightSampling strategy : strategies) {
        TestScene test = patch_scene();
        test.add_square(lamp_z, 1.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
        expect_irradiance(test, irradiance_of_square(1.0), 3e-3, "emissive 2x2 square", 512,
                          strategy);
    }
}

TEST(EmissiveSurface, SmallSquareIsFoundByLightSampling) {
    // Solid angles on both sides of the switch to sampling by area
    for (const float half_size : {1e-2f, 1e-3f, 5e-4f, 1e-4f}) {
        TestScene test = patch_scene();
        test.add_square(lamp_z, half_size, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
        expect_irradiance(test, irradiance_of_square(double(half_size)), 1e-3,
                          fmt::format("emissive square of half size {}", half_size), 64,
                          LightSampling::Light);
    }
}

TEST(EmissiveSurface, InstancesUnderAnyMapShineLikeTheirImage) {
    // A square of half size 1/2 stretched to half size 1, sheared within its plane's normal,
    // mirrored, and moved up
    const Mat4 map(-2, 0, 0, 0, 0, 2, 0, 0, 0.5f, 0.25f, 3, 0, 0, 0, lamp_z, 1);
    for (const LightSampling strategy : strategies) {
        TestScene test = patch_scene();
        test.add_square(0.0f, 0.5f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
        test.make_instance(map);
        expect_irradiance(test, irradiance_of_square(1.0), 3e-3, "instance of an emissive square",
                          1024, strategy);
    }
}

TEST(EmissiveSurface, PresenceWeighsEmissionAlikeForAllStrategies) {
    for (const LightSampling strategy : strategies) {
        TestScene test = patch_scene();
        scene::Material ghost;
        ghost.has_specular = false;
        ghost.diffuse_color = scene::Input(Rgb(0.0f));
        ghost.emissive_color = scene::Input(Rgb(2.0f));
        ghost.opacity = scene::Input(0.25f);
        ghost.presence = true;
        test.add_square(lamp_z, 1.0f, test.add_material(ghost));
        expect_irradiance(test, 0.5 * irradiance_of_square(1.0), 1e-2,
                          "square of presence 1/4 and radiance 2", 2048, strategy);
    }
}

TEST(EmissiveSurface, ShadowLayerIsWhatTheOccluderTakes) {
    TestScene test = patch_scene();
    test.add_square(lamp_z, 1.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
    test.add_square(0.5f * (lamp_z + patch_z), 100.0f, test.add_matte(Rgb(0.0f)));
    const RenderedLayers layers = render(test, {.size = 16, .samples = 1024, .last_bounce = 1});
    EXPECT_EQ(layers.bounce(1, 0).mean, 0.0);
    Estimate e = layers.unoccluded(0);
    e.mean *= pi_d;
    e.standard_error *= pi_d;
    expect_close(e, irradiance_of_square(1.0), 2e-3, "unoccluded emissive square behind a wall");
}

TEST(EmissiveSurface, LightsWithLobeMultipliersLeaveItAlone) {
    TestScene test = patch_scene();
    test.add_square(lamp_z, 1.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
    Mat4d far_away;
    far_away.setTranslation(Vec3d(0.0, 0.0, 50.0));
    scene::Light& lamp = test.add_light(scene::LightKind::Sphere, far_away);
    lamp.diffuse_multiplier = 0.0f;
    const RenderedLayers layers = render(test, {.size = 16, .samples = 2048, .last_bounce = 1});
    EXPECT_EQ(layers.bounce(1, 0).mean, 0.0);
    Estimate e = layers.bounce(1, 1);
    e.mean *= pi_d;
    e.standard_error *= pi_d;
    expect_close(e, irradiance_of_square(1.0), 3e-3,
                 "emissive square beside a light without diffuse");
}

TEST(EmissiveSurface, StrategiesAndSelectionsAgreeInAMixedScene) {
    // A lit box of glossy and matte surfaces: an emissive ball, two instances of a lamp, a cut-out
    // pane in front, a light
    TestScene test;
    test.look_with_perspective(0.4);
    test.add_square(-6.0f, 4.0f, test.add_matte(Rgb(0.5f)));
    scene::Material gloss;
    gloss.diffuse_color = scene::Input(Rgb(0.3f));
    gloss.roughness = scene::Input(0.3f);
    test.add_sphere(Vec3(0.4f, 0.0f, -5.0f), 0.8, test.add_material(gloss));
    test.add_sphere(Vec3(-1.5f, 0.8f, -4.5f), 0.4,
                    test.add_matte(Rgb(0.2f), Rgb(3.0f, 2.0f, 1.0f)));
    test.add_square(0.0f, 0.3f, test.add_matte(Rgb(0.1f), Rgb(8.0f)));
    test.make_instance(Mat4(1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 1.5f, 1.2f, -5, 1));
    scene::Instance second = test.scene.instances[0];
    second.render_from_prototype =
        Mat4(0.5f, 0, 0, 0, 0, 1.5f, 0, 0, 0, 0, 1, 0, -0.5f, -1.2f, -5.5f, 1);
    test.scene.instances.push_back(second);
    scene::Material pane;
    pane.opacity = scene::Input(0.5f);
    pane.presence = true;
    test.add_square(-3.5f, 0.5f, test.add_material(pane));
    Mat4d above;
    above.setTranslation(Vec3d(0.0, 2.0, -4.0));
    test.add_light(scene::LightKind::Sphere, above).radius = 0.2f;

    const auto total = [&](LightSampling strategy, lights::SelectionKind selection, uint64_t seed) {
        return render(test, {.size = 24,
                             .samples = 384,
                             .estimator = {.light_sampling = strategy},
                             .seed = seed,
                             .light_selection = selection});
    };
    using lights::SelectionKind;
    const RenderedLayers mis = total(LightSampling::Mis, SelectionKind::Tree, 1);
    expect_agreement(total(LightSampling::Mis, SelectionKind::Uniform, 2), mis, 3e-2,
                     "uniform selection against tree");
    expect_agreement(total(LightSampling::Mis, SelectionKind::Power, 3), mis, 3e-2,
                     "selection by power against tree");
    expect_agreement(total(LightSampling::Light, SelectionKind::Tree, 4), mis, 3e-2,
                     "light sampling against MIS");
    expect_agreement(total(LightSampling::Bsdf, SelectionKind::Tree, 5), mis, 5e-2,
                     "BSDF sampling against MIS");
}

TEST(Emissive, LightComesThroughManyPanes) {
    // Every pane of presence 1/2 takes half of it, whichever sampler looks for the light
    for (const int panes : {0, 1, 2, 5}) {
        for (const LightSampling strategy : strategies) {
            TestScene test = patch_scene();
            test.add_square(lamp_z, 0.5f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
            scene::Material pane;
            pane.opacity = scene::Input(0.5f);
            pane.presence = true;
            const scene::MaterialId material = test.add_material(pane);
            for (int i = 0; i < panes; ++i)
                test.add_square(patch_z + 0.1f + 0.07f * float(i), 4.0f, material);
            const RenderedLayers layers = render(test, {.size = 16,
                                                        .samples = panes > 2 ? 2048u : 512u,
                                                        .last_bounce = 1,
                                                        .max_depth = 1,
                                                        .estimator = {.light_sampling = strategy}});
            const Estimate e = layers.bounce(1);
            const double expected = irradiance_of_square(0.5) / pi_d * std::pow(0.5, panes);
            fmt::print("{} panes, {}: {:.5f} of {:.5f}, detectable {:.1f} %\n", panes,
                       name_of(strategy), e.mean, expected, 100 * e.detectable() / expected);
            EXPECT_NEAR(e.mean, expected, 4 * e.standard_error + 1e-3 * expected)
                << panes << " panes, " << name_of(strategy);
            EXPECT_LE(e.detectable(), 0.2 * expected);
        }
    }
}

}  // namespace velatura::test
