// SPDX-License-Identifier: Apache-2.0
// Light tracing: caustics with a closed form, the means of paths layer by layer, and one image
// however it is made.
#include "integrator/caster_points.h"
#include "integrator/light_tracer.h"
#include "integrator/sample_placement.h"
#include "render/renderer.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace velatura::test {

namespace {

using integrator::Caustics;
using integrator::RenderMode;
using integrator::RenderOptions;

constexpr Caustics light_tracing = Caustics::Light;

RenderOptions options_of(uint64_t samples, bool adaptive = false) {
    RenderOptions options;
    options.end_sample = samples;
    options.adaptive = adaptive;
    options.tile_size = 16;
    options.seed = 5;
    return options;
}

/// Smooth and rough casters, a squashed ball, a coat over tinted glass, a cut-out; lamps of three
/// kinds and a dome; seen through a lens. Lamps so large that paths find the caustics, too.
std::string casters_usda() {
    return R"usda(#usda 1.0
(
    upAxis = "Y"
)
def Camera "Cam" { 
  float focalLength = 35
  float horizontalAperture = 36
  float verticalAperture = 36
  float fStop = 1.4
  float focusDistance = 6
  double3 xformOp:translate = (0, 3.2, 6)
  double xformOp:rotateX = -25
  uniform token[] xformOpOrder = ["xformOp:translate","xformOp:rotateX"]
}
def Mesh "Floor" (prepend apiSchemas=["MaterialBindingAPI"]) {
  int[] faceVertexCounts=[4]
  int[] faceVertexIndices=[0,1,2,3]
  point3f[] points=[(-5,0,5),(5,0,5),(5,0,-5),(-5,0,-5)]
  rel material:binding = </M/Floor>
}
def Mesh "Wall" (prepend apiSchemas=["MaterialBindingAPI"]) {
  int[] faceVertexCounts=[4]
  int[] faceVertexIndices=[0,1,2,3]
  point3f[] points=[(-5,0,-3),(5,0,-3),(5,5,-3),(-5,5,-3)]
  color3f[] primvars:displayColor=[(0.7,0.5,0.3)]
}
def Sphere "Ball" (prepend apiSchemas=["MaterialBindingAPI"]) {
  double radius = 0.7
  double3 xformOp:translate = (-1.5,0.75,0.5)
  float3 xformOp:scale = (1,1,0.6)
  double xformOp:rotateY = 30
  uniform token[] xformOpOrder = ["xformOp:translate","xformOp:rotateY","xformOp:scale"]
  rel material:binding = </M/Glass>
}
def Cylinder "Can" (prepend apiSchemas=["MaterialBindingAPI"]) {
  double radius = 0.4
  double height = 1
  uniform token axis = "Y"
  double3 xformOp:translate = (0.2,0.5,0.3)
  uniform token[] xformOpOrder = ["xformOp:translate"]
  rel material:binding = </M/Metal>
}
def Mesh "Cube" (prepend apiSchemas=["MaterialBindingAPI"]) {
  int[] faceVertexCounts=[4,4,4,4,4,4]
  int[] faceVertexIndices=[0,1,3,2, 4,6,7,5, 0,4,5,1, 2,3,7,6, 0,2,6,4, 1,5,7,3]
  point3f[] points=[(-.5,-.5,-.5),(-.5,-.5,.5),(-.5,.5,-.5),(-.5,.5,.5),
    (.5,-.5,-.5),(.5,-.5,.5),(.5,.5,-.5),(.5,.5,.5)]
  uniform token subdivisionScheme = "none"
  double3 xformOp:translate = (1.6,0.6,0.4)
  double xformOp:rotateY = 25
  uniform token[] xformOpOrder = ["xformOp:translate","xformOp:rotateY"]
  rel material:binding = </M/Tint>
}
def Mesh "Pane" (prepend apiSchemas=["MaterialBindingAPI"]) {
  int[] faceVertexCounts=[4]
  int[] faceVertexIndices=[0,1,2,3]
  point3f[] points=[(-1,0.01,2.2),(1,0.01,2.2),(1,1,2.2),(-1,1,2.2)]
  rel material:binding = </M/Cut>
}
def Scope "M" {
 def Material "Floor" {
 token outputs:surface.connect=</M/Floor/S.outputs:surface>
  def Shader "S" {
 uniform token info:id="UsdPreviewSurface"
 color3f inputs:diffuseColor=(.5,.5,.5)
 float inputs:roughness=0.25
 token outputs:surface
 }
 }
 def Material "Glass" {
 token outputs:surface.connect=</M/Glass/S.outputs:surface>
  def Shader "S" {
 uniform token info:id="UsdPreviewSurface"
 color3f inputs:diffuseColor=(0,0,0)
 float inputs:roughness=0
 float inputs:opacity=0
 float inputs:ior=1.5
 token outputs:surface
 }
 }
 def Material "Tint" {
 token outputs:surface.connect=</M/Tint/S.outputs:surface>
  def Shader "S" {
 uniform token info:id="UsdPreviewSurface"
 color3f inputs:diffuseColor=(.6,.2,.1)
 float inputs:roughness=0.1
 float inputs:opacity=0.3
 float inputs:clearcoat=0.5
 float inputs:clearcoatRoughness=0.02
 float inputs:ior=1.5
 token outputs:surface
 }
 }
 def Material "Metal" {
 token outputs:surface.connect=</M/Metal/S.outputs:surface>
  def Shader "S" {
 uniform token info:id="UsdPreviewSurface"
 color3f inputs:diffuseColor=(.9,.7,.4)
 float inputs:metallic=1
 float inputs:roughness=0.2
 token outputs:surface
 }
 }
 def Material "Cut" {
 token outputs:surface.connect=</M/Cut/S.outputs:surface>
  def Shader "S" {
 uniform token info:id="UsdPreviewSurface"
 color3f inputs:diffuseColor=(.3,.6,.3)
 float inputs:roughness=0.05
 float inputs:opacity=0.5
 token inputs:opacityMode="presence"
 token outputs:surface
 }
 }
}
def SphereLight "Key" {
 float inputs:intensity=14
 float inputs:radius=0.8
  double3 xformOp:translate=(-3,4,2) 
  uniform token[] xformOpOrder=["xformOp:translate"]
}
def RectLight "Rect" {
 float inputs:intensity=6
 float inputs:width=1.5
 float inputs:height=1.5
  double3 xformOp:translate=(3,4.5,1)
  float3 xformOp:rotateXYZ=(-80,20,0)
  uniform token[] xformOpOrder=["xformOp:translate","xformOp:rotateXYZ"]
}
def DistantLight "Sun" {
 float inputs:intensity=1.2
 float inputs:angle=25
  float3 xformOp:rotateXYZ=(-50,-35,0)
  uniform token[] xformOpOrder=["xformOp:rotateXYZ"]
}
def DomeLight "Sky" {
 float inputs:intensity=0.15
 }
)usda";
}

