// SPDX-License-Identifier: Apache-2.0
// Moving, scaling or mirroring a whole scene (H05, H06, H08), and what has no room in it (H09).
#include "hard_case.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace velatura::test {

namespace {

integrator::RenderOptions few_samples() {
    integrator::RenderOptions options;
    options.end_sample = 4;
    return options;
}

film::Film render_room(const std::string& root_ops) {
    return render_scene(scene_from_usda(room_usda(root_ops), 48, 36), few_samples());
}

double count_different(const std::vector<double>& a, const std::vector<double>& b) {
    EXPECT_EQ(a.size(), b.size());
    size_t count = 0;
    for (size_t i = 0; i < a.size(); ++i)
        count += std::bit_cast<uint64_t>(a[i]) != std::bit_cast<uint64_t>(b[i]);
    return double(count);
}

/// relMSE (docs/engineering/numerics.md) over all pixels and channels.
double relative_mse(const std::vector<double>& a, const std::vector<double>& reference) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i)
        sum += (a[i] - reference[i]) * (a[i] - reference[i]) / (reference[i] * reference[i] + 0.01);
    return sum / double(a.size());
}

}  // namespace

TEST(H05FarFromTheOrigin, ShiftOnAGridIsBitIdentical) {
    const std::vector<double> at_origin = beauty(render_room(""));
    const std::string shift = R"(
    double3 xformOp:translate = (1073741824, -1073741824, 1073741824)
    uniform token[] xformOpOrder = ["xformOp:translate"]
)";
    hardcase::expect_within({"numbers of the picture that a shift by 2^30 changes",
                             count_different(beauty(render_room(shift)), at_origin), 0, 0,
                             "the picture at the origin, bit for bit"});
}

TEST(H05FarFromTheOrigin, AnyShiftLeavesTheImageAlone) {
    // Turned, so that no coordinate lies on a grid: positions move by about 2^-26 of a unit, which
    // turns few paths at edges
    const auto turned = [](const std::string& shift) {
        return beauty(render_room(fmt::format(R"(
    double3 xformOp:translate = {}
    double3 xformOp:rotateXYZ = (17.3, 31.7, -9.1)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
)",
                                              shift)));
    };
    const std::vector<double> at_origin = turned("(0, 0, 0)"),
                              far = turned("(123456789.123, -98765432.1, 1e8)");
    hardcase::expect_within({"relMSE after a shift of 1e8", relative_mse(far, at_origin), 1e-6, 0,
                             "the picture at the origin"});
    EXPECT_NE(far, at_origin) << "the shift rounds nothing: the bound says nothing";
}

