// SPDX-License-Identifier: Apache-2.0
// Bodies that overlap, touch or lie in each other, against closed forms of stacks (H41).
#include "hard_case.h"
#include "test_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace velatura::test {

namespace {

constexpr float glass_index = 1.5f, water_index = 1.33f;

scene::Material body(float ior, int priority) {
    scene::Material m = smooth_glass(ior);
    m.dielectric_priority = priority;
    return m;
}

/// Two parallel faces of one body, outsides away from each other.
void add_slab(
    TestScene& test, float top, float bottom, scene::MaterialId material, float half = 50.0f) {
    test.add_square(top, half, material);
    test.add_square(bottom, half, material);
    test.scene.shapes.back().flip_normals = true;
}

double reflectance(double a, double b) {
    return (a - b) * (a - b) / ((a + b) * (a + b));
}

/// What passes the faces between media of these indices, perpendicularly, whatever is reflected to
/// and fro between them: (1 − T)/T adds up.
double passed(const std::vector<double>& indices) {
    double sum = 0;
    for (size_t i = 1; i < indices.size(); ++i) {
        const double r = reflectance(indices[i - 1], indices[i]);
        sum += r / (1.0 - r);
    }
    return 1.0 / (1.0 + sum);
}

enum class Joint { Overlap, Coincident, Gap };

void expect_sound(const integrator::RayCounts& rays) {
    EXPECT_EQ(rays.dielectrics_unmatched, 0u);
    EXPECT_EQ(rays.dielectrics_too_deep, 0u);
    hardcase::expect_in_hard_case({"faces left without entering, bodies too deep",
                                   double(rays.dielectrics_unmatched + rays.dielectrics_too_deep),
                                   0, 0, "counters"});
    EXPECT_GT(rays.effects.of(scene::Effect::NestedDielectrics), 0u);
}

}  // namespace