/// A white floor at y = 0 of 2 by 2, seen from above alone, and a perfect mirror in the plane x = 2
/// in which the whole floor sees the lamp. `camera`: its attributes.
std::string mirror_usda(const std::string& camera, const std::string& lamp) {
    return R"usda(#usda 1.0
(
    upAxis = "Y"
)
def Camera "Cam" {
    float2 clippingRange = (0.5, 100)
    double3 xformOp:translate = (0, 4, 0)
    double xformOp:rotateX = -90
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
)usda" + camera +
           R"usda(
}
def Mesh "Floor" {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)]
    uniform token subdivisionScheme = "none"
    color3f[] primvars:displayColor = [(1, 1, 1)]
}
def Mesh "Mirror" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(2, 0.4, 1), (2, 0.4, -1), (2, 2.4, -1), (2, 2.4, 1)]
    uniform token subdivisionScheme = "none"
    rel material:binding = </Mirror_>
}
def Material "Mirror_" {
    token outputs:surface.connect = </Mirror_/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (1, 1, 1)
        float inputs:metallic = 1
        float inputs:roughness = 0
        token outputs:surface
    }
}
)usda" + lamp;
}

/// Mean over the image of the light after two scatterings, and its standard error by runs.
struct Measured {
    double mean = 0, standard_error = 0;
};

double sum_of(const film::Film& film, uint32_t accumulator) {
    const film::Window& w = film.window();
    double sum = 0;
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x) {
            const accumulate::Triple t = film.sums().total(x, y, accumulator);
            sum += (t.x + t.y + t.z) / 3.0 / double(film.sums().record(x, y).end);
        }
    return sum / double(w.pixel_count());
}