TEST(H05FarFromTheOrigin, InstancesFarInsideTheirPrototypeStayWhole) {
    // An instanceable prim at −1e8 whose ball stands at +1e8, on no grid: the offsets must meet in
    // double
    const auto scene = [](const std::string& instanceable) {
        return scene_from_usda(R"usda(#usda 1.0
def Camera "Cam"
{
    float focalLength = 20
    float2 clippingRange = (0, 0)
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
class Xform "Proto"
{
    def Sphere "Ball"
    {
        double3 xformOp:translate = (100000000.3, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def Xform "Far" (
    inherits = </Proto>
    instanceable = )usda" + instanceable +
                                   R"usda(
)
{
    double3 xformOp:translate = (-100000000.1, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "Env"
{
}
)usda",
                               24, 24);
    };
    const scene::Scene instanced = scene("true");
    ASSERT_EQ(instanced.instances.size(), 1u);
    const std::vector<double> a = beauty(render_scene(instanced, few_samples())),
                              b = beauty(render_scene(scene("false"), few_samples()));
    hardcase::expect_within({"relMSE of an instance of 1e8 in a prototype at -1e8",
                             relative_mse(a, b), 1e-6, 0, "without instancing"});
    EXPECT_GT(relative_mse(a, std::vector<double>(a.size(), a[0])), 1e-3)
        << "the ball is in the picture";
}

namespace {

/// Prims seen from (0, 0, distance), 2 units across at the origin.
std::vector<double> seen_from(double distance, const std::string& prims, uint64_t samples) {
    integrator::RenderOptions options;
    options.end_sample = samples;
    options.adaptive = false;
    return beauty(render_scene(scene_from_usda(fmt::format(R"usda(#usda 1.0
def Camera "Cam"
{{
    float focalLength = {}
    float horizontalAperture = 20
    float verticalAperture = 20
    float2 clippingRange = (0.001, 1e9)
    double3 xformOp:translate = (0, 0, {})
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
)usda",
                                                           10 * distance, distance) +
                                                   prims,
                                               24, 24),
                               options));
}

std::string square(const std::string& name, const std::string& points) {
    return fmt::format(
        "def Mesh \"{}\"\n{{\n    uniform token subdivisionScheme = \"none\"\n    uniform bool "
        "doubleSided = 1\n    int[] faceVertexCounts = [4]\n"
        "    int[] faceVertexIndices = [0, 1, 2, 3]\n    point3f[] points = [{}]\n}}\n",
        name, points);
}

double mean_of(const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v / double(values.size());
    return sum;
}

}  // namespace

TEST(H05FarFromTheOrigin, LampsBehindWallsStayThere) {
    const std::string lamp =
        "def SphereLight \"Lamp\"\n{\n    float inputs:radius = 0.1\n    float inputs:intensity = "
        "1e5\n    double3 xformOp:translate = (0.2, 0.1, -0.5)\n"
        "    uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}\n";
    const std::string wall = square("Wall", "(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)");
    EXPECT_GT(mean_of(seen_from(1e4, lamp, 4)), 1.0) << "the lamp is in the picture";
    double light = 0;
    for (const double distance : {5.0, 1e2, 1e3, 1e4})
        light = hardcase::larger(light, mean_of(seen_from(distance, lamp + wall, 4)));
    hardcase::expect_within({"light of a lamp half a unit behind a wall, seen from up to 1e4 away",
                             light, 0, 0, "none"});
}

TEST(H05FarFromTheOrigin, LampsFlushWithAWallShineFromAnywhere) {
    // The wall stands on what is seen, and the lamp lies in it: coordinates of 1e4 move them apart
    // by some 2^-11
    const std::string lamp =
        "def RectLight \"Lamp\"\n{\n    float inputs:width = 1\n    float inputs:height = 1\n    "
        "double3 xformOp:translate = (-2.1, 0.1, 1.3)\n    float xformOp:rotateY = -90\n"
        "    uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:rotateY\"]\n}\n";
    const std::string room =
        square("Ground", "(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)") + lamp +
        square("Wall", "(-2.1, -4, 0), (-2.1, 4, 0), (-2.1, 4, 4), (-2.1, -4, 4)");
    const std::string open =
        square("Ground", "(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)") + lamp;
    double worst = 0;
    for (const double distance : {8.0, 1e2, 1e3, 1e4}) {
        // Bounce 1 alone is compared: the wall is black
        std::string dark_room = room;
        dark_room.insert(dark_room.rfind("    point3f[] points"),
                         "    color3f[] primvars:displayColor = [(0, 0, 0)]\n");
        // Turned, so that lamp and wall are rounded each in its own way
        const auto turned = [](const std::string& prims) {
            return "def Xform \"Turned\"\n{\n    float3 xformOp:rotateXYZ = (7.7, -5.1, 17.3)\n    "
                   "uniform token[] xformOpOrder = [\"xformOp:rotateXYZ\"]\n" +
                   prims + "}\n";
        };
        worst =
            hardcase::larger(worst, std::abs(mean_of(seen_from(distance, turned(dark_room), 64)) /
                                                 mean_of(seen_from(distance, turned(open), 64)) -
                                             1));
    }
    hardcase::expect_within(
        {"light of a lamp flush with a wall over that without the wall, less 1, seen from up to "
         "1e4 away",
         worst, 0.005, 0, "the same samples without the wall"});
}

/// A camera that turns among things that stay sees what a still one sees of things that turn about
/// it.
TEST(MotionOfTheCamera, IsRelative) {
    const auto scene = [](const std::string& camera_turn, const std::string& world_turn) {
        return scene_from_usda(R"usda(#usda 1.0
class Xform "Things"
{
    def Sphere "Ball"
    {
        double radius = 0.6
        double3 xformOp:translate = (0.5, 0.2, -4)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Cube "Box"
    {
        double size = 1
        color3f[] primvars:displayColor = [(0.8, 0.3, 0.1)]
        double3 xformOp:translate = (-1, -0.3, -5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def Xform "World" (instanceable = true
    inherits = </Things>)
{
    float xformOp:rotateY.timeSamples = { 0: 0, 1: )usda" +
                                   world_turn + R"usda( }
    uniform token[] xformOpOrder = ["xformOp:rotateY"]
}
def Camera "Cam"
{
    float focalLength = 24
    float2 clippingRange = (0, 0)
    double shutter:close = 0.5
    float xformOp:rotateY.timeSamples = { 0: 0, 1: )usda" +
                                   camera_turn + R"usda( }
    uniform token[] xformOpOrder = ["xformOp:rotateY"]
}
def DomeLight "Env"
{
}
)usda",
                               32, 24);
    };
    const std::vector<double> camera = beauty(render_scene(scene("24", "0"), few_samples()));
    const std::vector<double> world = beauty(render_scene(scene("0", "-24"), few_samples()));
    const std::vector<double> still = beauty(render_scene(scene("0", "0"), few_samples()));
    const double error = relative_mse(camera, world), blur = relative_mse(camera, still);
    fmt::print(
        "relMSE of a turn of the camera against one of the world {:.3g}, against none {:.3g}\n",
        error, blur);
    EXPECT_LE(error, 1e-3 * blur);
}

TEST(H06Scale, ByPowersOfTwoIsBitIdentical) {
    // Smoke of the same depth in the middle of the room
    const auto room = [](int k) {
        const std::string scale = fmt::format(R"(
    double3 xformOp:scale = ({0:.17g}, {0:.17g}, {0:.17g})
    uniform token[] xformOpOrder = ["xformOp:scale"]
)",
                                              std::ldexp(1.0, k));
        std::string text = room_usda(scale);
        text.insert(text.rfind('}'), fmt::format(R"usda(
    def Volume "Smoke"
    {{
        rel field:density = </Root/Smoke/D>
        float velatura:volume:densityScale = {:.17g}
        double3 xformOp:translate = (-1, 0.25, 0.5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def OpenVDBAsset "D"
        {{
            token fieldName = "waves"
        }}
    }}
)usda",
                                                 std::ldexp(0.5, -k)));
        return beauty(render_scene(scene_from_usda(text, 32, 24), few_samples()));
    };
    const std::vector<double> unscaled = room(0);
    for (int k = -20; k <= 20; ++k) {
        if (k == 0) continue;
        hardcase::expect_within(
            {fmt::format("numbers of the picture that a scale of 2^{} changes", k),
             count_different(room(k), unscaled), 0, 0, "the unscaled picture, bit for bit"});
    }
}

namespace {

constexpr int mirror_width = 32, mirror_height = 24, mirror_block = 8;

/// Sums of the blocks of an image, per seed.
std::vector<std::vector<double>> blocks_by_seed(const scene::Scene& scene,
                                                uint64_t first_seed,
                                                int seeds) {
    std::vector<std::vector<double>> out;
    for (int i = 0; i < seeds; ++i) {
        integrator::RenderOptions options;
        options.seed = first_seed + uint64_t(i);
        options.end_sample = hardcase::sized(20, 256, 1024);
        const std::vector<double> image = beauty(render_scene(scene, options));
        std::vector<double> sums(size_t(mirror_width / mirror_block) *
                                 size_t(mirror_height / mirror_block));
        for (int y = 0; y < mirror_height; ++y) {
            for (int x = 0; x < mirror_width; ++x) {
                for (int c = 0; c < 3; ++c)
                    sums[size_t(y / mirror_block * (mirror_width / mirror_block) +
                                x / mirror_block)] += image[size_t((y * mirror_width + x) * 3 + c)];
            }
        }
        out.push_back(std::move(sums));
    }
    return out;
}

/// Blocks of the flipped images.
std::vector<std::vector<double>> flipped(std::vector<std::vector<double>> images) {
    constexpr int columns = mirror_width / mirror_block;
    for (std::vector<double>& blocks : images) {
        for (auto row = blocks.begin(); row != blocks.end(); row += columns)
            std::reverse(row, row + columns);
    }
    return images;
}

}  // namespace

// The camera stays as it is, in the plane of the mirror: the image is the flipped one
TEST(H08Mirrored, RoomIsTheFlippedImage) {
    const std::string mirror = R"(
    double3 xformOp:scale = (-1, 1, 1)
    uniform token[] xformOpOrder = ["xformOp:scale"]
)";
    std::string text = soft_room(), mirrored = text;
    mirrored.insert(mirrored.find("{\n") + 2, mirror);
    const std::string place = "uniform token[] xformOpOrder = [\"xformOp:translate\"]";
    mirrored.replace(mirrored.find(place), place.size(),
                     "double3 xformOp:scale = (-1, 1, 1)\n        uniform token[] xformOpOrder = "
                     "[\"xformOp:translate\", \"xformOp:scale\"]");
    constexpr int seeds = 16;
    const auto a = blocks_by_seed(scene_from_usda(text, mirror_width, mirror_height), 1, seeds);
    const auto b =
        blocks_by_seed(scene_from_usda(mirrored, mirror_width, mirror_height), 1001, seeds);
    const auto worst = [](const auto& p, const auto& q, double& detectable) {
        double t = 0;
        for (size_t block = 0; block < p[0].size(); ++block) {
            double mean[2] = {}, squares[2] = {};
            for (int i = 0; i < seeds; ++i) {
                for (const int k : {0, 1}) {
                    const double v = (k == 0 ? p : q)[size_t(i)][block];
                    mean[k] += v / seeds;
                    squares[k] += v * v / seeds;
                }
            }
            const double error = std::sqrt(
                (squares[0] - mean[0] * mean[0] + squares[1] - mean[1] * mean[1]) / (seeds - 1));
            t = hardcase::larger(t, std::abs(mean[0] - mean[1]) / error);
            detectable = std::max(detectable, (4.0 + 1.2816) * error / mean[0]);
        }
        return t;
    };
    double detectable = 0, unused = 0;
    // 12 blocks, Šidák at 1 %: Student's t of 30 degrees of freedom is beyond 3.7 with
    // probability 8.4e-4
    const double t = worst(a, flipped(b), detectable);
    hardcase::expect_within({"Welch's t of the worst of 12 blocks of a mirrored room", t, 3.7, 0,
                             "the flipped picture",
                             fmt::format("{:.1f} % of a block", 100 * detectable)});
    EXPECT_LT(detectable, 0.05);
    EXPECT_GT(worst(a, b, unused), 20.0) << "the room is not symmetric";
}

namespace {

/// A sheet whose normals lean by a map: three of its corners have coordinates that tell left from
/// right.
scene::Scene leaning_sheet(const std::string& prims) {
    return scene_from_usda(R"usda(#usda 1.0
def Camera "Cam"
{
    float focalLength = 24
    float2 clippingRange = (0, 0)
    double3 xformOp:translate = (0.2, 0.1, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def SphereLight "Lamp"
{
    float inputs:intensity = 30
    float inputs:radius = 0.5
    double3 xformOp:translate = (2, 1.5, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Material "Leaning"
{
    token outputs:surface.connect = </Leaning/S.outputs:surface>
    def Shader "S"
    {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:roughness = 0.3
        normal3f inputs:normal = (0.5, 0.2, 0.84)
        token outputs:surface
    }
}
)usda" + prims,
                           32, 24);
}

/// Points, and what is said of the mesh beside.
std::string sheet(const std::string& points, const std::string& more) {
    return R"usda(
    def Mesh "Sheet" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = )usda" +
           points + R"usda(
        texCoord2f[] primvars:st = [(0, 0), (1, 0.1), (1.2, 1), (0, 0.9)] (interpolation = "vertex")
        uniform token subdivisionScheme = "none"
        rel material:binding = </Leaning>
        )usda" +
           more + "\n    }\n";
}

}  // namespace

TEST(H08Mirrored, NormalMapsOfMirroredPrimsLeanAsThoseOfMirroredPoints) {
    const std::string points = "[(-1.5, -1, 0), (1, -1, 0.3), (1, 1, 0), (-1.5, 1.2, -0.2)]";
    const std::string flipped = "[(1.5, -1, 0), (-1, -1, 0.3), (-1, 1, 0), (1.5, 1.2, -0.2)]";
    const std::string mirror =
        "double3 xformOp:scale = (-1, 1, 1)\nuniform token[] xformOpOrder = [\"xformOp:scale\"]";
    const auto image = [](const std::string& prims) {
        return beauty(render_scene(leaning_sheet(prims), few_samples()));
    };
    const std::vector<double> expected =
        image(sheet(flipped, "uniform token orientation = \"leftHanded\""));
    const std::string instance =
        "class Xform \"Proto\"\n{" + sheet(points, "") +
        "}\ndef Xform \"I\" (inherits = </Proto>\ninstanceable = true)\n{\n" + mirror + "\n}\n";
    const double off[] = {relative_mse(image(sheet(points, mirror)), expected),
                          relative_mse(image(instance), expected)};
    hardcase::expect_within({"relMSE of a normal map on a mirrored prim and on a mirrored instance",
                             hardcase::larger(off[0], off[1]), 1e-9, 0, "mirrored points"});
    EXPECT_GT(relative_mse(image(sheet(points, "")), expected), 1e-2)
        << "left and right look the same";
}

namespace {

std::string with_prim(const std::string& prim) {
    std::string text = room_usda();
    return text.insert(text.rfind('}'), prim);
}

std::string scaled_cube(const std::string& scale) {
    return fmt::format(R"usda(
    def Cube "Odd"
    {{
        double size = 1
        double3 xformOp:translate = (0, 1.5, 0)
        double3 xformOp:scale = {}
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
    }}
)usda",
                       scale);
}

}  // namespace

TEST(H09SingularMatrices, PrimsWithoutRoomChangeNoBitOfTheOthers) {
    const auto image = [](const std::string& text) {
        return beauty(render_scene(scene_from_usda(text, 48, 36), few_samples()));
    };
    const std::vector<double> without = image(room_usda());
    for (const char* scale : {"(0, 0, 0)", "(nan, 1, 1)", "(1, inf, 1)", "(0, 1, 0)"})
        hardcase::expect_within(
            {fmt::format("numbers of the picture that a cube of scale {} changes", scale),
             count_different(image(with_prim(scaled_cube(scale))), without), 0, 0,
             "the room without it, bit for bit"});
    EXPECT_GT(count_different(image(with_prim(scaled_cube("(1, 1, 1)"))), without), 100.0);
}

TEST(H09SingularMatrices, FlatCubeIsASheet) {
    const auto image = [](const std::string& text) {
        return beauty(render_scene(scene_from_usda(text, 48, 36), few_samples()));
    };
    const std::vector<double> sheet = image(with_prim(R"usda(
    def Mesh "Odd"
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-0.5, 1.5, 0.5), (0.5, 1.5, 0.5), (0.5, 1.5, -0.5), (-0.5, 1.5, -0.5)]
        uniform token subdivisionScheme = "none"
    }
)usda"));
    const std::vector<double> cube = image(with_prim(scaled_cube("(1, 0, 1)")));
    for (const double v : cube) ASSERT_TRUE(std::isfinite(v));
    hardcase::expect_within({"relMSE of a cube of height 0", relative_mse(cube, sheet), 1e-6, 0,
                             "a square mesh in its place"});
    EXPECT_GT(relative_mse(cube, image(room_usda())), 1e-3) << "it is in the picture";
}

}  // namespace velatura::test
