// SPDX-License-Identifier: Apache-2.0
// A guided image is the unguided one with other noise, and one image however it is made.
#include "integrator/path_tracer.h"
#include "integrator/schedule.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::test {

namespace {

/// A closed room of matte walls, 3 high, whose lamp stands behind a baffle or in front of it;
/// behind it, light comes by the gap above.
std::string baffle_usda(const std::string& root_ops = "",
                        double baffle_height = 2.25,
                        double lamp_x = -2) {
    return R"usda(#usda 1.0
(
    upAxis = "Y"
)
def Xform "Root"
{
)usda" + root_ops +
           R"usda(
    def Camera "Cam"
    {
        float focalLength = 18
        float2 clippingRange = (0, 0)
        double3 xformOp:translate = (1.5, 1.5, 2.75)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Mesh "Room"
    {
        int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
        int[] faceVertexIndices = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1,
            5, 7, 3]
        point3f[] points = [(-3, 0, -3), (4, 0, -3), (-3, 3, -3), (4, 3, -3), (-3, 0, 3), (4, 0,
            3), (-3, 3, 3), (4, 3, 3)]
        uniform token subdivisionScheme = "none"
        color3f[] primvars:displayColor = [(0.75, 0.5, 0.5)]
    }
    def Mesh "Baffle"
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-1, 0, 3), (-1, 0, -3), (-1, )usda" +
           fmt::format("{0}, -3), (-1, {0}, 3)]", baffle_height) + R"usda(
        uniform token subdivisionScheme = "none"
        uniform bool doubleSided = 1
        color3f[] primvars:displayColor = [(0.5, 0.5, 0.75)]
    }
    def SphereLight "Lamp"
    {
        float inputs:intensity = 2000
        float inputs:radius = 0.25
        double3 xformOp:translate = ()usda" +
           fmt::format("{}", lamp_x) + R"usda(, 1, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
)usda";
}

/// A glass ball under a lamp, over a matte floor, before a broad gloss: delta and broad lobes on
/// one path.
std::string glass_usda() {
    return R"usda(#usda 1.0
(
    upAxis = "Y"
)
def Camera "Cam"
{
    float focalLength = 24
    float2 clippingRange = (0, 0)
    double3 xformOp:translate = (0, 1.25, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Mesh "Floor"
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3)]
    uniform token subdivisionScheme = "none"
    color3f[] primvars:displayColor = [(0.75, 0.75, 0.75)]
}
def Mesh "Back" (prepend apiSchemas = ["MaterialBindingAPI"])
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-3, 0, -2), (3, 0, -2), (3, 4, -2), (-3, 4, -2)]
    uniform token subdivisionScheme = "none"
    rel material:binding = </Gloss>
}
def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"])
{
    double radius = 0.75
    rel material:binding = </Glass>
    double3 xformOp:translate = (0, 1, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Material "Glass"
{
    token outputs:surface.connect = </Glass/S.outputs:surface>
    def Shader "S"
    {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:opacity = 0
        float inputs:roughness = 0
        token outputs:surface
    }
}
def Material "Gloss"
{
    token outputs:surface.connect = </Gloss/S.outputs:surface>
    def Shader "S"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.3, 0.5, 0.4)
        float inputs:roughness = 0.6
        float inputs:clearcoat = 1
        float inputs:clearcoatRoughness = 0
        token outputs:surface
    }
}
def SphereLight "Lamp"
{
    float inputs:intensity = 8
    float inputs:radius = 1
    double3 xformOp:translate = (1, 4, 0.5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)usda";
}

integrator::RenderOptions eleven_samples(
    integrator::RenderMode mode = integrator::RenderMode::Progressive, int tile_size = 32) {
    integrator::RenderOptions options;
    options.mode = mode;
    options.tile_size = tile_size;
    options.end_sample = 11;
    options.seed = 5;
    return options;
}

constexpr integrator::Guiding on = integrator::Guiding::On;

struct Sample {
    double mean = 0, variance = 0;
    int count = 0;
};

