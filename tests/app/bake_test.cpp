// SPDX-License-Identifier: Apache-2.0
// A mix baked into USD and rendered again, for every type of light.
#include "command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace velatura::test {

namespace {

/// A corner with a box in it, lit by one light of every type; numbers of stage metadata that a
/// layer on top must repeat.
constexpr const char* every_light = R"usda(#usda 1.0
(
    doc = """A text (with "quotes", brackets ] and # signs)"""
    defaultPrim = "W"
    metersPerUnit = 1
    upAxis = "Z"
    renderSettingsPrimPath = "/Render/Settings" # and a comment )
)
def Xform "W"
{
    def Camera "Cam"
    {
        float focalLength = 22
        double3 xformOp:translate = (0, -6, 2)
        float xformOp:rotateX = 80
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
    }
    def Mesh "Corner"
    {
        int[] faceVertexCounts = [4, 4]
        int[] faceVertexIndices = [0, 1, 2, 3, 3, 2, 5, 4]
        point3f[] points = [(-4, -4, 0), (4, -4, 0), (4, 3, 0), (-4, 3, 0), (-4, 3, 5), (4, 3, 5)]
        uniform token subdivisionScheme = "none"
        color3f[] primvars:displayColor = [(0.7, 0.6, 0.5)]
    }
    def Cube "Box"
    {
        double size = 1.2
        double3 xformOp:translate = (0.3, 0, 0.6)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def DistantLight "sun"
    {
        float inputs:intensity = 800
        float inputs:angle = 2
        float xformOp:rotateY = 35
        uniform token[] xformOpOrder = ["xformOp:rotateY"]
    }
    def DomeLight "sky"
    {
        float inputs:intensity = 0.1
        color3f inputs:color = (0.6, 0.8, 1)
    }
    def DomeLight "window"
    {
        float inputs:intensity = 0.2
        rel portals = </W/Portal>
    }
    def PortalLight "Portal"
    {
        double3 xformOp:translate = (0, 0, 4)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def RectLight "rect"
    {
        float inputs:intensity = 5
        float inputs:exposure = 1
        double3 xformOp:translate = (2, 0, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def DiskLight "disk"
    {
        float inputs:intensity = 9
        bool inputs:enableColorTemperature = 1
        float inputs:colorTemperature = 3200
        double3 xformOp:translate = (-2, 0, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def SphereLight "ball"
    {
        float inputs:intensity = 12
        float inputs:radius = 0.3
        float inputs:exposure.timeSamples = { 0: 0, 10: 1 }
        double3 xformOp:translate = (-1, -1, 2)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def CylinderLight "tube"
    {
        float inputs:intensity = 6
        float inputs:radius = 0.1
        double3 xformOp:translate = (1, 2, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Mesh "panel" (
        prepend apiSchemas = ["MeshLightAPI"]
    )
    {
        float inputs:intensity = 7
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-3, 2, 1), (-2, 2, 1), (-2, 2, 2), (-3, 2, 2)]
        uniform token subdivisionScheme = "none"
    }
    def Xform "Lamp" (
        instanceable = true
        references = </Prototype>
    )
    {
    }
}
class Xform "Prototype"
{
    def SphereLight "bulb"
    {
        float inputs:intensity = 4
        float inputs:radius = 0.1
        double3 xformOp:translate = (2, -1, 1)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def "Render"
{
    def RenderSettings "Settings"
    {
        uniform int2 resolution = (48, 36)
        rel camera = </W/Cam>
    }
}
)usda";

std::string text_of(const std::string& path) {
    std::ifstream in(path);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
}

class Bake : public testing::Test {
  protected:
    void SetUp() override {
        w.write("s.usda", every_light);
        const CommandResult r = w.velatura(
            "render s.usda -o s.exr -q --progress none --spp 32 --bounces 1 --max-depth 4 --halves "
            "--layers matrix,light --splitting off --guiding off");
        ASSERT_EQ(r.exit_code, 0) << r.output;
    }

    Workplace w;
};

}  // namespace

TEST_F(Bake, AgreesWithARenderForEveryTypeOfLight) {
    const CommandResult r = w.comp(
        "bake s.exr -o look.usda --prove --scene s.usda --gain sun=2 --gain sky=+1st --gain "
        "window=3 --tint rect=1,.5,.25 "
        "--kelvin disk=9000 --gain ball=-1st --gain tube=+2st --tint tube=.5,1,1 --gain panel=0.25 "
        "--exposure 0.5 --solo sun --solo sky "
        "--solo window --solo rect --solo disk --solo ball --solo tube --solo panel --solo bulb");
    // The instanced bulb cannot follow the exposure
    EXPECT_NE(r.output.find("not baked: </W/Lamp/bulb>"), std::string::npos) << r.output;
    // and is not part of what is proved: it agrees as rendered
    for (const char* light :
         {"sun", "sky", "window", "rect", "disk", "ball", "tube", "panel", "bulb", "all"}) {
        const size_t at = r.output.find(fmt::format("\n{} ", light));
        ASSERT_NE(at, std::string::npos) << r.output;
        EXPECT_NE(r.output.substr(at + 1, r.output.find('\n', at + 1) - at).find(" agrees"),
                  std::string::npos)
            << r.output;
    }
    EXPECT_EQ(r.exit_code, 3) << r.output;
}

TEST_F(Bake, MutesAndCropsAgree) {
    const CommandResult r = w.comp(
        "bake s.exr -o look.usda --prove --scene s.usda --crop 0.25 0.75 0 0.5 --mute rect --mute "
        "env --gain tube=2");
    EXPECT_EQ(r.exit_code, 0) << r.output;
    EXPECT_NE(text_of(w.path("look.usda")).find("float inputs:intensity = 0\n"), std::string::npos);
}

TEST_F(Bake, NamesWhatLightsCannotSay) {
    const CommandResult r = w.comp(
        "bake s.exr -o look.usda --prove --scene s.usda --gain indirect=+2st --gain rect:b1=2 "
        "--gain rect=2 --gain shadow=.5");
    EXPECT_EQ(r.exit_code, 3) << r.output;
    const std::string layer = text_of(w.path("look.usda"));
    for (const char* line : {"not baked: --gain indirect=+2st: ", "not baked: --gain rect:b1=2: ",
                             "not baked: --gain shadow=.5: "}) {
        EXPECT_NE(r.output.find(line), std::string::npos) << r.output;
        EXPECT_NE(layer.find(std::string("# ") + line), std::string::npos) << layer;
    }
    // What could be baked was, and agrees
    EXPECT_NE(layer.find("float inputs:intensity = 10\n"), std::string::npos) << layer;
    EXPECT_EQ(r.output.find("DIFFERS"), std::string::npos) << r.output;
}

TEST_F(Bake, AWrongLayerIsFound) {
    // The scene has changed since the mix: the proof says so
    std::string changed = every_light;
    const std::string before = "float inputs:intensity = 6\n";
    changed.replace(changed.find(before), before.size(),
                    "float inputs:intensity = 5\n        float inputs:exposure = 1\n");
    w.write("changed.usda", changed);
    const CommandResult r =
        w.comp("bake s.exr -o look.usda --prove --scene changed.usda --gain tube=2");
    EXPECT_EQ(r.exit_code, 4) << r.output;
    EXPECT_NE(r.output.find("DIFFERS"), std::string::npos);
}

TEST_F(Bake, WhatClampsTookIsGivenBackForTheProof) {
    const CommandResult clamped = w.velatura(
        "render s.usda -o clamped.exr -q --progress none --spp 32 --bounces 1 --max-depth 4 "
        "--halves --layers matrix --splitting off --guiding off --clamp-direct 0.5");
    ASSERT_EQ(clamped.exit_code, 0) << clamped.output;
    const CommandResult r = w.comp(
        "bake clamped.exr -o look.usda --prove --scene s.usda --gain rect=4 --gain sky=+1st");
    EXPECT_EQ(r.exit_code, 0) << r.output;
}

TEST_F(Bake, TheProofIsRenderedLikeTheFile) {
    // A proxy that darkens the image, a filter, a depth: all of them stand in the file
    std::string proxied = every_light;
    const std::string box = "def Cube \"Box\"\n    {\n";
    ASSERT_NE(proxied.find(box), std::string::npos);
    proxied.replace(proxied.find(box), box.size(),
                    box + "        uniform token purpose = \"proxy\"\n");
    w.write("proxied.usda", proxied);
    const CommandResult r = w.velatura(
        "render proxied.usda -o proxied.exr -q --progress none --spp 32 --bounces 1 --max-depth 2 "
        "--halves --layers matrix --splitting off --guiding off --purpose proxy --filter box");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    const CommandResult proved =
        w.comp("bake proxied.exr -o look.usda --prove --scene proxied.usda --gain rect=2");
    EXPECT_EQ(proved.exit_code, 0) << proved.output;
    const CommandResult other = w.comp(
        "bake proxied.exr -o look.usda --prove --scene proxied.usda --gain rect=2 --render-args "
        "'--purpose default'");
    EXPECT_EQ(other.exit_code, 4) << other.output;
}

TEST_F(Bake, UsageAndFaults) {
    EXPECT_EQ(w.comp("bake s.exr -o look.exr").exit_code, 2);
    EXPECT_EQ(w.comp("bake s.exr -o look.usda --prove").exit_code, 2);
    EXPECT_EQ(w.comp("bake s.exr -o look.usda --gain moon=2").exit_code, 2);
    // Options of the proof without one
    for (const char* option : {"--scene s.usda", "--crop 0 1 0 1", "--spp 4", "--velatura x",
                               "--render-args=--filter"}) {
        const CommandResult r =
            w.comp(fmt::format("bake s.exr -o look.usda --gain rect=2 {}", option));
        EXPECT_EQ(r.exit_code, 2) << option;
        EXPECT_NE(r.output.find("--prove"), std::string::npos) << r.output;
    }
    EXPECT_EQ(w.comp("bake s.exr -o look.usda --prove --scene missing.usda").exit_code, 1);
    EXPECT_EQ(
        w.comp("bake s.exr -o look.usda --prove --scene s.usda --velatura /nonexistent/velatura")
            .exit_code,
        1);
}

}  // namespace velatura::test
