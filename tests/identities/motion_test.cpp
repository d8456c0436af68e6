// SPDX-License-Identifier: Apache-2.0
// Images of one motion that is authored in different ways.
#include "hard_case.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace velatura::test {
namespace {

constexpr integrator::RenderOptions few_samples = {.seed = 5, .end_sample = 8};

/// Seconds are 32 time codes, so that ways are exact. A swarm of three and a sail before a floor,
/// of these rows.
scene::Scene sailing(double close, const std::string& swarm, const std::string& sail) {
    return scene_from_usda(fmt::format(R"usda(#usda 1.0
(
    timeCodesPerSecond = 32
    framesPerSecond = 32
)
def Camera "Cam"
{{
    float focalLength = 24
    double shutter:close = {}
    double3 xformOp:translate = (0, 1, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def RectLight "Lamp"
{{
    float inputs:intensity = 6
    double3 xformOp:translate = (0, 3, 1)
    float xformOp:rotateX = -70
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
}}
def Mesh "Floor"
{{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3)]
    uniform token subdivisionScheme = "none"
}}
def PointInstancer "Swarm"
{{
    rel prototypes = [</Swarm/Ball>, </Swarm/Box>]
    int[] protoIndices = [0, 1, 0]
    {}
    def Sphere "Ball"
    {{
        double radius = 0.25
    }}
    def Cube "Box"
    {{
        double size = 0.375
    }}
}}
def Mesh "Sail"
{{
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    uniform token subdivisionScheme = "none"
    {}
}}
)usda",
                                       close, swarm, sail));
}

const std::string swarm_at_0 = "[(-1, 0.5, 0.5), (0, 1, 0.25), (1, 1.5, 0)]";
const std::string sail_at_0 = "[(-2, 0, -1), (2, 0, -1), (0, 3, -1)]";

uint64_t image(const scene::Scene& scene) {
    return fingerprint(render_scene(scene, few_samples));
}

TEST(MotionIdentities, VelocitiesAndSamplesGiveOneImage) {
    const scene::Scene by_velocities =
        sailing(0.5,
                "point3f[] positions.timeSamples = { 0: " + swarm_at_0 +
                    " }\n    vector3f[] velocities.timeSamples = { 0: [(32, 0, 0), (0, 16, 8), (0, "
                    "0, 0)] }",
                "point3f[] points.timeSamples = { 0: " + sail_at_0 +
                    " }\n    vector3f[] velocities.timeSamples = { 0: [(0, 0, 0), (0, 16, 0), "
                    "(-32, 0, 0)] }");
    const scene::Scene by_samples =
        sailing(0.5,
                "point3f[] positions.timeSamples = { 0: " + swarm_at_0 +
                    ", 1: [(0, 0.5, 0.5), (0, 1.5, 0.5), (1, 1.5, 0)] }",
                "point3f[] points.timeSamples = { 0: " + sail_at_0 +
                    ", 1: [(-2, 0, -1), (2, 0.5, -1), (-1, 3, -1)] }");
    const uint64_t moving = image(by_velocities);
    EXPECT_EQ(moving, image(by_samples));
    EXPECT_NE(moving, image(sailing(0, "point3f[] positions = " + swarm_at_0,
                                    "point3f[] points = " + sail_at_0)));
}

/// A ball, which is met as what it is, moves as an instance of it does.
TEST(MotionIdentities, AShapeMovesAsItsInstance) {
    const std::string moves =
        "double3 xformOp:translate.timeSamples = { 0: (-1, 1, 0), 1: (1, 1.5, 0.5) }\n    uniform "
        "token[] xformOpOrder = [\"xformOp:translate\"]\n";
    const std::string still = "point3f[] positions = " + swarm_at_0,
                      sail = "point3f[] points = " + sail_at_0;
    const std::string ball =
        "double radius = 0.5\n color3f[] primvars:displayColor = [(0.9, 0.5, 0.2)]\n";
    const scene::Scene itself =
        sailing(0.5, still, sail + "\n}\ndef Sphere \"Ball\"\n{\n" + ball + moves);
    const scene::Scene instance = sailing(
        0.5, still,
        sail + "\n}\nclass Xform \"Model\"\n{\ndef Sphere \"Ball\"\n{\n" + ball +
            "}\n}\ndef \"I\" (\ninstanceable = true\nprepend references = </Model>\n)\n{\n" +
            moves);
    ASSERT_EQ(itself.instances.size(), instance.instances.size());
    EXPECT_EQ(image(itself), image(instance));
}

/// Balls are those of an instancer that places one of width 1.
TEST(MotionIdentities, BallsMoveAsInstancesDo) {
    const std::string still = "point3f[] positions = " + swarm_at_0,
                      sail = "point3f[] points = " + sail_at_0;
    const std::string samples = ".timeSamples = { 0: [(-1, 1, 1), (1, 2, 1)] }\n",
                      velocities =
                          "vector3f[] velocities.timeSamples = { 0: [(32, 0, 0), (0, -64, 0)] }\n";
    const std::string color = "color3f[] primvars:displayColor = [(0.9, 0.5, 0.2)]\n";
    const scene::Scene balls =
        sailing(0.5, still,
                sail + "\n}\ndef Points \"Dust\"\n{\n" + color +
                    "float[] widths = [0.5, 0.25]\npoint3f[] points" + samples + velocities);
    const scene::Scene instances =
        sailing(0.5, still,
                sail +
                    "\n}\ndef PointInstancer \"Dust\"\n{\nrel prototypes = </Dust/One>\nint[] "
                    "protoIndices = [0, 0]\nfloat3[] scales = [(0.5, 0.5, 0.5), (0.25, 0.25, "
                    "0.25)]\npoint3f[] positions" +
                    samples + velocities + "def Points \"One\"\n{\n" + color +
                    "point3f[] points = [(0, 0, 0)]\nfloat[] widths = [1]\n}\n");
    ASSERT_EQ(balls.instances.size(), instances.instances.size());
    EXPECT_EQ(image(balls), image(instances));
}

TEST(H47Motion, WhatDoesNotMoveIsStillBitForBit) {
    const uint64_t still =
        image(sailing(0, "point3f[] positions = " + swarm_at_0, "point3f[] points = " + sail_at_0));
    const std::string moving_swarm =
        "point3f[] positions.timeSamples = { 0: " + swarm_at_0 +
        " }\n    vector3f[] velocities.timeSamples = { 0: [(32, 0, 0), (0, 16, 8), (0, 0, 0)] }";
    const std::string moving_sail =
        "point3f[] points.timeSamples = { 0: " + sail_at_0 +
        " }\n    vector3f[] velocities.timeSamples = { 0: [(0, 0, 0), (0, 16, 0), (-32, 0, 0)] }";
    // The shutter is closed, the blur scaled away, the velocities are zero
    hardcase::expect_within({"pictures that velocities change while the shutter is closed",
                             image(sailing(0, moving_swarm, moving_sail)) == still ? 0.0 : 1.0, 0,
                             0, "the static picture, by hash"});
    EXPECT_EQ(image(sailing(0.5, "float motion:blurScale = 0\n    " + moving_swarm,
                            "float motion:blurScale = 0\n    " + moving_sail)),
              still);
    EXPECT_EQ(image(sailing(0.5, "float motion:velocityScale = 0\n    " + moving_swarm,
                            "float motion:velocityScale = 0\n    " + moving_sail)),
              still);
    EXPECT_EQ(image(sailing(0.5, "point3f[] positions = " + swarm_at_0,
                            "point3f[] points = " + sail_at_0)),
              still);
}

}  // namespace
}  // namespace velatura::test
