// SPDX-License-Identifier: Apache-2.0
// Render products: each is the image that its settings alone would give.
#include "command.h"
#include "image/exr.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace velatura::test {

namespace {

std::string camera(const std::string& name, double x) {
    return "    def Camera \"" + name + "\"\n    {\n        float focalLength = 35\n        " +
           "float horizontalAperture = 36\n        float verticalAperture = 24\n        " +
           "float fStop = 0.5\n        float focusDistance = 2\n        double shutter:close = "
           "0.5\n        float2 clippingRange = (0.01, 1000)\n        double3 xformOp:translate = "
           "(" +
           std::to_string(x) +
           ", 0, 4)\n        uniform token[] xformOpOrder = [\"xformOp:translate\"]\n    }\n";
}

/// Cameras L and R before a ball that moves; settings of 24 x 16 pixels with these products.
std::string scene(const std::string& products, const std::string& targets) {
    return "#usda 1.0\n(\n    renderSettingsPrimPath = \"/R\"\n)\ndef Xform \"W\"\n{\n" +
           camera("L", -0.5) + camera("R", 0.5) + R"usda(    def DomeLight "sky" {}
    def Sphere "Ball"
    {
        double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 1: (0.5, 0, 0) }
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def RenderSettings "R"
{
    int2 resolution = (24, 16)
    rel camera = </W/L>
    rel products = [)usda" +
           targets + "]\n}\n" + products;
}

std::string product(const std::string& name, const std::string& body) {
    return "def RenderProduct \"" + name + "\"\n{\n" + body + "}\n";
}

class Products : public testing::Test {
  protected:
    std::string render(const std::string& text, const std::string& arguments = "") {
        w.write("s.usda", text);
        const CommandResult r = w.velatura(
            "render s.usda --spp 4 --bounces 1 --layers bounce,data --progress none " + arguments);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        return r.output;
    }

    /// All but what counts prims, of which products and vars are some.
    void expect_same_image(const std::string& a, const std::string& b) const {
        const Result<image::Image> x = image::read_exr(w.path(a)), y = image::read_exr(w.path(b));
        ASSERT_TRUE(x.has_value() && y.has_value());
        ASSERT_EQ(x->data, y->data);
        EXPECT_EQ(x->pixel_aspect_ratio, y->pixel_aspect_ratio);
        for (const char* name : {"R", "G", "B", "A", "b1.R", "P.X", "Z", "N.Y", "sampleCount"}) {
            const image::Channel *p = x->find(name), *q = y->find(name);
            ASSERT_TRUE(p && q) << name;
            for (size_t i = 0; i < x->data.pixel_count(); ++i)
                ASSERT_EQ(p->value(i), q->value(i)) << name << ", pixel " << i;
        }
    }

    Workplace w;
};

}  // namespace

TEST_F(Products, OfSeveralCamerasAreRenderedOneAfterTheOther) {
    render(scene(product("A", "    token productName = \"left.exr\"\n") +
                     product("B",
                             "    token productName = \"right.exr\"\n    rel camera = </W/R>\n    "
                             "bool disableMotionBlur = 1\n    bool disableDepthOfField = 1\n    "
                             "float4 dataWindowNDC = (0, 0, 0.5, 1)\n"),
                 "</A>, </B>"));
    EXPECT_EQ(w.files_beside("s.usda"), "left.exr right.exr");
    render(scene("", ""), "-o alone.exr");
    expect_same_image("alone.exr", "left.exr");
    const std::string of_settings =
        "    bool disableMotionBlur = 1\n    bool disableDepthOfField = 1\n    float4 "
        "dataWindowNDC = (0, 0, 0.5, 1)\n";
    std::string alone = scene("", "");
    alone.insert(alone.find("    int2 resolution"), of_settings);
    render(alone, "-o alone.exr -c /W/R");
    expect_same_image("alone.exr", "right.exr");
    EXPECT_NE(w.hash("left.exr"), w.hash("right.exr"));
}

TEST_F(Products, ThatShareAViewShareTheSamples) {
    const std::string vars =
        "def RenderVar \"depthMin\"\n{\n    uniform string sourceName = \"Z\"\n    token "
        "velatura:filter = \"min\"\n}\n";
    const std::string output =
        render(scene(product("A", "    token productName = \"beauty.exr\"\n") +
                         product("B",
                                 "    token productName = \"data.exr\"\n    rel orderedVars = "
                                 "</depthMin>\n") +
                         vars,
                     "</A>, </B>"));
    EXPECT_NE(output.find("data.exr: the same layers"), std::string::npos) << output;
    EXPECT_EQ(w.hash("beauty.exr"), w.hash("data.exr"));
    const Result<image::Image> image = image::read_exr(w.path("data.exr"));
    ASSERT_TRUE(image.has_value());
    EXPECT_NE(image->find("depthMin"), nullptr);
    EXPECT_EQ(w.comp("verify data.exr").exit_code, 0);
}

TEST_F(Products, HaveFilesOfTheirOwn) {
    const std::string output = render(
        scene(product("A", "    token productName = \"x.exr\"\n") +
                  product("B", "    token productName = \"x.exr\"\n    rel camera = </W/R>\n") +
                  product("C", "    int2 resolution = (8, 8)\n"),
              "</A>, </B>, </C>"));
    EXPECT_EQ(w.files_beside("s.usda"), "C.exr x.B.exr x.exr");
    EXPECT_NE(output.find("writing x.B.exr"), std::string::npos) << output;
    const Result<image::Image> small = image::read_exr(w.path("C.exr"));
    ASSERT_TRUE(small.has_value());
    EXPECT_EQ(small->data.width(), 8);
}

// A name that is made up may be authored as well: of another view it is another file
TEST_F(Products, NeverShareAFileByChance) {
    const std::string output = render(scene(
        product("A", "    token productName = \"B.exr\"\n") +
            product("B", "    rel camera = </W/R>\n") +
            product("C", "    token productName = \"B.B.exr\"\n    int2 resolution = (8, 8)\n"),
        "</A>, </B>, </C>"));
    EXPECT_EQ(w.files_beside("s.usda"), "B.B.C.exr B.B.exr B.exr");
    render(scene("", ""), "-o alone.exr");
    expect_same_image("alone.exr", "B.exr");
    render(scene("", ""), "-o alone.exr -c /W/R");
    expect_same_image("alone.exr", "B.B.exr");
}

TEST_F(Products, AreNotWrittenOverWhatTheSceneIsReadFrom) {
    w.write("t.exr", "a texture");
    std::string text = scene(product("A", "    token productName = \"a.exr\"\n") +
                                 product("B", "    token productName = \"t.exr\"\n"),
                             "</A>, </B>") +
                       textured_ball("t.exr");
    w.write("s.usda", text);
    const CommandResult r = w.velatura("render s.usda --spp 1 --progress none");
    EXPECT_EQ(r.exit_code, 2) << r.output;
    EXPECT_NE(r.output.find("overwrites-input"), std::string::npos) << r.output;
    // Found before the render, not after it
    EXPECT_FALSE(w.exists("a.exr"));
}

TEST_F(Products, ThatHaveNoPlaceAreFoundBeforeTheRender) {
    w.write("s.usda", scene(product("A", "    token productName = \"a.exr\"\n") +
                                product("B", "    token productName = \"s.usda/b.exr\"\n"),
                            "</A>, </B>"));
    EXPECT_EQ(w.velatura("render s.usda --spp 1 --progress none").exit_code, 1);
    EXPECT_FALSE(w.exists("a.exr"));
}

TEST_F(Products, AreOneWhereTheCommandLineNamesTheFile) {
    const std::string output =
        render(scene(product("A", "") + product("B", "    rel camera = </W/R>\n"), "</A>, </B>"),
               "-o one.exr");
    EXPECT_EQ(w.files_beside("s.usda"), "one.exr");
    EXPECT_NE(output.find("--output names one file"), std::string::npos) << output;
}

TEST_F(Products, ConformTheApertureByThemselves) {
    render(scene(product("A",
                         "    token productName = \"a.exr\"\n    int2 resolution = (16, 16)\n    "
                         "token aspectRatioConformPolicy = \"cropAperture\"\n    float "
                         "pixelAspectRatio = 1.5\n"),
                 "</A>"));
    std::string alone = scene("", "");
    alone.insert(alone.find("    int2 resolution"),
                 "    token aspectRatioConformPolicy = \"cropAperture\"\n    float "
                 "pixelAspectRatio = 1.5\n");
    render(alone, "-o alone.exr --res 16 16");
    expect_same_image("alone.exr", "a.exr");
}

}  // namespace velatura::test