Measured second_bounce(const scene::Scene& scene, uint64_t samples, const RenderSetup& setup) {
    constexpr int runs = 8;
    double sum = 0, squares = 0;
    for (int run = 0; run < runs; ++run) {
        RenderOptions options = options_of(samples);
        options.seed = uint64_t(run);
        const film::Film film = render_scene(scene, options, setup);
        const double light = sum_of(film, film.sums().table().matrix(2, 0));
        sum += light;
        squares += light * light;
    }
    const double mean = sum / runs;
    return {mean, std::sqrt(std::max(0.0, squares / runs - mean * mean) / (runs - 1))};
}

}  // namespace

// A mirror shows the lamp a second time, as far behind it: the floor's irradiance by the image of a
// small ball of radius r and radiance 1 is π r² cos θ / d² (exact for a ball that is wholly above
// the horizon), by a distant lamp of irradiance E across its direction E cos θ. The mean over the
// floor by the midpoint rule.
TEST(LightTracing, AMirrorShowsTheLampASecondTime) {
    struct Case {
        const char* what;
        std::string camera, lamp;
        double (*irradiance)(double x, double z);
    };

    const std::string pinhole =
                          "float focalLength = 20\nfloat horizontalAperture = "
                          "9\nfloat verticalAperture = 9\n",
                      lens = pinhole + "float fStop = 20\nfloat focusDistance = 3\n",
                      orthographic =
                          "token projection = \"orthographic\"\n"
                          "float horizontalAperture = 18\n"
                          "float verticalAperture = 18\n";
    const std::string ball = R"(
def SphereLight "Lamp" {
    float inputs:intensity = 1
    float inputs:radius = 0.1
    double3 xformOp:translate = (0.5, 1.5, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)";
    // Toward the mirror and down: from (-0.8, 0.6, 0); what it reflects comes from (0.8, 0.6, 0)
    const std::string sun = R"(
def DistantLight "Lamp" {
    float inputs:intensity = 1
    float inputs:angle = 1
    bool inputs:normalize = 1
    double xformOp:rotateZ = 53.13010235415598
    double xformOp:rotateX = -90
    uniform token[] xformOpOrder = ["xformOp:rotateZ", "xformOp:rotateX"]
}
)";
    const auto by_ball = [](double x, double z) {
        const double dx = 3.5 - x, d2 = dx * dx + 1.5 * 1.5 + z * z;
        return pi_d * 0.01 * 1.5 / (d2 * std::sqrt(d2));
    };
    const auto by_sun = [](double, double) { return 0.6; };
    const Case cases[] = {{"ball, pinhole", pinhole, ball, by_ball},
                          {"ball, lens", lens, ball, by_ball},
                          {"ball, orthographic", orthographic, ball, by_ball},
                          {"sun, pinhole", pinhole, sun, by_sun}};
    for (const Case& c : cases) {
        const scene::Scene scene = scene_from_usda(mirror_usda(c.camera, c.lamp), 24, 24);
        const Measured found = second_bounce(scene, 256, RenderSetup{.caustics = light_tracing});
        // All of the film lies on the floor: 1.8 wide at a distance of 4
        constexpr int steps = 200;
        double expected = 0;
        for (int i = 0; i < steps; ++i)
            for (int k = 0; k < steps; ++k)
                expected +=
                    c.irradiance(-0.9 + 1.8 * (i + 0.5) / steps, -0.9 + 1.8 * (k + 0.5) / steps);
        expected /= pi_d * steps * steps;
        fmt::print("{}: {:.6f}, closed form {:.6f}, standard error {:.6f}\n", c.what, found.mean,
                   expected, found.standard_error);
        EXPECT_LT(found.standard_error, 0.01 * expected) << c.what;
        EXPECT_NEAR(found.mean, expected, 4 * found.standard_error + 1e-3 * expected) << c.what;
    }
}

