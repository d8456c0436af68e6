// SPDX-License-Identifier: Apache-2.0
// Bodies that absorb, against e^(−σd).
#include "integrator/interior.h"
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace velatura::test {

namespace {

constexpr float color[3] = {0.8f, 0.4f, 0.05f};
constexpr float depth = 0.7f;

double left_after(double distance, int channel) {
    return std::pow(double(color[channel]), distance / double(depth));
}

scene::Material colored_glass(float ior) {
    scene::Material m = smooth_glass(ior);
    m.transmission_color = scene::Input(Rgb(color[0], color[1], color[2]));
    m.transmission_depth = depth;
    return m;
}

/// Two parallel faces of one body, outsides away from each other; the upper one at z = top.
void add_slab(
    TestScene& test, float top, float bottom, float half_size, scene::MaterialId material) {
    test.add_square(top, half_size, material);
    test.add_square(bottom, half_size, material);
    test.scene.shapes.back().flip_normals = true;
}

}  // namespace

TEST(Absorption, SlabPerpendicularly) {
    TestScene test;
    add_slab(test, -1.0f, -1.5f, 1.0f, test.add_material(colored_glass(1.5f)));
    test.add_square(-2.0f, 1.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
    const RenderedLayers layers = render(test, {.size = 32, .samples = 1024, .last_bounce = 4});
    const double R = 0.04, T2 = (1.0 - R) * (1.0 - R);
    for (int c = 0; c < 3; ++c) {
        expect_close(layers.bounce(2, -1, c), T2 * left_after(0.5, c), 1e-2,
                     fmt::format("slab, channel {}", c));
    }
    // Once to and fro inside
    expect_close(layers.bounce(4, -1, 0), T2 * R * R * left_after(1.5, 0), 0.2,
                 "slab, after two reflections inside");
}

TEST(Absorption, SlabOfIndexOneIsPassedStraight) {
    TestScene test;
    add_slab(test, -1.0f, -1.5f, 1.0f, test.add_material(colored_glass(1.0f)));
    test.add_square(-2.0f, 1.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
    const RenderedLayers layers = render(test, {.size = 8, .samples = 4});
    for (int c = 0; c < 3; ++c)
        expect_close(layers.bounce(0, -1, c), left_after(0.5, c), 1e-5,
                     fmt::format("index 1, channel {}", c));
}

// Distances are those of the world, whatever places the body
TEST(Absorption, InstancesScaleTheDistance) {
    for (const double scale : {0.25, 3.0}) {
        TestScene test;
        const scene::MaterialId glass = test.add_material(colored_glass(1.0f));
        add_slab(test, 0.1f, -0.1f, 1.0f, glass);
        scene::Prototype prototype;
        prototype.shapes = std::move(test.scene.shapes);
        test.scene.shapes.clear();
        test.scene.prototypes.push_back(std::move(prototype));
        scene::Instance instance;
        instance.prototype = 0;
        Mat4d m;
        m.setScale(Vec3d(1.0, 1.0, scale));
        m = m * at(Vec3d(0, 0, -2));
        instance.render_from_prototype = Mat4(m);
        test.scene.instances.push_back(instance);
        test.add_square(-4.0f, 1.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
        const RenderedLayers layers = render(test, {.size = 8, .samples = 4});
        expect_close(layers.bounce(0, -1, 1), left_after(0.2 * scale, 1), 1e-5,
                     fmt::format("scaled by {}", scale));
    }
}

// A slab that moves along the view, from around the camera to before it: inside for half of the
// time
TEST(Absorption, CameraInsideForAWhile) {
    TestScene test;
    const scene::MaterialId glass = test.add_material(colored_glass(1.0f));
    add_slab(test, 0.5f, -0.5f, 50.0f, glass);
    for (scene::Shape& shape : test.scene.shapes) {
        auto& mesh = std::get<scene::Mesh>(shape.geometry);
        mesh.later_points = {mesh.points};
        for (Vec3& p : mesh.later_points[0]) p.z -= 1.0f;
    }
    test.add_square(-4.0f, 8.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
    test.look_at_point(1e-7);
    const RenderedLayers layers = render(test, {.size = 8, .samples = 1024});
    for (int c = 0; c < 3; ++c) {
        // At time t the way inside is 1/2 + t, and 1 from t = 1/2 on
        const double sigma = -std::log(left_after(1.0, c));
        const double expected =
            (std::exp(-0.5 * sigma) - std::exp(-sigma)) / sigma + 0.5 * std::exp(-sigma);
        expect_close(layers.bounce(0, -1, c), expected, 1e-3,
                     fmt::format("camera inside for a while, channel {}", c));
    }
}

TEST(Absorption, CameraInsideABall) {
    TestScene test;
    test.add_faceted_ball(1.0f, test.add_material(colored_glass(1.0f)));
    test.add_square(-4.0f, 8.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
    test.look_at_point(1e-7);
    // Where the axis leaves the ball of facets
    TestScene measure;
    measure.add_faceted_ball(1.0f, measure.add_matte(Rgb(0.0f), Rgb(1.0f)));
    Diagnostics diagnostics;
    const integrator::World world(measure.scene, {.width = 8, .height = 8}, {}, diagnostics);
    const geometry::Hit hit = world.accelerator->intersect({Vec3(0.0f), Vec3(0.0f, 0.0f, -1.0f)});
    ASSERT_TRUE(hit.is_valid());
    expect_close(render(test, {.size = 8, .samples = 4}).bounce(0, -1, 1),
                 left_after(double(hit.t), 1), 1e-4, "camera inside");
}

// A lamp and what it lights in one body: by light sampling and by chance
TEST(Absorption, LampInsideABody) {
    for (const integrator::LightSampling sampler :
         {integrator::LightSampling::Mis, integrator::LightSampling::Light,
          integrator::LightSampling::Bsdf}) {
        Estimate by[2];
        for (const bool absorbs : {false, true}) {
            TestScene test;
            scene::Material body = colored_glass(1.0f);
            if (!absorbs)
                body.transmission_depth = 0.0f, body.transmission_color = scene::Input(Rgb(1.0f));
            test.add_faceted_ball(3.0f, test.add_material(body));
            test.add_square(-1.0f, 0.01f, test.add_matte(Rgb(1.0f)));
            test.add_light(scene::LightKind::Sphere, at(Vec3d(0, 0, 0.5))).radius = 0.3f;
            by[absorbs] =
                render(test, {.size = 32, .samples = 128, .estimator = {.light_sampling = sampler}})
                    .bounce(1, 0, 1);
        }
        // 1 from the camera to the patch, from there to the near side of the lamp
        double expected = 0, norm = 0;
        constexpr int steps = 2000;
        for (int i = 0; i < steps; ++i) {
            // Directions in the cone of the ball of radius 0.3 at 1.5; the cosine and dω cancel to
            // s
            const double sine_max = 0.3 / 1.5, s = (i + 0.5) / steps * sine_max;
            const double mu = std::sqrt(1.0 - s * s), t = 1.5 * mu - std::sqrt(0.09 - 2.25 * s * s);
            expected += s * left_after(t + 1.0, 1);
            norm += s;
        }
        const double ratio = by[1].mean / by[0].mean;
        const double sigma = ratio * std::hypot(by[1].standard_error / by[1].mean,
                                                by[0].standard_error / by[0].mean);
        fmt::print("lamp inside, sampler {}: {:.5f} +- {:.5f}, expected {:.5f}\n", int(sampler),
                   ratio, sigma, expected / norm);
        EXPECT_NEAR(ratio, expected / norm, 4.0 * sigma + 1e-4);
        EXPECT_LT(5.3 * sigma, 0.15 * ratio) << "the test could not see 15 %";
    }
}

// What a sun brings below a slab: paths, and chains that are solved for
TEST(Absorption, ChainsThatAreSolvedForAbsorb) {
    TestScene test;
    test.add_square(-1.0f, 0.01f, test.add_matte(Rgb(1.0f)));
    add_slab(test, 0.75f, 0.25f, 4.0f, test.add_material(colored_glass(1.5f)));
    TestScene open;
    open.add_square(-1.0f, 0.01f, open.add_matte(Rgb(1.0f)));
    for (TestScene* t : {&test, &open})
        t->add_light(scene::LightKind::Distant, Mat4d()).angle_deg = 0.5f;
    const double without = render(open, {.size = 16, .samples = 64}).bounce(1).mean;
    const RenderedLayers layers = render(
        test,
        {.size = 16, .samples = 512, .last_bounce = 6, .caustics = integrator::Caustics::Manifold});
    EXPECT_GT(layers.rays.caustics_found, 0u);
    for (int c = 0; c < 3; ++c)
        expect_close(layers.bounce(3, 0, c), without * 0.96 * 0.96 * left_after(0.5, c), 4e-2,
                     fmt::format("sun below a slab, channel {}", c));
}

TEST(Absorption, LayersCloseAndWhiteAbsorbsNothing) {
    TestScene test;
    scene::Material clear = smooth_glass();
    clear.transmission_depth = 0.3f;
    add_slab(test, -1.0f, -1.5f, 1.0f, test.add_material(clear));
    test.add_square(-2.0f, 8.0f, test.add_matte(Rgb(0.5f), Rgb(1.0f)));
    TestScene same = test;
    same.scene.materials[0].transmission_depth = 0.0f;
    EXPECT_EQ(render(test, {.size = 8, .samples = 16}).beauty().mean,
              render(same, {.size = 8, .samples = 16}).beauty().mean);
    test.scene.materials[0].transmission_color = scene::Input(Rgb(color[0], color[1], color[2]));
    const RenderedLayers layers = render(test, {.size = 8, .samples = 64, .last_bounce = 4});
    for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (int k = 0; k <= 5; ++k) sum += layers.bounce(k, -1, c).mean;
        EXPECT_NEAR(sum / layers.beauty(c).mean, 1.0, 1e-6);
    }
}

// Bodies within bodies, enters without leaves and leaves without enters
TEST(H41NestedDielectrics, EntersAndLeavesNeedNotMatch) {
    scene::Scene scene;
    for (int i = 0; i < 4; ++i) {
        scene::Material m = colored_glass(1.5f);
        m.transmission_depth = float(i);
        scene.materials.push_back(m);
    }
    Diagnostics diagnostics;
    const shading::MaterialEvaluator materials(scene, diagnostics);
    const auto left = [&](const integrator::Interior& in) {
        return double(in.transmittance(materials, 1.0f).y);
    };
    const auto expected = [](int depth_of) { return std::pow(double(color[1]), 1.0 / depth_of); };
    integrator::Interior in;
    in.leave(2);
    EXPECT_TRUE(in.is_empty());
    EXPECT_EQ(left(in), 1.0);
    in.enter(materials, 1);
    in.enter(materials, 2);
    EXPECT_NEAR(left(in), expected(2), 1e-6);
    // A clear body displaces what it lies in
    in.enter(materials, 0);
    EXPECT_EQ(left(in), 1.0);
    in.leave(0);
    // Bodies that overlap are left in any order
    in.leave(1);
    EXPECT_NEAR(left(in), expected(2), 1e-6);
    in.leave(2);
    EXPECT_TRUE(in.is_empty());
    for (int i = 0; i < 100; ++i) in.enter(materials, 3);
    for (int i = 0; i < 100; ++i) in.leave(3);
    EXPECT_TRUE(in.is_empty());
    in.enter(materials, 3);
    const Rgb far = in.transmittance(materials, std::numeric_limits<float>::infinity());
    EXPECT_EQ(far.y, 0.0f);
    EXPECT_EQ(in.transmittance(materials, 0.0f).y, 1.0f);
}

}  // namespace velatura::test
