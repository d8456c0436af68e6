// SPDX-License-Identifier: Apache-2.0
// An image whose caustics are solved for is one image however it is made, and the paths' own
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

TEST(CausticImage, IsTheSameForModesThreadsAndTiles) {
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

TEST(CausticImage, IsTheSameInPartsOfTheSamples) {
    const scene::Scene scene = scene_from_usda(room_usda(), 20, 16);
    const uint64_t expected =
        fingerprint(render_scene(scene, few_samples(), RenderSetup{.caustics = manifold}));
    EXPECT_EQ(fingerprint(render_scene(scene, few_samples(),
                                       RenderSetup{.sample_splits = {2, 5}, .caustics = manifold})),
              expected);
}

TEST(CausticImage, ScalesByPowersOfTwoBitIdentically) {
    const auto render = [](const std::string& ops) {
        return beauty(render_scene(scene_from_usda(room_usda(ops), 40, 34), few_samples(),
                                   RenderSetup{.caustics = manifold}));
    };
    const std::vector<double> unscaled = render("");
    for (const int k : {-20, -7, 10, 20})
        EXPECT_EQ(render(scaled_by(k)), unscaled) << "scaled by 2^" << k;
}

TEST(CausticImage, IsThatOfThePathsWhereNothingCastsCaustics) {
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

// A ball that is elsewhere when the shutter closes, a mirror that is nowhere when it opens.
TEST(CausticImage, OfWhatMovesIsThatOfThePaths) {
    const scene::Scene scene = scene_from_usda(R"usda(#usda 1.0
def Camera "Cam" {
    float focalLength = 30
    float2 clippingRange = (0, 0)
    double shutter:close = 1
    double3 xformOp:translate = (0, 1.2, 6)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def SphereLight "Lamp" {
    float inputs:intensity = 40
    float inputs:radius = 0.6
    double3 xformOp:translate = (1, 3, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Material "Mirror" {
    token outputs:surface.connect = </Mirror/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (1, 1, 1)
        float inputs:metallic = 1
        float inputs:roughness = 0
        token outputs:surface
    }
}
class Xform "Model" {
    def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        double radius = 0.6
        rel material:binding = </Mirror>
    }
}
def "A" (instanceable = true; prepend references = </Model>) {
    double3 xformOp:translate.timeSamples = { 0: (-1.5, 1, 0), 1: (1, 1.2, 0.5) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Mesh "Plate" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points.timeSamples = {
        0: [(-2, 0, -1), (-2, 0, -1), (-2, 0, -1), (-2, 0, -1)],
        1: [(-2, 0, -1), (1, 0, -2), (1, 2, -2), (-2, 2, -1)]
    }
    uniform token subdivisionScheme = "none"
    rel material:binding = </Mirror>
}
def Mesh "Floor" {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-5, 0, 5), (5, 0, 5), (5, 0, -5), (-5, 0, -5)]
    uniform token subdivisionScheme = "none"
    color3f[] primvars:displayColor = [(0.6, 0.6, 0.6)]
}
)usda",
                                               24, 16);
    // Light by one mirror, of the whole image
    const auto measure = [&](integrator::Caustics caustics, double& mean, double& variance) {
        constexpr int runs = 12;
        double sum = 0, squares = 0;
        for (int run = 0; run < runs; ++run) {
            integrator::RenderOptions options = few_samples();
            options.end_sample = 128;
            options.seed = uint64_t(run);
            const film::Film film = render_scene(scene, options, RenderSetup{.caustics = caustics});
            double light = 0;
            for (int y = 0; y < 16; ++y) {
                for (int x = 0; x < 24; ++x)
                    light += film.sums().total(x, y, film.sums().table().matrix(2, 0)).x;
            }
            sum += light;
            squares += light * light;
        }
        mean = sum / runs;
        variance = (squares / runs - mean * mean) / (runs - 1);
    };
    double by_paths = 0, paths_variance = 0, solved = 0, solved_variance = 0;
    measure(integrator::Caustics::Path, by_paths, paths_variance);
    measure(manifold, solved, solved_variance);
    const double error = std::sqrt(paths_variance + solved_variance);
    fmt::print(
        "caustics of what moves: {:.3f} by paths, {:.3f} solved for, standard error {:.3f}\n",
        by_paths, solved, error);
    EXPECT_LT(error, 0.05 * by_paths);
    EXPECT_NEAR(solved, by_paths, 4 * error);
}

TEST(CausticImage, AutoLeavesLargeLightsToThePaths) {
    scene::Scene scene = scene_from_usda(room_usda(), 40, 34);
    const uint64_t by_paths = fingerprint(render_scene(scene, few_samples()));
    for (scene::Light& l : scene.lights) {
        l.angle_deg = 30.0f;
        l.width = l.height = l.radius = l.length = 4.0f;
    }
    const uint64_t large = fingerprint(render_scene(scene, few_samples()));
    EXPECT_EQ(fingerprint(render_scene(scene, few_samples(),
                                       RenderSetup{.caustics = integrator::Caustics::SmallLights})),
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
                                       RenderSetup{.caustics = integrator::Caustics::SmallLights})),
              small);
}

}  // namespace velatura::test
