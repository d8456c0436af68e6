// SPDX-License-Identifier: Apache-2.0
// Moving or scaling a whole scene by powers of two changes no bit of the picture (RIGOR H05, H06).
#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "usd_render.h"

namespace velatura::test {

namespace {

integrator::RenderOptions few_samples() {
    integrator::RenderOptions options;
    options.end_sample = 4;
    return options;
}

film::Film render_room(const std::string& root_ops) { return render_scene(scene_from_usda(room_usda(root_ops), 48, 36), few_samples()); }

/// relMSE of DESIGN §8 over all pixels and channels.
double relative_mse(const std::vector<double>& a, const std::vector<double>& reference) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - reference[i]) * (a[i] - reference[i]) / (reference[i] * reference[i] + 0.01);
    return sum / double(a.size());
}

}  // namespace

TEST(H05FarFromTheOrigin, ShiftOnAGridIsBitIdentical) {
    const std::vector<double> at_origin = beauty(render_room(""));
    const std::string shift = R"(
    double3 xformOp:translate = (1073741824, -1073741824, 1073741824)
    uniform token[] xformOpOrder = ["xformOp:translate"]
)";
    EXPECT_EQ(beauty(render_room(shift)), at_origin);
}

TEST(H05FarFromTheOrigin, AnyShiftLeavesThePictureAlone) {
    const std::vector<double> at_origin = beauty(render_room(""));
    const std::string shift = R"(
    double3 xformOp:translate = (123456789.123, -98765432.1, 1e8)
    uniform token[] xformOpOrder = ["xformOp:translate"]
)";
    // Positions move by at most 2^-27 of a unit, which turns few paths at edges
    const double error = relative_mse(beauty(render_room(shift)), at_origin);
    fmt::print("relMSE after a shift of 1e8: {:.3g}\n", error);
    EXPECT_LE(error, 1e-6);
}

TEST(H05FarFromTheOrigin, InstancesFarInsideTheirPrototypeStayWhole) {
    // An instanceable prim at −1e8 whose ball stands at +1e8: the offsets must meet in double
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
        double3 xformOp:translate = (100000000, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def Xform "Far" (
    inherits = </Proto>
    instanceable = )usda" + instanceable + R"usda(
)
{
    double3 xformOp:translate = (-100000000, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "Env"
{
}
)usda", 24, 24);
    };
    const scene::Scene instanced = scene("true");
    ASSERT_EQ(instanced.instances.size(), 1u);
    const std::vector<double> a = beauty(render_scene(instanced, few_samples())), b = beauty(render_scene(scene("false"), few_samples()));
    EXPECT_LE(relative_mse(a, b), 1e-6);
    EXPECT_GT(relative_mse(a, std::vector<double>(a.size(), a[0])), 1e-3) << "the ball is in the picture";
}

/// A camera that turns among things that stay sees what a still one sees of things that turn about it.
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
    float xformOp:rotateY.timeSamples = { 0: 0, 1: )usda" + world_turn + R"usda( }
    uniform token[] xformOpOrder = ["xformOp:rotateY"]
}
def Camera "Cam"
{
    float focalLength = 24
    float2 clippingRange = (0, 0)
    double shutter:close = 0.5
    float xformOp:rotateY.timeSamples = { 0: 0, 1: )usda" + camera_turn + R"usda( }
    uniform token[] xformOpOrder = ["xformOp:rotateY"]
}
def DomeLight "Env"
{
}
)usda", 32, 24);
    };
    const std::vector<double> camera = beauty(render_scene(scene("24", "0"), few_samples()));
    const std::vector<double> world = beauty(render_scene(scene("0", "-24"), few_samples()));
    const std::vector<double> still = beauty(render_scene(scene("0", "0"), few_samples()));
    const double error = relative_mse(camera, world), blur = relative_mse(camera, still);
    fmt::print("relMSE of a turn of the camera against one of the world {:.3g}, against none {:.3g}\n", error, blur);
    EXPECT_LE(error, 1e-3 * blur);
}

class H06Scale : public testing::TestWithParam<int> {};

TEST_P(H06Scale, IsBitIdentical) {
    const std::vector<double> unscaled = beauty(render_room(""));
    const double s = std::ldexp(1.0, GetParam());
    const std::string scale = fmt::format(R"(
    double3 xformOp:scale = ({0}, {0}, {0})
    uniform token[] xformOpOrder = ["xformOp:scale"]
)", fmt::format("{:.17g}", s));
    EXPECT_EQ(beauty(render_room(scale)), unscaled);
}

INSTANTIATE_TEST_SUITE_P(PowersOfTwo, H06Scale, testing::Values(-20, -7, 1, 10, 20));

}  // namespace velatura::test
