// SPDX-License-Identifier: Apache-2.0
// Inputs that are wrong in what a render is asked for: settings, products, cameras, casters,
// metadata. Each row: prims, options, part of the message, exit code. Typing errors, unknown types
// and attributes of others are in unread_input_test.cpp, missing assets in missing_assets_test.cpp,
// opinions from the command line in scene_overrides_test.cpp.
#include "command.h"

#include <gtest/gtest.h>

#include <string>

namespace velatura::test {

namespace {

constexpr const char* scene = R"usda(
def Camera "Cam" {
    double3 xformOp:translate = (0, 0, 9)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "Sky" {
}
def Sphere "Ball" {
}
)usda";

struct Row {
    const char* metadata;  ///< of the layer
    const char* prims;
    const char* options;
    const char* message;
    int exit_code;
};

constexpr const char* chosen = "renderSettingsPrimPath = \"/R\"";

const Row rows[] = {
    // Cameras
    {"", "", "--camera /Cma", "camera </Cma> not found; cameras of the stage: </Cam>", 1},
    {"", "", "--camera /Ball", "</Ball> is a Sphere, not a Camera", 1},
    {chosen, "def RenderSettings \"R\" {\n rel camera = </Ball>\n}\n", "",
     "warning: </Ball> is a Sphere, not a Camera", 0},
    // Settings
    {"", "", "--settings /Nope", "</Nope> is neither a RenderSettings nor a RenderPass", 1},
    {"", "", "--settings /Ball", "</Ball> is neither a RenderSettings nor a RenderPass", 1},
    {"renderSettingsPrimPath = \"/Nope\"", "", "",
     "renderSettingsPrimPath names no RenderSettings, fallbacks are used", 0},
    {chosen, "def RenderSettings \"R\" {\n uniform int2 resolution = (0, 5)\n}\n", "",
     "resolution 0 x 5, expected 1 to 65536 each way", 1},
    {chosen, "def RenderSettings \"R\" {\n uniform float pixelAspectRatio = -1\n}\n", "",
     "pixelAspectRatio -1 is not a positive number, 1 is used", 0},
    {chosen, "def RenderSettings \"R\" {\n uniform float4 dataWindowNDC = (nan, 0, 1, 1)\n}\n", "",
     "dataWindowNDC is not four finite numbers, (0, 0, 1, 1) is used", 0},
    {chosen, "def RenderSettings \"R\" {\n uniform token renderingColorSpace = \"mauve\"\n}\n", "",
     "renderingColorSpace mauve is not supported, linear Rec.709 is used", 0},
    // Products and variables
    {chosen, "def RenderSettings \"R\" {\n rel products = </Ball>\n}\n", "",
     "products target </Ball> is not a RenderProduct", 0},
    {chosen,
     "def RenderSettings \"R\" {\n rel products = </P>\n}\ndef RenderProduct \"P\" {\n rel "
     "orderedVars = </Ball>\n}\n",
     "", "orderedVars target </Ball> is not a RenderVar", 0},
    {chosen,
     "def RenderSettings \"R\" {\n rel products = </P>\n}\ndef RenderProduct \"P\" {\n token "
     "productType = \"deepRaster\"\n}\n",
     "", "productType deepRaster is not supported, raster is written", 0},
    {chosen,
     "def RenderSettings \"R\" {\n rel products = </P>\n}\ndef RenderProduct \"P\" {\n rel "
     "orderedVars = </V>\n}\ndef RenderVar \"V\" {\n string sourceName = \"x\"\n uniform token "
     "sourceType = \"intrinsic\"\n}\n",
     "", "render var of sourceType intrinsic is not supported, it gets no channel", 0},
    // Casters
    {"", "", "--casters //Ball", "--casters needs caster in --layers", 2},
    {"", "", "--layers caster --casters '//{shiny:1}'", "--casters //{shiny:1}: ", 2},
    {"", "", "--layers caster --casters '/Ball['", "--casters /Ball[: ", 2},
    {"", "", "--layers caster --casters //Blal",
     "warning: --casters //Blal matches no prim with geometry; no caster is created", 0},
    // An asset that is missing, as it counts
    {"", "def \"A\" (references = @none.usda@) {\n}\n", "", "missing assets: 1 layer", 1},
    {"", "def \"A\" (references = @none.usda@) {\n}\n", "--missing-assets ignore",
     "cannot open reference @none.usda@", 0},
    {"", "def \"A\" (references = @none.usda@) {\n}\n", "--missing-assets ignore --strict",
     "error: 1 error in the scene; --strict renders nothing", 1},
};

}  // namespace

TEST(InputTable, MessageAndExitCode) {
    const Workplace w;
    for (const Row& row : rows) {
        w.write("s.usda",
                std::string("#usda 1.0\n(\n") + row.metadata + "\n)\n" + scene + row.prims);
        const CommandResult r = w.velatura(std::string("plan s.usda ") + row.options);
        EXPECT_EQ(r.exit_code, row.exit_code) << row.prims << row.options << ": " << r.output;
        EXPECT_NE(r.output.find(row.message), std::string::npos)
            << row.message << " of " << row.prims << row.options << ": " << r.output;
    }
}

}  // namespace velatura::test