// A pane of glass on water, from the air and from within the water
TEST(H41NestedDielectrics, GlassOnWaterPassesAsMuchAsItShould) {
    const double through = passed({1.0, double(glass_index), double(water_index)});
    EXPECT_NEAR(through, 0.956674, 1e-6);
    const double with_gap = passed({1.0, double(glass_index), 1.0, double(water_index)});
    for (const Joint joint : {Joint::Overlap, Joint::Coincident, Joint::Gap}) {
        for (const bool from_water : {false, true}) {
            TestScene test;
            const scene::MaterialId glass = test.add_material(body(glass_index, 2));
            const scene::MaterialId water = test.add_material(body(water_index, 1));
            const float shift = joint == Joint::Overlap ? 1e-3f
                                : joint == Joint::Gap   ? -1e-3f
                                                        : 0.0f;
            add_slab(test, -1.0f, -1.5f, glass);
            // What is seen lies in the water, or beyond the glass
            if (from_water)
                add_slab(test, 1.0f, -1.0f - shift, water);
            else
                add_slab(test, -1.5f + shift, -4.0f, water);
            test.add_square(-2.0f, 1.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
            // A film of air reflects more than glass and water that touch. Few pixels of many
            // samples: Sobol' points give each the reflections that it should have
            const bool has_film = joint == Joint::Gap;
            const RenderedLayers layers =
                render(test, {.size = has_film ? 9 : 8, .samples = has_film ? 4096u : 1024u});
            // Radiance is denser in water by the square of its index
            const double squared = double(water_index) * double(water_index);
            double expected = has_film ? with_gap : through;
            // The end of the water behind the camera sends back what the stack reflects
            if (from_water)
                expected /= 1.0 - (1.0 - expected) * reflectance(1.0, double(water_index));
            Estimate seen = layers.beauty();
            seen.mean *= from_water ? 1.0 / squared : squared;
            seen.standard_error *= from_water ? 1.0 / squared : squared;
            expect_close(seen, expected, 1e-3,
                         fmt::format("glass on water, joint {}, from {}", int(joint),
                                     from_water ? "water" : "air"));
            // Two faces where they are one boundary, three with a film of air
            expect_close(
                layers.bounce(has_film ? 3 : 2),
                (from_water ? squared : 1.0 / squared) *
                    (has_film
                         ? (1 - 0.04) * (1 - 0.04) * (1 - reflectance(1.0, double(water_index)))
                         : 0.96 * (1 - reflectance(double(glass_index), double(water_index)))),
                2e-3, "the straight way");
            expect_sound(layers.rays);
        }
    }
}

// Where two bodies touch it is the face of the first one that is seen, as where it lies in the
// other: here a frosted one
TEST(H41NestedDielectrics, TheFaceOfTheFirstIsSeenWhereTwoTouch) {
    const auto seen_through = [](float overlap, bool is_frosted, uint64_t samples) {
        TestScene test;
        scene::Material frosted = body(glass_index, 2);
        if (is_frosted) {
            frosted.roughness = scene::Input(0.4f);
            frosted.rough_transmission = true;
        }
        add_slab(test, -1.0f, -1.5f, test.add_material(frosted));
        add_slab(test, 1.0f, -1.0f - overlap, test.add_material(body(water_index, 1)));
        // Much smaller than what frost makes of it, beyond the pane
        test.add_square(-2.5f, 0.25f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
        const RenderedLayers layers = render(test, {.size = 32, .samples = samples});
        expect_sound(layers.rays);
        return layers.beauty();
    };
    const Estimate overlapping = seen_through(1e-3f, true, 256),
                   touching = seen_through(0.0f, true, 256), clear = seen_through(0.0f, false, 32);
    const double error = std::hypot(overlapping.standard_error, touching.standard_error);
    hardcase::expect_within(
        {"frosted pane that touches water, less one that reaches into it, in standard errors",
         std::abs(touching.mean - overlapping.mean) / error, 4, 0, "a second way",
         fmt::format("{:.1g} of the light", 5.2816 * error / overlapping.mean)});
    // Frost is seen at all
    EXPECT_GT(std::abs(clear.mean - touching.mean), 20 * error);
}

TEST(H41NestedDielectrics, AreAsDeepAsSixteen) {
    TestScene test;
    std::vector<double> indices = {1.0};
    for (int i = 0; i < 16; ++i) {
        const float ior = i % 2 ? 1.1f : 1.2f;
        indices.push_back(double(ior));
        add_slab(test, -1.0f - 0.1f * float(i), -20.0f + 0.1f * float(i),
                 test.add_material(body(ior, i + 1)));
    }
    test.add_square(-5.0f, 1.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
    const RenderedLayers layers = render(test, {.size = 14, .samples = 512, .last_bounce = 2});
    const double squared = indices.back() * indices.back();
    Estimate seen = layers.beauty();
    seen.mean *= squared;
    seen.standard_error *= squared;
    expect_close(seen, passed(indices), 1e-3, "sixteen bodies");
    expect_sound(layers.rays);
}

// Round ones, from every side: no light is lost, and no face counts twice or not at all
TEST(H41NestedDielectrics, RoundOnesLoseNothing) {
    for (const Joint joint : {Joint::Overlap, Joint::Coincident, Joint::Gap}) {
        for (const bool is_placed : {false, true}) {
            TestScene test;
            const Vec3 center(0.3f, -0.2f, -4.0f);
            const double inner = 0.7, shift = joint == Joint::Overlap ? 1e-3
                                              : joint == Joint::Gap   ? -1e-3
                                                                      : 0.0;
            // A hollow ball of glass, and what fills it
            const scene::MaterialId glass = test.add_material(body(glass_index, 2));
            test.add_sphere(center, 1.0, glass);
            test.add_sphere(center, inner, glass);
            test.scene.shapes.back().flip_normals = true;
            test.add_sphere(center, inner + shift, test.add_material(body(water_index, 1)));
            if (is_placed) {
                Mat4d m;
                m.setAxisAngle(normalize(Vec3d(0.3, 1.0, 0.2)), 0.2);
                test.make_instance(Mat4(m));
            }
            test.add_light(scene::LightKind::Dome, Mat4d()).is_camera_visible = true;
            test.look_with_perspective(0.3);
            const RenderedLayers layers = render(test, {.size = 32, .samples = 64});
            expect_close(layers.beauty(), 1.0, 2e-3,
                         fmt::format("round, joint {}{}", int(joint), is_placed ? ", placed" : ""));
            EXPECT_LE(layers.rays.dielectrics_unmatched,
                      layers.rays.effects.of(scene::Effect::NestedDielectrics) / 100000);
            EXPECT_EQ(layers.rays.dielectrics_too_deep, 0u);
        }
    }
}

// What lies in a body of a higher priority is not there: paths and shadow rays go through it
TEST(NestedDielectrics, WhatIsDisplacedIsNotThere) {
    RenderedLayers by[2] = {render({}, {.size = 1, .samples = 1}),
                            render({}, {.size = 1, .samples = 1})};
    for (int with = 0; with < 2; ++with) {
        TestScene test;
        test.add_square(-3.0f, 4.0f, test.add_matte(Rgb(0.6f)));
        add_slab(test, -0.5f, -2.5f, test.add_material(body(1.0f, 3)));
        scene::Material inside = body(1.6f, 1);
        inside.transmission_color = scene::Input(Rgb(0.1f));
        inside.transmission_depth = 0.1f;
        if (with) add_slab(test, -1.0f, -2.0f, test.add_material(inside));
        test.add_light(scene::LightKind::Sphere, at(Vec3d(0.5, 0.7, 1.0))).radius = 0.4f;
        test.look_with_perspective(0.3);
        by[with] = render(test, {.size = 32, .samples = 256});
    }
    // Light is sampled with other numbers behind more faces
    EXPECT_GT(by[0].bounce(1).mean, 1e-3);
    EXPECT_NEAR(by[1].bounce(1).mean / by[0].bounce(1).mean, 1.0, 2e-3);
    expect_agreement(by[1], by[0], 2e-3, "with what is displaced, and without");
}

// Glass in water is seen by the ratio of their indices, blurred or not, and bodies of one material
// that touch are one
TEST(NestedDielectrics, RelativeIndicesKeepTheEnergy) {
    for (const float roughness : {0.0f, 0.5f}) {
        TestScene test;
        test.add_sphere(Vec3(0, 0, -4), 1.2, test.add_material(body(water_index, 1)));
        scene::Material glass = body(glass_index, 2);
        glass.roughness = scene::Input(roughness);
        glass.rough_transmission = true;
        test.add_sphere(Vec3(0, 0, -4), 0.8, test.add_material(glass));
        test.add_light(scene::LightKind::Dome, Mat4d()).is_camera_visible = true;
        test.look_with_perspective(0.15);
        const Estimate e = render(test, {.size = 32, .samples = 256}).beauty();
        fmt::print("glass of roughness {} in water: {:.5f} +- {:.5f}\n", roughness, e.mean,
                   e.standard_error);
        EXPECT_NEAR(e.mean, 1.0, 2e-3 + 4.0 * e.standard_error);
    }
}

TEST(NestedDielectrics, OfOneMaterialAreOneWhereTheyTouch) {
    TestScene test;
    const scene::MaterialId glass = test.add_material(body(glass_index, 1));
    add_slab(test, -1.0f, -1.25f, glass);
    add_slab(test, -1.25f, -1.5f, glass);
    test.add_square(-2.0f, 1.0f, test.add_matte(Rgb(0.0f), Rgb(1.0f)));
    const RenderedLayers layers = render(test, {.size = 32, .samples = 512});
    expect_close(layers.bounce(2), 0.96 * 0.96, 2e-3, "two slabs that touch");
    expect_sound(layers.rays);
}

}  // namespace velatura::test