// Welch's test of each bounce and light, of the whole image; the caustics of paths themselves are
// what it needs so many samples for.
TEST(LightTracing, EachLayerHasTheMeanOfPaths) {
    const scene::Scene scene = scene_from_usda(casters_usda(), 24, 24);
    constexpr int runs = 10;
    constexpr int bounces = 4;
    const size_t groups = scene.groups.size();
    std::vector<double> sums[2], squares[2];
    for (int way = 0; way < 2; ++way) {
        sums[way].resize(bounces * groups);
        squares[way].resize(bounces * groups);
        for (int run = 0; run < runs; ++run) {
            RenderOptions options = options_of(64);
            options.seed = uint64_t(100 * way + run);
            const film::Film film = render_scene(
                scene, options, RenderSetup{.caustics = way == 0 ? Caustics::Path : light_tracing});
            for (size_t b = 0; b < bounces; ++b)
                for (size_t g = 0; g < groups; ++g) {
                    const double light = sum_of(film, film.sums().table().matrix(int(b), int(g)));
                    sums[way][b * groups + g] += light;
                    squares[way][b * groups + g] += light * light;
                }
        }
    }
    double detectable = 0;
    for (size_t i = 0; i < bounces * groups; ++i) {
        double means[2], variance = 0;
        for (int way = 0; way < 2; ++way) {
            means[way] = sums[way][i] / runs;
            variance += (squares[way][i] / runs - means[way] * means[way]) / (runs - 1);
        }
        const double error = std::sqrt(std::max(variance, 0.0));
        if (means[0] > 0.0) detectable = std::max(detectable, 4.5 * error / means[0]);
        EXPECT_NEAR(means[1], means[0], 4.5 * error + 1e-7 * means[0])
            << "bounce " << i / groups << ", light " << scene.groups[i % groups].name;
    }
    fmt::print("layers: the largest deviation that may stay unseen is {:.1f} % of a layer\n",
               100 * detectable);
    EXPECT_LT(detectable, 0.25);
}

// What a filter does depends on the segment between lamp and mirror, whoever finds it.
TEST(LightTracing, FilteredLampsHaveTheMeanOfPaths) {
    const std::string camera =
        "float focalLength = 36\nfloat horizontalAperture = 24\nfloat verticalAperture = 24";
    const std::string lamp = R"usda(def SphereLight "L" {
    float inputs:intensity = 10
    float inputs:radius = 0.6
    rel light:filters = [</Rod>, </Ramp>]
    double3 xformOp:translate = (0, 2.5, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)usda";
    const std::string filters = R"usda(def PxrRodLightFilter "Rod" {
    float inputs:ri:lightFilter:edge = 0.8
    float inputs:ri:lightFilter:depth = 4
    float inputs:ri:lightFilter:intensity = 0.25
    double3 xformOp:translate = (2, 0.9, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def PxrRampLightFilter "Ramp" {
    float inputs:ri:lightFilter:beginDist = 1
    float inputs:ri:lightFilter:endDist = 4
}
)usda";
    const auto measured = [&](const std::string& text, Caustics caustics) {
        // Paths seldom meet the lamp by way of the mirror
        const uint64_t samples = caustics == Caustics::Path ? 2048 : 512;
        return second_bounce(scene_from_usda(text, 12, 12), samples,
                             RenderSetup{.caustics = caustics});
    };
    const std::string text = mirror_usda(camera, lamp + filters);
    const Measured paths = measured(text, Caustics::Path);
    scene::Scene bare = scene_from_usda(text, 12, 12);
    bare.lights.at(0).filters.clear();
    EXPECT_LT(paths.mean,
              0.6 * second_bounce(bare, 64, RenderSetup{.caustics = light_tracing}).mean);
    for (const Caustics caustics : {Caustics::Manifold, light_tracing}) {
        const Measured other = measured(text, caustics);
        const double error = std::hypot(paths.standard_error, other.standard_error);
        fmt::print("paths {:.6g}, other {:.6g}, detectable {:.2g}\n", paths.mean, other.mean,
                   5.2816 * error / paths.mean);
        EXPECT_NEAR(other.mean, paths.mean, 4.0 * error);
        EXPECT_LT(error, 0.03 * paths.mean);
    }
}

TEST(LightTracing, OneImageHoweverItIsMade) {
    const scene::Scene scene = scene_from_usda(casters_usda(), 40, 24);
    const RenderOptions options = options_of(40, true);
    const uint64_t expected =
        fingerprint(render_scene(scene, options, {.threads = 1, .caustics = light_tracing}));
    EXPECT_NE(expected, fingerprint(render_scene(scene, options, {}))) << "no light was traced";
    RenderOptions tiles = options;
    tiles.mode = RenderMode::Tile;
    EXPECT_EQ(fingerprint(render_scene(scene, tiles, {.threads = 2, .caustics = light_tracing})),
              expected)
        << "tiles";
    for (const std::vector<uint64_t>& splits :
         {std::vector<uint64_t>{16}, {3, 17}, {16, 20, 33}, {1, 2, 39}})
        EXPECT_EQ(fingerprint(render_scene(scene, options,
                                           {.sample_splits = splits, .caustics = light_tracing})),
                  expected)
            << "parts from sample " << splits.back();
}

