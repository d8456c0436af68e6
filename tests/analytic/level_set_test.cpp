// SPDX-License-Identifier: Apache-2.0
// Level sets as bodies: what is inside absorbs, refracts and scatters.
#include "volume_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::test {

namespace {

constexpr float radius = 1.0f;
const Vec3d middle(0, 0, -4);

/// A ball of 20 voxels' radius.
void add_ball(TestScene& test, scene::MaterialId material) {
    constexpr int n = 49;
    constexpr float h = 0.05f;
    const Vec3 center(0.5f * float(n - 1));
    const auto distance = [&](int x, int y, int z) {
        const float d = (Vec3(float(x), float(y), float(z)) - center).length() * h - radius;
        return std::clamp(d, -3 * h, 3 * h);
    };
    auto grid = std::make_shared<const scene::VoxelGrid>(
        make_voxel_grid(scene::Vec3i(n), h, distance, 3 * h, true));
    const Mat4d map = grid->volume_from_lattice * at(middle - Vec3d(center) * double(h));
    scene::Shape shape;
    shape.geometry = scene::LevelSet{std::move(grid), map, {}};
    shape.material = material;
    test.scene.shapes.push_back(shape);
}

}  // namespace

TEST(LevelSets, AbsorbAlongTheWayInside) {
    TestScene test;
    scene::Material glass = smooth_glass(1.0f);
    glass.transmission_color = scene::Input(Rgb(0.8f, 0.5f, 0.2f));
    glass.transmission_depth = 1.0f;
    add_ball(test, test.add_material(glass));
    test.add_light(LightKind::Dome, Mat4d()).is_camera_visible = true;
    test.look_at_point(1e-3);
    const RenderedLayers layers = render(test, {.size = 8, .samples = 4});
    const double left[3] = {0.8, 0.5, 0.2};
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(layers.bounce(0, -1, c).mean, std::pow(left[c], 2.0), 3e-3);
    EXPECT_GT(layers.rays.effects.of(scene::Effect::LevelSets), 0u);
}

TEST(LevelSets, RefractAndScatterAndLoseNothing) {
    scene::Material murky = smooth_glass(1.5f);
    murky.interior = scene::MediumProperties{Rgb(0.0f), Rgb(2.0f), 0.3f};
    for (const scene::Material& material : {smooth_glass(1.5f), murky}) {
        TestScene test;
        add_ball(test, test.add_material(material));
        test.add_light(LightKind::Dome, Mat4d()).is_camera_visible = true;
        test.look_with_perspective(0.3);
        const RenderedLayers layers =
            render(test, {.size = 24, .samples = 64, .estimator = by_paths});
        expect_close(layers.beauty(), 1.0, 5e-3, "a glass level set in a furnace");
    }
}

// Light through the level set and through the ball that it samples
TEST(LevelSets, LookLikeTheBallThatTheySample) {
    const auto scene_of = [](bool is_level_set) {
        TestScene test;
        scene::Material material;
        material.roughness = scene::Input(0.3f);
        const scene::MaterialId m = test.add_material(material);
        if (is_level_set)
            add_ball(test, m);
        else
            test.add_sphere(Vec3(middle), double(radius), m);
        test.add_square(-6.0f, 5.0f, test.add_matte(Rgb(0.6f)));
        scene::Light& ball = test.add_light(LightKind::Sphere, at(Vec3d(1.5, 2, -2)));
        ball.radius = 0.5f;
        ball.Le = Rgb(20.0f);
        test.look_with_perspective(0.35);
        return test;
    };
    const RenderedLayers a = render(scene_of(true), {.size = 32, .samples = 64});
    const RenderedLayers b = render(scene_of(false), {.size = 32, .samples = 64, .seed = 2});
    expect_agreement(a, b, 2e-2, "a level set and its ball");
}

}  // namespace velatura::test