/// Mean radiance of the image, over renders with different seeds; each learns anew.
Sample image_means(const scene::Scene& scene,
                   integrator::Guiding guiding,
                   int renders,
                   uint64_t spp) {
    integrator::RenderOptions options;
    options.mode = integrator::RenderMode::Tile;
    options.end_sample = spp;
    std::vector<double> means;
    for (int i = 0; i < renders; ++i) {
        options.seed = uint64_t(1000 + i);
        double sum = 0;
        const std::vector<double> image =
            beauty(render_scene(scene, options, RenderSetup{.guiding = guiding}));
        for (const double v : image) sum += v;
        means.push_back(sum / double(image.size()) / double(spp));
    }
    Sample s;
    s.count = renders;
    for (const double m : means) s.mean += m / renders;
    for (const double m : means) s.variance += (m - s.mean) * (m - s.mean) / (renders - 1);
    return s;
}

/// Welch's test of guided against unguided means, valid only when it could see a difference of
/// `bound`.
void expect_same_mean(const std::string& usda, double bound, int renders, uint64_t spp) {
    const scene::Scene scene = scene_from_usda(usda, 24, 18);
    const Sample without = image_means(scene, integrator::Guiding::Off, renders, spp);
    const Sample with = image_means(scene, on, renders, spp);
    const double error = std::sqrt(without.variance / without.count + with.variance / with.count);
    // 3.3 for the level: 0.1 % two-sided at some 30 degrees of freedom is 3.6; 1.3 for 90 % power
    const double detectable = (3.6 + 1.3) * error / without.mean;
    fmt::print(
        "unguided {:.6g}, guided {:.6g}, difference {:+.2e}, detectable {:.2e}, noise guided / "
        "unguided {:.2f}\n",
        without.mean, with.mean, with.mean / without.mean - 1, detectable,
        std::sqrt(with.variance / without.variance));
    EXPECT_LE(std::abs(with.mean - without.mean), 3.6 * error);
    EXPECT_LE(detectable, bound) << "the test could not see its bound; more samples are needed";
}

}  // namespace

TEST(GuidedImage, HasTheMeanOfTheUnguidedOneInARoomBehindABaffle) {
    expect_same_mean(baffle_usda(), 0.03, 24, 64);
}

/// The small twin of the tests of GuidedImage.
TEST(GuidedSmallImage, HasTheMeanOfTheUnguidedOne) {
    expect_same_mean(baffle_usda(), 0.08, 12, 32);
}

TEST(GuidedImage, HasTheMeanOfTheUnguidedOneUnderGlass) {
    expect_same_mean(glass_usda(), 0.02, 24, 64);
}

TEST(GuidedImage, HasTheMeanOfTheUnguidedOneInABrightRoom) {
    expect_same_mean(baffle_usda("", 2.25, 2), 0.02, 24, 32);
}

TEST(GuidedImage, IsTheSameForModesThreadsAndTiles) {
    const scene::Scene scene = scene_from_usda(baffle_usda(), 40, 34);
    const uint64_t expected =
        fingerprint(render_scene(scene, eleven_samples(integrator::RenderMode::Tile, 16),
                                 RenderSetup{.threads = 1, .guiding = on}));
    EXPECT_NE(expected, fingerprint(render_scene(scene, eleven_samples()))) << "nothing was guided";
    for (const integrator::RenderMode mode :
         {integrator::RenderMode::Tile, integrator::RenderMode::Progressive}) {
        for (const int threads : {2, 3}) {
            EXPECT_EQ(fingerprint(render_scene(scene, eleven_samples(mode, 16 * threads),
                                               RenderSetup{.threads = threads, .guiding = on})),
                      expected)
                << "mode " << int(mode) << ", threads " << threads;
        }
    }
}