TEST(LightTracing, ACropIsAPartOfTheImage) {
    const scene::Scene scene = scene_from_usda(casters_usda(), 40, 24);
    const RenderOptions options = options_of(6);
    const film::Film whole = render_scene(scene, options, {.caustics = light_tracing}),
                     part = render_scene(
                         scene, options,
                         {.window = film::Window{7, 5, 30, 20}, .caustics = light_tracing});
    for (int y = 5; y < 20; ++y)
        for (int x = 7; x < 30; ++x) {
            const auto beauty = accumulate::AccumulatorTable::beauty;
            const accumulate::Triple a = whole.sums().total(x, y, beauty),
                                     b = part.sums().total(x, y, beauty);
            ASSERT_TRUE(a.x == b.x && a.y == b.y && a.z == b.z) << x << ", " << y;
        }
}

TEST(LightTracing, ScalesByPowersOfTwoBitIdentically) {
    const auto render = [](const std::string& ops) {
        return beauty(render_scene(scene_from_usda(room_usda(ops), 24, 20), options_of(4),
                                   {.caustics = light_tracing}));
    };
    const std::vector<double> unscaled = render("");
    for (const int k : {-20, 7})
        EXPECT_EQ(render(fmt::format(R"(
    double3 xformOp:scale = ({0:.17g}, {0:.17g}, {0:.17g})
    uniform token[] xformOpOrder = ["xformOp:scale"]
)",
                                     std::ldexp(1.0, k))),
                  unscaled)
            << "scaled by 2^" << k;
}

TEST(LightTracing, IsThePathsOwnImageWhereNothingCastsCaustics) {
    scene::Scene scene = scene_from_usda(room_usda(), 40, 34);
    for (scene::Material& m : scene.materials) {
        m.roughness = scene::Input(0.8f);
        m.clearcoat = scene::Input(0.0f);
        m.opacity = scene::Input(1.0f);
    }
    EXPECT_EQ(fingerprint(render_scene(scene, options_of(4), {.caustics = light_tracing})),
              fingerprint(render_scene(scene, options_of(4), {})));
    EXPECT_FALSE(integrator::CausticPaths::can_exist(scene));
}

// A filter with negative lobes weighs its samples by two numbers, one of them negative; so do
// splats. The mean over an image that is the same all over does not depend on the filter.
TEST(LightTracing, EveryFilterHasTheSameMean) {
    const std::string lamp = R"(
def DistantLight "Lamp" {
    float inputs:intensity = 1
    float inputs:angle = 1
    bool inputs:normalize = 1
    double xformOp:rotateZ = 53.13010235415598
    double xformOp:rotateX = -90
    uniform token[] xformOpOrder = ["xformOp:rotateZ", "xformOp:rotateX"]
}
)";
    const scene::Scene scene =
        scene_from_usda(mirror_usda("float focalLength = 20\nfloat horizontalAperture = 9\n"
                                    "float verticalAperture = 9\n",
                                    lamp),
                        24, 24);
    for (const sampling::FilterKind filter :
         {sampling::FilterKind::Box, sampling::FilterKind::BlackmanHarris,
          sampling::FilterKind::Mitchell}) {
        render::Settings settings;
        settings.layers.last_bounce = 3;
        settings.layers.matrix_layers = true;
        settings.layers = render::with_rows(std::move(settings.layers), scene);
        settings.tracer.filter = filter;
        settings.splits = false;
        settings.caustics = light_tracing;
        settings.schedule.end_sample = 256;
        Diagnostics diagnostics;
        render::Renderer renderer(scene, settings);
        renderer.prepare(diagnostics);
        renderer.advance();
        const film::Film& film = renderer.film();
        EXPECT_EQ(film.invalid_count(), 0u);
        // Weights of Mitchell's samples sum to their number over four of them
        const double mean = sum_of(film, film.sums().table().matrix(2, 0));
        EXPECT_NEAR(mean, 0.6 / pi_d, 0.02 * 0.6 / pi_d) << sampling::filter_name(filter);
    }
}

