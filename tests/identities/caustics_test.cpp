// SPDX-License-Identifier: Apache-2.0
// A picture whose caustics are solved for is one picture however it is made, and the paths' own
// where nothing casts any.
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::test {

namespace {

integrator::RenderOptions few_samples(
    integrator::RenderMode mode = integrator::RenderMode::Progressive, int tile_size = 32) {
    integrator::RenderOptions options;
    options.mode = mode;
    options.tile_size = tile_size;
    options.end_sample = 7;
    options.seed = 5;
    return options;
}

constexpr integrator::Caustics manifold = integrator::Caustics::Manifold;

std::string scaled_by(int k) {
    return fmt::format(R"(
    double3 xformOp:scale = ({0:.17g}, {0:.17g}, {0:.17g})
    uniform token[] xformOpOrder = ["xformOp:scale"]
)",
                       std::ldexp(1.0, k));
}

}  // namespace

TEST(CausticPicture, IsTheSameForModesThreadsAndTiles) {
    const scene::Scene scene = scene_from_usda(room_usda(), 40, 34);
    const uint64_t expected =
        fingerprint(render_scene(scene, few_samples(integrator::RenderMode::Tile, 16),
                                 RenderSetup{.threads = 1, .caustics = manifold}));
    EXPECT_NE(expected, fingerprint(render_scene(scene, few_samples())))
        << "nothing was solved for";
    for (const integrator::RenderMode mode :
         {integrator::RenderMode::Tile, integrator::RenderMode::Progressive}) {
        for (const int threads : {2, 3}) {
            EXPECT_EQ(
                fingerprint(render_scene(scene, few_samples(mode, 16 * threads),
                                         RenderSetup{.threads = threads, .caustics = manifold})),
                expected)
                << "mode " << int(mode) << ", threads " << threads;
        }
    }
}

TEST(CausticPicture, IsTheSameInPartsOfTheSamples) {
    const scene::Scene scene = scene_from_usda(room_usda(), 20, 16);
    const uint64_t expected =
        fingerprint(render_scene(scene, few_samples(), RenderSetup{.caustics = manifold}));
    EXPECT_EQ(fingerprint(render_scene(scene, few_samples(),
                                       RenderSetup{.sample_splits = {2, 5}, .caustics = manifold})),
              expected);
}

TEST(CausticPicture, ScalesByPowersOfTwoBitIdentically) {
    const auto render = [](const std::string& ops) {
        return beauty(render_scene(scene_from_usda(room_usda(ops), 40, 34), few_samples(),
                                   RenderSetup{.caustics = manifold}));
    };
    const std::vector<double> unscaled = render("");
    for (const int k : {-20, -7, 10, 20})
        EXPECT_EQ(render(scaled_by(k)), unscaled) << "scaled by 2^" << k;
}

TEST(CausticPicture, IsThatOfThePathsWhereNothingCastsCaustics) {
    scene::Scene scene = scene_from_usda(room_usda(), 40, 34);
    for (scene::Material& m : scene.materials) {
        m.roughness = scene::Input(0.5f);
        m.clearcoat = scene::Input(0.0f);
        m.opacity = scene::Input(1.0f);
    }
    const uint64_t by_paths = fingerprint(render_scene(scene, few_samples()));
    EXPECT_EQ(fingerprint(render_scene(scene, few_samples(), RenderSetup{.caustics = manifold})),
              by_paths);
}

TEST(CausticPicture, AutoLeavesLargeLightsToThePaths) {
    scene::Scene scene = scene_from_usda(room_usda(), 40, 34);
    const uint64_t by_paths = fingerprint(render_scene(scene, few_samples()));
    for (scene::Light& l : scene.lights) {
        l.angle_deg = 30.0f;
        l.width = l.height = l.radius = l.length = 4.0f;
    }
    const uint64_t large = fingerprint(render_scene(scene, few_samples()));
    EXPECT_EQ(fingerprint(render_scene(scene, few_samples(),
                                       RenderSetup{.caustics = integrator::Caustics::Auto})),
              large);
    EXPECT_NE(fingerprint(render_scene(scene, few_samples(), RenderSetup{.caustics = manifold})),
              large);
    for (scene::Light& l : scene.lights) {
        l.angle_deg = 0.5f;
        l.width = l.height = l.radius = l.length = 0.01f;
    }
    const uint64_t small =
        fingerprint(render_scene(scene, few_samples(), RenderSetup{.caustics = manifold}));
    EXPECT_NE(small, by_paths);
    EXPECT_EQ(fingerprint(render_scene(scene, few_samples(),
                                       RenderSetup{.caustics = integrator::Caustics::Auto})),
              small);
}

}  // namespace velatura::test
