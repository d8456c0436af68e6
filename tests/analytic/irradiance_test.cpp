// SPDX-License-Identifier: Apache-2.0
// Irradiance of every light on a matte patch against closed forms, through the whole
// integrator.
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::test {

namespace {

constexpr float patch_z = -1.0f;  ///< the patch lies one unit in front of the camera
constexpr double unit_scale = 1.0;

/// Light space looks along −Z: above the patch, that already faces it.
Mat4d above_patch(double height, const Vec3d& aside = Vec3d(0.0)) {
    Mat4d m;
    m.setTranslation(Vec3d(aside.x, aside.y, double(patch_z) + height));
    return m;
}

TestScene patch_scene() {
    TestScene test;
    test.add_square(patch_z, 0.01f, test.add_matte(Rgb(1.0f)));
    return test;
}

/// Radiance of a white Lambert patch is E / π.
void expect_irradiance(const TestScene& test,
                       double expected,
                       double relative,
                       const std::string& what,
                       uint64_t samples = 1024) {
    const RenderedLayers layers = render(test, {.size = 16, .samples = samples, .last_bounce = 1});
    Estimate e = layers.bounce(1, 0);
    e.mean *= pi_d;
    e.standard_error *= pi_d;
    expect_close(e, expected, relative, what);
    // Nothing hides the light: the unoccluded layer is the same light
    EXPECT_NEAR(layers.unoccluded(0).mean, layers.bounce(1, 0).mean, 1e-9 * expected) << what;
}

}  // namespace

TEST(Irradiance, RectOverItsCenter) {
    TestScene test = patch_scene();
    scene::Light& light = test.add_light(scene::LightKind::Rect, above_patch(1.0));
    light.width = light.height = 2.0f * float(unit_scale);
    expect_irradiance(test, 1.7408395, 1e-3, "2x2 rect at height 1");
}

TEST(Irradiance, RectOverItsCorner) {
    TestScene test = patch_scene();
    scene::Light& light =
        test.add_light(scene::LightKind::Rect, above_patch(1.0, Vec3d(0.5, 0.5, 0.0)));
    light.width = light.height = 1.0f;
    expect_irradiance(test, 0.4352099, 1e-3, "1x1 rect above its corner");
}

TEST(Irradiance, RectEmitsOnlyForward) {
    TestScene test = patch_scene();
    Mat4d turned = above_patch(1.0);
    for (int column = 0; column < 3; ++column) {
        turned[0][column] = -turned[0][column];
        turned[2][column] = -turned[2][column];
    }
    test.add_light(scene::LightKind::Rect, turned);
    const RenderedLayers layers = render(test, {.size = 16, .samples = 16, .last_bounce = 1});
    EXPECT_EQ(layers.beauty().mean, 0.0);
}

TEST(Irradiance, Sphere) {
    for (const double radius : {0.5, 0.9, 1e-2, 1e-4}) {
        TestScene test = patch_scene();
        scene::Light& light = test.add_light(scene::LightKind::Sphere, above_patch(1.0));
        light.radius = float(radius);
        const double r = double(float(radius));
        expect_irradiance(test, pi_d * r * r, 1e-3,
                          fmt::format("sphere of radius {} at distance 1", radius));
    }
}

TEST(Irradiance, Disk) {
    TestScene test = patch_scene();
    scene::Light& light = test.add_light(scene::LightKind::Disk, above_patch(1.0));
    light.radius = 0.5f;
    expect_irradiance(test, pi_d * 0.25 / 1.25, 1e-3, "disk of radius 0.5 at height 1", 4096);
}

TEST(Irradiance, SunDisc) {
    TestScene test = patch_scene();
    scene::Light& light = test.add_light(scene::LightKind::Distant, Mat4d());
    light.angle_deg = 0.53f;
    expect_irradiance(test, pi_d * std::pow(std::sin(0.265 * pi_d / 180.0), 2), 1e-3,
                      "distant light of 0.53 degrees");
}

TEST(Irradiance, DeltaSun) {
    TestScene test = patch_scene();
    scene::Light& light = test.add_light(scene::LightKind::Distant, Mat4d());
    light.angle_deg = 0.0f;
    light.Le = Rgb(3.0f);
    expect_irradiance(test, 3.0, 1e-3, "distant light without angle", 4);
}

TEST(Irradiance, Dome) {
    TestScene test = patch_scene();
    test.add_light(scene::LightKind::Dome, Mat4d());
    expect_irradiance(test, pi_d, 1e-3, "constant dome");
}

TEST(Irradiance, CylinderOfGreatLengthIsALineOfSegments) {
    // Infinitely long cylinder of radius r with axis at height h: E = π r / h (view factor of an
    // element facing it)
    TestScene test = patch_scene();
    scene::Light& light = test.add_light(scene::LightKind::Cylinder, above_patch(1.0));
    light.radius = 0.25f;
    light.length = 2000.0f;
    expect_irradiance(test, pi_d * 0.25, 5e-3, "long cylinder of radius 0.25 at height 1", 16384);
}

TEST(Irradiance, LightsAddUpAndStayInTheirGroups) {
    TestScene test = patch_scene();
    scene::Light& rect = test.add_light(scene::LightKind::Rect, above_patch(1.0));
    rect.width = rect.height = 2.0f;
    test.add_light(scene::LightKind::Dome, Mat4d()).Le = Rgb(0.5f);
    scene::Light& sun = test.add_light(scene::LightKind::Distant, Mat4d());
    sun.angle_deg = 0.0f;
    const RenderedLayers layers = render(test, {.size = 16, .samples = 4096, .last_bounce = 1});
    const double expected[] = {1.7408395, 0.5 * pi_d, 1.0};
    for (int g = 0; g < 3; ++g) {
        Estimate e = layers.bounce(1, g);
        e.mean *= pi_d;
        e.standard_error *= pi_d;
        expect_close(e, expected[g], 3e-3, fmt::format("group {} of three", g));
    }
}

TEST(Irradiance, ShadowLayerIsWhatTheOccluderTakes) {
    // A black square covers the light exactly: b1 is zero, U is the whole irradiance
    TestScene test = patch_scene();
    scene::Light& light = test.add_light(scene::LightKind::Rect, above_patch(1.0));
    light.width = light.height = 1.0f;
    test.add_square(patch_z + 0.75f, 10.0f, test.add_matte(Rgb(0.0f)));
    // The camera looks through the gap below the occluder
    test.scene.camera.clip_near = 0.5;
    const RenderedLayers layers = render(test, {.size = 16, .samples = 4096, .last_bounce = 1});
    EXPECT_EQ(layers.bounce(1, 0).mean, 0.0);
    Estimate e = layers.unoccluded(0);
    e.mean *= pi_d;
    e.standard_error *= pi_d;
    // Form factor of a centered square: 4 corners of half its side, E = 4 · corner formula with a =
    // b = 0.5
    const double a = 0.5, q = std::sqrt(1.0 + a * a);
    const double corner = a / q * std::atan(a / q);
    expect_close(e, 4.0 * corner, 1e-3, "unoccluded light behind a wall");
}

TEST(Irradiance, LightFlushWithASurfaceLosesNothing) {
    // The light lies exactly in the plane of a larger black ceiling
    TestScene test = patch_scene();
    scene::Light& light = test.add_light(scene::LightKind::Rect, above_patch(0.75));
    light.width = light.height = 2.0f;
    test.add_square(patch_z + 0.75f, 10.0f, test.add_matte(Rgb(0.0f)));
    test.scene.camera.clip_near = 0.5;
    const double a = 1.0 / 0.75, q = std::sqrt(1.0 + a * a);
    expect_irradiance(test, 4.0 * a / q * std::atan(a / q), 1e-3,
                      "2x2 rect in a ceiling at height 0.75", 2048);
}

TEST(Irradiance, LobeMultipliersSurviveAnInvisibleInterface) {
    // Around everything a bubble of index 1, which refracts nothing and hides the dome from light
    // sampling
    TestScene test = patch_scene();
    scene::Material bubble;
    bubble.opacity = scene::Input(0.0f);
    bubble.ior = scene::Input(1.0f);
    bubble.roughness = scene::Input(0.0f);
    test.add_sphere(Vec3(0.0f), 5.0, test.add_material(bubble));
    test.add_light(scene::LightKind::Dome, Mat4d()).specular_multiplier = 0.0f;
    const RenderedLayers layers = render(test, {.size = 16, .samples = 1024, .last_bounce = 1});
    Estimate e = layers.bounce(1, 0);
    e.mean *= pi_d;
    e.standard_error *= pi_d;
    expect_close(e, pi_d, 1e-3, "dome without specular, seen through index 1");
}

TEST(Camera, FarPlaneCutsBehindCutOuts) {
    TestScene test;
    scene::Material absent;
    absent.opacity = scene::Input(0.0f);
    absent.presence = true;
    test.add_square(-3.0f, 100.0f, test.add_material(absent));
    test.add_square(-20.0f, 100.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
    Mat4d far_away;
    far_away.setTranslation(Vec3d(0.0, 0.0, -15.0));
    test.add_light(scene::LightKind::Sphere, far_away).is_camera_visible = true;
    test.scene.camera.clip_near = 1.0;
    test.scene.camera.clip_far = 10.0;
    EXPECT_EQ(render(test, {.size = 16, .samples = 16}).beauty().mean, 0.0);
    test.scene.camera.clip_far = 30.0;
    EXPECT_EQ(render(test, {.size = 16, .samples = 16}).beauty().mean, 2.0)
        << "wall and light, both of radiance 1";
}

}  // namespace velatura::test