// The mean of 1 / pdf over samples, those without value counted as 0, is the area.
TEST(CasterPoints, SampleTheWholeAreaByArea) {
    const scene::Scene scene = scene_from_usda(R"usda(#usda 1.0
def Camera "Cam" {
    double3 xformOp:translate = (0, 0, 9)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def SphereLight "Lamp" {
}
class Xform "Model" {
    def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        double radius = 0.5
        rel material:binding = </Glass>
    }
}
def "A" (instanceable = true; prepend references = </Model>) {
    float3 xformOp:scale = (2, 2, 2)
    double3 xformOp:translate = (3, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
}
def Cylinder "Can" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    double radius = 0.5
    double height = 2
    rel material:binding = </Glass>
}
def Mesh "Sheet" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-3, 0, 0), (-1, 0, 0), (-1, 3, 0), (-3, 3, 0)]
    uniform token subdivisionScheme = "none"
    rel material:binding = </Glass>
}
def Material "Glass" {
    token outputs:surface.connect = </Glass/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:opacity = 0
        float inputs:roughness = 0
        token outputs:surface
    }
}
)usda",
                                               16, 16);
    const integrator::World world(
        scene, {.width = 16, .height = 16}, {}, *[] {
            static Diagnostics diagnostics;
            return &diagnostics;
        }());
    const integrator::CausticPaths paths(world);
    // Ball of radius 1 as placed, can with both caps, sheet
    const double areas[] = {4.0 * pi_d, pi_d * 1.0 * 2.0 + 2.0 * pi_d * 0.25, 6.0};
    const auto& casters = paths.casters().shapes().casters();
    ASSERT_EQ(casters.size(), 3u);
    std::vector<double> found;
    for (uint32_t c = 0; c < casters.size(); ++c) {
        double sum = 0;
        constexpr int count = 40000;
        for (int i = 0; i < count; ++i) {
            const sampling::PixelSampler sampler(7, int(c), 0, uint64_t(i));
            integrator::CasterNumbers numbers;
            numbers.u_piece = sampler.get_1d(0, sampling::Purpose::ManifoldTriangle);
            numbers.u_point = sampler.get_2d(0, sampling::Purpose::ManifoldPoint);
            numbers.u_direction = sampler.get_2d(0, sampling::Purpose::ManifoldSeed);
            if (const auto point = paths.casters().sample(c, numbers, 0.0f))
                sum += 1.0 / point->pdf;
        }
        found.push_back(sum / count);
    }
    std::sort(found.begin(), found.end());
    std::vector<double> expected(std::begin(areas), std::end(areas));
    std::sort(expected.begin(), expected.end());
    for (size_t i = 0; i < found.size(); ++i)
        EXPECT_NEAR(found[i], expected[i], 0.01 * expected[i]);
}

// Whatever the rate, the samples of a pixel get each pass as often as any other, even ones even
// passes alone.
TEST(LightPasses, AreSharedEvenly) {
    const film::Window window{0, 0, 3, 1};
    // Rates 8, 1/4 and about 1 are what such merits come to
    const integrator::SampleRates rates(window, {100.0f, 0.001f, 1.0f});
    for (int x = 0; x < 3; ++x) {
        constexpr uint64_t index = 64;
        const uint64_t count = rates.count(x, 0, index);
        std::vector<double> weight(index);
        uint64_t last_begin = 0;
        for (uint64_t s = 0; s < count; ++s) {
            const integrator::LightPasses passes = rates.light_passes(x, 0, s);
            EXPECT_EQ(passes.first & 1, s & 1);
            EXPECT_LE(passes.begin, passes.first);
            EXPECT_LT(passes.first + 2 * (passes.count - 1), passes.end);
            if (s > integrator::pilot_samples) {
                EXPECT_GE(passes.begin, last_begin) << "sample " << s;
            }
            last_begin = passes.begin;
            for (uint64_t i = 0; i < passes.count; ++i) {
                const uint64_t pass = passes.first + 2 * i;
                ASSERT_LT(pass, std::max(index, integrator::pilot_samples));
                weight[pass] += 1.0 / double(passes.count);
            }
        }
        const double sum = std::accumulate(weight.begin(), weight.end(), 0.0);
        EXPECT_NEAR(sum, double(count), 1e-9);
        if (count == index) {
            for (const double w : weight) EXPECT_EQ(w, 1.0);
        }
        if (count > index) {
            for (uint64_t p = 2 * integrator::pilot_samples; p < index; ++p)
                EXPECT_EQ(weight[p], weight[index - 1]);
        }
    }
}

}  // namespace velatura::test
