// SPDX-License-Identifier: Apache-2.0
// Light filters through the whole integrator: against geometry that does the same, by every
// strategy, in volumes, of geometry that is a light, and where they must change nothing.
#include "strategies.h"
#include "test_scene.h"
#include "volume_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

namespace velatura::test {

namespace {

using integrator::LightSampling;

scene::LightFilter filter_of(scene::FilterShape shape, const Vec3d& where = Vec3d(0.0)) {
    scene::LightFilter filter;
    filter.parent_from_filter = at(where);
    filter.shape = std::move(shape);
    return filter;
}

scene::LightFilter half() {
    scene::LightFilter filter = filter_of(scene::IntensityFilter());
    filter.tint = Rgb(0.5f);
    return filter;
}

/// White floor under the camera, a lamp of edge 1 beside it that the camera does not see.
TestScene lamp_scene() {
    TestScene test;
    test.add_square(-5.0f, 20.0f, test.add_matte(Rgb(1.0f)));
    test.add_light(LightKind::Rect, at(Vec3d(3.0, 0.0, -1.0)));
    test.look_at_point(0.01);
    return test;
}

constexpr double wall_z = -3.0;
/// Of the opening, between lamp and floor: a part of what the floor sees of the lamp.
constexpr float open_low[] = {1.1f, -0.15f}, open_high[] = {1.55f, 0.4f};

/// Black, as thick as nothing, with the opening in it; it hides the lamp but not the floor.
void add_wall(TestScene& test) {
    const scene::MaterialId black = test.add_matte(Rgb(0.0f));
    const float x0 = 0.3f, x1 = 3.0f, y0 = -2.0f, y1 = 2.0f;
    const float z = float(wall_z), t = 1e-4f;
    test.add_box({x0, y0, z}, {open_low[0], y1, z + t}, black);
    test.add_box({open_high[0], y0, z}, {x1, y1, z + t}, black);
    test.add_box({open_low[0], y0, z}, {open_high[0], open_low[1], z + t}, black);
    test.add_box({open_low[0], open_high[1], z}, {open_high[0], y1, z + t}, black);
}

scene::LightFilter wall_filter() {
    scene::BarnDoorFilter doors;
    doors.opening.lower = Vec3(open_low[0], open_low[1], 0.0f);
    doors.opening.upper = Vec3(open_high[0], open_high[1], 0.0f);
    return filter_of(doors, Vec3d(0.0, 0.0, wall_z));
}

RenderedLayers render_direct(const TestScene& test, LightSampling strategy, uint64_t samples) {
    return render(test, {.size = 16,
                         .samples = samples,
                         .last_bounce = 1,
                         .estimator = {.light_sampling = strategy}});
}

/// Beauty of a scene of which every light has the filter, over that without it.
double ratio(TestScene test, const scene::LightFilter& filter, const TestRenderOptions& options) {
    const double plain = render(test, options).beauty().mean;
    EXPECT_GT(plain, 0.0);
    for (scene::Light& light : test.scene.lights) light.filters = {filter};
    for (scene::MeshLight& light : test.scene.mesh_lights) light.filters = {filter};
    return render(test, options).beauty().mean / plain;
}

}  // namespace

TEST(LightFilter, BarnDoorIsABlackWallWithAHole) {
    TestScene walled = lamp_scene(), filtered = lamp_scene();
    add_wall(walled);
    filtered.scene.lights[0].filters = {wall_filter()};
    const double open = render_direct(lamp_scene(), LightSampling::Light, 1024).bounce(1).mean;
    const RenderedLayers truth = render_direct(walled, LightSampling::Light, 4096);
    for (const LightSampling strategy : strategies) {
        const uint64_t samples = strategy == LightSampling::Bsdf ? 16384 : 4096;
        const RenderedLayers layers = render_direct(filtered, strategy, samples);
        const Estimate a = truth.bounce(1), b = layers.bounce(1);
        const double error = std::hypot(a.standard_error, b.standard_error);
        EXPECT_NEAR(a.mean, b.mean, 4.0 * error) << name_of(strategy);
        EXPECT_LT(error, 0.02 * a.mean) << name_of(strategy);
        fmt::print("{}: {:.6f}, wall {:.6f}, open {:.6f}; detectable {:.2g}\n", name_of(strategy),
                   b.mean, a.mean, open, 5.2816 * error);
        // Unlike the wall the filter is part of the light: its shadow is not in a shadow layer
        EXPECT_NEAR(layers.unoccluded(0).mean, b.mean, 1e-6);
    }
    EXPECT_LT(truth.bounce(1).mean, 0.7 * open);
    EXPECT_GT(truth.bounce(1).mean, 0.2 * open);
    // A flag in the opening is what is left
    filtered.scene.lights[0].filters[0].is_inverted = true;
    const Estimate rest = render_direct(filtered, LightSampling::Light, 4096).bounce(1);
    EXPECT_NEAR(rest.mean + truth.bounce(1).mean, open,
                4.0 * (rest.standard_error + truth.bounce(1).standard_error) + 1e-6);
}

TEST(LightFilter, OpenDoorsChangeNoBit) {
    TestScene test = lamp_scene();
    const double plain = render(test).beauty().mean;
    scene::BarnDoorFilter doors;
    doors.opening = {Vec3(-1e6f, -1e6f, 0), Vec3(1e6f, 1e6f, 0)};
    test.scene.lights[0].filters = {filter_of(doors, Vec3d(0, 0, wall_z))};
    EXPECT_EQ(render(test).beauty().mean, plain);
}

TEST(LightFilter, HalvesWhateverTheLightDoes) {
    // Powers of two: exact, whatever strategy, and layers are scaled alike
    for (const LightSampling strategy : strategies)
        EXPECT_EQ(
            ratio(lamp_scene(), half(), {.size = 8, .estimator = {.light_sampling = strategy}}),
            0.5)
            << name_of(strategy);
    TestScene fog = lamp_scene();
    add_slab(fog, 1.0f).optics = white(0.3f);
    EXPECT_NEAR(ratio(fog, half(), {.size = 8}), 0.5, 1e-6) << "volume";
    scene::RodFilter everywhere;
    everywhere.box.lower = Vec3(-1000);
    everywhere.box.upper = Vec3(1000);
    scene::LightFilter rod = filter_of(everywhere);
    rod.tint = Rgb(0.5f);
    EXPECT_NEAR(ratio(fog, rod, {.size = 8}), 0.5, 1e-6) << "rod around a volume";
    TestScene dome = lamp_scene();
    dome.scene.lights[0].kind = LightKind::Dome;
    EXPECT_NEAR(ratio(dome, rod, {.size = 8}), 0.5, 1e-6) << "dome";
    TestScene lens = lamp_scene();
    lens.add_sphere(Vec3(1.2f, 0.0f, -4.0f), 0.5, lens.add_material(smooth_glass()));
    for (const auto caustics : {integrator::Caustics::Path, integrator::Caustics::Manifold})
        EXPECT_NEAR(ratio(lens, rod, {.size = 8, .last_bounce = 4, .caustics = caustics}), 0.5,
                    1e-4)
            << "caustics";
}

TEST(LightFilter, OfGeometryThatIsALight) {
    TestScene test;
    test.add_square(-2.0f, 10.0f, test.add_matte(Rgb(1.0f)));
    test.add_box(Vec3(2.0f, -0.5f, -1.2f), Vec3(3.0f, 0.5f, -1.0f), test.add_matte(Rgb(0.0f)));
    test.make_mesh_light();
    test.look_at_point(0.01);
    scene::RodFilter around;
    around.box.lower = Vec3(-1, -1, -3);
    around.box.upper = Vec3(1, 1, -1.9f);
    scene::LightFilter rod = filter_of(around);
    rod.tint = Rgb(0.5f);
    for (const LightSampling strategy : strategies)
        EXPECT_NEAR(ratio(test, rod,
                          {.size = 8, .last_bounce = 1, .estimator = {.light_sampling = strategy}}),
                    0.5, 1e-6)
            << name_of(strategy);
    // Doors in the space of its shape, for each instance
    scene::BarnDoorFilter doors;
    doors.opening.lower = Vec3(-100, 0, 0);
    doors.opening.upper = Vec3(100, 100, 0);
    test.scene.mesh_lights[0].filters = {filter_of(doors, Vec3d(0, 0, -1.5))};
    const Estimate direct = render_direct(test, LightSampling::Light, 1024).bounce(1);
    test.scene.mesh_lights[0].filters[0].parent_from_filter = at(Vec3d(-1, 0, -1.5));
    test.make_instance(Mat4());
    const Estimate placed = render_direct(test, LightSampling::Light, 1024).bounce(1);
    const double open = [&] {
        TestScene bare = test;
        bare.scene.mesh_lights[0].filters.clear();
        return render_direct(bare, LightSampling::Light, 1024).bounce(1).mean;
    }();
    // By symmetry half of the lamp is seen through them
    EXPECT_NEAR(direct.mean, 0.5 * open, 4.0 * direct.standard_error + 1e-4);
    EXPECT_NEAR(placed.mean, direct.mean,
                4.0 * std::hypot(direct.standard_error, placed.standard_error) + 1e-6);
}

TEST(LightFilter, IsNotSeenByTheCamera) {
    TestScene test;
    // It faces the camera
    test.add_light(LightKind::Rect, Mat4d(4, 0, 0, 0, 0, -4, 0, 0, 0, 0, -1, 0, 0, 0, -2, 1))
        .is_camera_visible = true;
    test.look_at_point(0.1);
    const double plain = render(test, {.size = 8}).beauty().mean;
    EXPECT_GT(plain, 0.5);
    test.scene.lights[0].filters = {half()};
    EXPECT_EQ(render(test, {.size = 8}).beauty().mean, plain);
    // In a mirror it is, as whatever the light shines on
    TestScene mirrored;
    mirrored.add_square(-2.0f, 10.0f, mirrored.add_material(mirror(Rgb(1.0f))));
    mirrored.add_light(LightKind::Dome, Mat4d());
    mirrored.look_at_point(0.1);
    EXPECT_NEAR(ratio(mirrored, half(), {.size = 8}), 0.5, 1e-6);
}

TEST(LightFilter, LayersOfTwoLightsStillAddUp) {
    TestScene test = lamp_scene();
    test.add_light(LightKind::Sphere, at(Vec3d(-2.0, 1.0, -3.0)));
    test.scene.lights[0].filters = {wall_filter(), half()};
    const RenderedLayers layers = render(test, {.size = 16, .samples = 64});
    double sum = 0.0;
    for (int group = 0; group < layers.groups; ++group)
        for (int column = 0; column <= 4; ++column) sum += layers.bounce(column, group).mean;
    EXPECT_NEAR(sum, layers.beauty().mean, 2e-3 * layers.beauty().mean);
    // The other light is what it is alone
    TestScene alone = test;
    alone.scene.lights[0].filters.clear();
    const Estimate a = layers.bounce(1, 1),
                   b = render(alone, {.size = 16, .samples = 64}).bounce(1, 1);
    EXPECT_NEAR(a.mean, b.mean, 4.0 * std::hypot(a.standard_error, b.standard_error) + 1e-6);
}

}  // namespace velatura::test