TEST(GuidedImage, IsTheSameInPartsOfTheSamples) {
    const scene::Scene scene = scene_from_usda(baffle_usda(), 20, 16);
    const uint64_t expected =
        fingerprint(render_scene(scene, eleven_samples(), RenderSetup{.guiding = on}));
    EXPECT_EQ(fingerprint(render_scene(scene, eleven_samples(),
                                       RenderSetup{.guiding = on, .sample_splits = {4, 10}})),
              expected);
}

TEST(GuidedImage, IsTheSameInACrop) {
    const scene::Scene scene = scene_from_usda(baffle_usda(), 40, 34);
    const film::Film whole = render_scene(scene, eleven_samples(), RenderSetup{.guiding = on});
    const film::Film part = render_scene(
        scene, eleven_samples(), RenderSetup{.guiding = on, .window = film::Window{7, 5, 30, 21}});
    int checked = 0;
    for (int y = 5; y < 21; ++y) {
        for (int x = 7; x < 30; ++x) {
            const accumulate::Triple a = whole.sums().total(x, y,
                                                            accumulate::AccumulatorTable::beauty),
                                     b = part.sums().total(x, y,
                                                           accumulate::AccumulatorTable::beauty);
            EXPECT_TRUE(a.x == b.x && a.y == b.y && a.z == b.z) << x << " " << y;
            ++checked;
        }
    }
    EXPECT_EQ(checked, 16 * 23);
}

TEST(GuidedImage, ScalesByPowersOfTwoBitIdentically) {
    const auto render = [](const std::string& ops) {
        return beauty(render_scene(scene_from_usda(baffle_usda(ops), 24, 18), eleven_samples(),
                                   RenderSetup{.guiding = on}));
    };
    const std::vector<double> unscaled = render("");
    for (const int k : {-20, 10}) {
        const std::string ops = fmt::format(R"(
    double3 xformOp:scale = ({0:.17g}, {0:.17g}, {0:.17g})
    uniform token[] xformOpOrder = ["xformOp:scale"]
)",
                                            std::ldexp(1.0, k));
        EXPECT_EQ(render(ops), unscaled) << "2^" << k;
    }
}

TEST(GuidedImage, WithNothingLearnedIsTheUnguidedOne) {
    const scene::Scene scene = scene_from_usda(room_usda(), 20, 16);
    Diagnostics diagnostics;
    film::LayerSet layers;
    for (const scene::LightGroup& g : scene.groups)
        layers.groups.push_back({g.name, g.prims, g.is_environment});
    const integrator::World world(scene, {.width = 20, .height = 16}, {}, diagnostics);
    const guiding::GuidingField nothing;
    const integrator::PathTracer without(world, layers, {.seed = 3}),
        with(world, layers, {.seed = 3, .guide = &nothing});
    film::SampleRadiance a(layers), b(layers);
    integrator::RayCounts counts;
    for (int i = 0; i < 20 * 16; ++i) {
        a.clear();
        b.clear();
        without.trace(i % 20, i / 20, 7, a, counts);
        with.trace(i % 20, i / 20, 7, b, counts);
        EXPECT_EQ(a.radiance(), b.radiance()) << i;
    }
}

TEST(GuideTraining, AutoGuidesWhereLightIsHardToFindOnly) {
    constexpr int width = 256, height = 192;
    const auto train = [](const std::string& usda) {
        const scene::Scene scene = scene_from_usda(usda, width, height);
        Diagnostics diagnostics;
        const integrator::World world(scene, {.width = width, .height = height}, {}, diagnostics);
        return integrator::train_guide(world, {.seed = 1}, integrator::Guiding::Auto);
    };
    const integrator::GuideTraining hard = train(baffle_usda()), easy = train(room_usda());
    fmt::print(
        "behind a baffle: variance {:.3g}, {} wins; bright room: variance {:.3g}, {} paths\n",
        hard.trial_variance, hard.wins, easy.trial_variance, easy.rays.paths);
    EXPECT_TRUE(hard.is_used);
    EXPECT_FALSE(easy.is_used);
    EXPECT_EQ(easy.rays.paths, uint64_t(width * height / 4))
        << "an easy scene pays for the first round only";
}

}  // namespace velatura::test
