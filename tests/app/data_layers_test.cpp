// SPDX-License-Identifier: Apache-2.0
// Data layers that options and render vars name: each is an affine function of another one, or of
// what its filter keeps.
#include "image/exr.h"
#include "rendered_image.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace velatura::test {

namespace {

/// A square at (0.5, 0.25, -1), turned by 30 degrees about the vertical axis, before a camera at
/// (0, 0, 4), and a box far behind it. Pref are the square's own coordinates, st half of them.
std::string room(const std::string& render = "") {
    return "#usda 1.0\n(\n    renderSettingsPrimPath = \"/R\"\n)\n" + std::string(R"usda(
def Xform "W"
{
    def Camera "Cam"
    {
        float focalLength = 35
        float horizontalAperture = 36
        float verticalAperture = 24
        float2 clippingRange = (0.01, 1000)
        double3 xformOp:translate = (0, 0, 4)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def DomeLight "sky" {}
    def Mesh "Square"
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
        uniform token subdivisionScheme = "none"
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
        point3f[] primvars:Pref = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)] (
            interpolation = "vertex")
        color3f[] primvars:displayColor = [(0.2, 0.4, 0.8)]
        float primvars:wet = 0.75
        int[] primvars:piece = [70001] (interpolation = "uniform")
        string primvars:note = "words"
        double3 xformOp:translate = (0.5, 0.25, -1)
        float xformOp:rotateY = 30
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]
    }
    def Cube "Box"
    {
        double size = 4
        double3 xformOp:translate = (-2, 0, -8)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def RenderSettings "R"
{
    int2 resolution = (48, 32)
    )usda") +
           (render.empty() ? "" : "rel products = </P>") + "\n}\n" + render;
}

std::string product(const std::string& vars, const std::string& prims) {
    return "def RenderProduct \"P\"\n{\n    rel orderedVars = [" + vars + "]\n}\n" + prims;
}

std::string var(const std::string& name, const std::string& attributes) {
    return "def RenderVar \"" + name + "\"\n{\n" + attributes + "}\n";
}

class DataLayers : public testing::Test {
  protected:
    image::Image render(const std::string& scene,
                        const std::string& arguments,
                        const std::string& file = "out.exr") {
        w.write("s.usda", scene);
        const CommandResult r =
            w.velatura("render s.usda --progress none --bounces 0 -o " + file + " " + arguments);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        output = r.output;
        return read_image(w, file);
    }

    void expect_said(const std::string& text) const {
        EXPECT_NE(output.find(text), std::string::npos) << text << "\n" << output;
    }

    /// So few samples may be told to be few, but of layers there is nothing to say.
    void expect_no_message_about_layers() const {
        for (const char* const code : {"[data-layer]", "render-var]"})
            EXPECT_EQ(output.find(code), std::string::npos) << output;
    }

    Workplace w;
    std::string output;
};

}  // namespace

TEST_F(DataLayers, HoldWhatTheyName) {
    const image::Image image =
        render(room(),
               "--spp 8 --layers "
               "data,Neye,Ng,Peye,elementId,primvar:Pref,uv=primvar:st,primvar:wet,primvar:piece,"
               "primvar:displayColor");
    expect_no_message_about_layers();
    const double c = std::cos(M_PI / 6), s = std::sin(M_PI / 6);
    size_t whole = 0;
    for (size_t i = 0; i < image.data.pixel_count(); ++i) {
        const auto v = [&](const std::string& channel) { return value(image, channel, i); };
        if (v("piece") != 0.0) {
            EXPECT_EQ(v("piece"), 70001.0);
            EXPECT_FLOAT_EQ(float(v("wet")), 0.75f);
        }
        if (v("A") < 1.0) continue;
        // Eye space is world space, but for the camera's place
        EXPECT_NEAR(v("Peye.X"), v("P.X"), 1e-5);
        EXPECT_NEAR(v("Peye.Y"), v("P.Y"), 1e-5);
        EXPECT_NEAR(v("Peye.Z"), v("P.Z") - 4, 1e-5);
        EXPECT_NEAR(v("Peye.Z"), -v("Z"), 1e-5);
        for (const std::string axis : {".X", ".Y", ".Z"}) {
            EXPECT_NEAR(v("Neye" + axis), v("N" + axis), 1e-6);
            EXPECT_NEAR(v("Ng" + axis), v("N" + axis), 1e-6);
        }
        // Of the square alone
        if (v("displayColor.B") < 0.79999) continue;
        ++whole;
        EXPECT_EQ(v("elementId"), 0.0);
        const double x = v("P.X") - 0.5, z = v("P.Z") + 1;
        EXPECT_NEAR(v("Pref.X"), c * x - s * z, 2e-5);
        EXPECT_NEAR(v("Pref.Y"), v("P.Y") - 0.25, 2e-5);
        EXPECT_NEAR(v("Pref.Z"), 0, 2e-5);
        EXPECT_NEAR(v("uv.U"), (v("Pref.X") + 1) / 2, 2e-5);
        EXPECT_NEAR(v("uv.V"), (v("Pref.Y") + 1) / 2, 2e-5);
        EXPECT_NEAR(v("displayColor.R"), 0.2, 1e-5);
    }
    EXPECT_GT(whole, 100u);
}

/// At silhouettes a mean is of nothing that is there; the others are of some sample.
TEST_F(DataLayers, FiltersKeepSamples) {
    const image::Image image =
        render(room(), "--spp 16 --layers data,Z:min,Z:max,Z:closest,P:closest,primvar:piece:max");
    size_t edges = 0;
    for (size_t i = 0; i < image.data.pixel_count(); ++i) {
        const auto v = [&](const std::string& channel) { return value(image, channel, i); };
        EXPECT_EQ(v("Z_closest"), v("Z_min"));
        EXPECT_LE(v("Z_min"), v("Z") + 1e-5);
        EXPECT_GE(v("Z_max"), v("Z") - 1e-5);
        if (v("Z_min") > 0) {
            EXPECT_NEAR(4 - v("P_closest.Z"), v("Z_closest"), 1e-5);
        }
        if (v("Z_max") - v("Z_min") > 2) {
            ++edges;
            EXPECT_EQ(v("piece_max"), 70001.0);
        }
    }
    EXPECT_GT(edges, 5u);
}

TEST_F(DataLayers, AreTheSameHoweverTheyAreMade) {
    const std::string layers =
        "--layers bounce,data,Z:min,P:closest,primvar:st:max,primvar:Pref,motion --adaptive off ";
    render(room(), layers + "--spp 24");
    const std::string whole = w.hash("out.exr");
    render(room(), layers + "--spp 24 --mode tile --tile 16 --threads 1", "tiles.exr");
    EXPECT_EQ(w.hash("tiles.exr"), whole);
    render(room(), layers + "--samples 0:8", "a.exr");
    render(room(), layers + "--samples 8:24", "b.exr");
    const CommandResult merged = w.comp("merge a.exr b.exr -o merged.exr");
    EXPECT_EQ(merged.exit_code, 0) << merged.output;
    EXPECT_EQ(w.hash("merged.exr"), whole);
    render(room(), layers + "--spp 8 --resumable", "resumed.exr");
    render(room(), layers + "--spp 24 --resume", "resumed.exr");
    EXPECT_EQ(w.hash("resumed.exr"), whole);
    const CommandResult verified = w.comp("verify merged.exr");
    EXPECT_EQ(verified.exit_code, 0) << verified.output;
}

TEST_F(DataLayers, LeaveAllElseAsItIs) {
    const image::Image with = render(room(), "--spp 4 --layers bounce,data,Z:min,primvar:Pref");
    const image::Image without = render(room(), "--spp 4 --layers bounce,data");
    for (const char* channel : {"R", "G", "B", "A", "P.X", "N.Y", "st.U"})
        for (size_t i = 0; i < with.data.pixel_count(); ++i)
            ASSERT_EQ(value(with, channel, i), value(without, channel, i)) << channel;
}

TEST_F(DataLayers, RenderVarsNameThem) {
    const std::string source = "    uniform string sourceName = ";
    const std::string primvar = "    uniform token sourceType = \"primvar\"\n";
    const image::Image image = render(
        room(product(
            "</V1>, </V2>, </V3>, </V4>, </V5>, </V6>, </V7>, </V8>",
            var("V1", source + "\"Z\"\n    string driver:parameters:aov:filter = "
                               "'[\"minmax\", {\"mode\": \"min\"}]'\n") +
                var("V2", source + "\"depth\"\n    token arnold:filter = \"closest_filter\"\n") +
                var("V3", source + "\"P\"\n    string ri:accumulationRule = \"zmin\"\n") +
                var("V4",
                    source + "\"Pref\"\n" + primvar + "    uniform token dataType = \"half3\"\n") +
                var("V5", source + "\"primvars:wet\"\n    string driver:parameters:aov:name = "
                                   "\"wetness\"\n") +
                var("V6", source + "\"Neye\"\n    token velatura:filter = \"max\"\n") +
                var("V7", source + "\"Z\"\n    token velatura:filter = \"max\"\n") +
                var("V8", source + "\"displayColor\"\n" + primvar +
                              "    string driver:parameters:aov:channel_prefix = \"base\"\n"))),
        "--spp 8");
    expect_no_message_about_layers();
    EXPECT_EQ(image.find("V4.X")->type(), image::ChannelType::Half);
    EXPECT_NE(image.find("base.R"), nullptr);
    EXPECT_NE(image.find("V6.X"), nullptr);
    for (size_t i = 0; i < image.data.pixel_count(); ++i) {
        const auto v = [&](const std::string& channel) { return value(image, channel, i); };
        EXPECT_EQ(v("V1"), v("V2"));
        EXPECT_LE(v("V1"), v("V7"));
        if (v("V1") > 0) {
            EXPECT_NEAR(4 - v("V3.Z"), v("V2"), 1e-5);
        }
        EXPECT_TRUE(v("wetness") == 0.0 || std::abs(v("wetness") - 0.75) < 1e-6);
    }
    const CommandResult info = w.comp("info out.exr");
    EXPECT_EQ(info.exit_code, 0) << info.output;
}

TEST_F(DataLayers, UnknownOnesAreQuotedWithWhatThereIs) {
    const image::Image image = render(
        room(product("</V1>, </V2>, </V3>, </V4>",
                     var("V1", "    uniform string sourceName = \"Xyz\"\n") +
                         var("V2",
                             "    uniform string sourceName = \"rest\"\n    uniform token "
                             "sourceType = \"primvar\"\n") +
                         var("V3",
                             "    uniform string sourceName = \"note\"\n    uniform token "
                             "sourceType = \"primvar\"\n") +
                         var("V4",
                             "    uniform string sourceName = \"Peye\"\n    uniform token "
                             "dataType = \"string\"\n    token velatura:filter = \"median\"\n"))),
        "--spp 1");
    expect_said("render var V1: there is no data layer \"Xyz\"; data layers: albedo, N, Neye");
    expect_said("no geometry has a primvar \"rest\" of numbers; primvars of the scene: Pref");
    expect_said("no geometry has a primvar \"note\" of numbers");
    expect_said("filter \"median\" is not supported");
    expect_said("dataType string has no numbers");
    expect_said("at </V1>");
    EXPECT_EQ(image.find("V1"), nullptr);
    EXPECT_NE(image.find("V4.X"), nullptr);

    const CommandResult typed = w.velatura("render s.usda --layers bounce,Xyz");
    EXPECT_EQ(typed.exit_code, 2);
    EXPECT_NE(typed.output.find("unknown layer \"Xyz\""), std::string::npos) << typed.output;
    render(room(), "--spp 1 --layers bounce,primvar:rest");
    expect_said("--layers primvar:rest: no geometry has a primvar \"rest\"");
}

TEST_F(DataLayers, CostNothingWhereNobodyNamesThem) {
    w.write("s.usda", room());
    const CommandResult none = w.velatura("plan s.usda --layers bounce");
    EXPECT_EQ(none.output.find("Neye"), std::string::npos) << none.output;
    const CommandResult one = w.velatura("plan s.usda --layers bounce,Neye -v");
    EXPECT_NE(one.output.find("Neye"), std::string::npos) << one.output;
}

// A number of the scene that is none takes nothing from the beauty, and no pixel has it
TEST_F(DataLayers, OfNumbersThatAreNoneLeaveTheBeauty) {
    std::string scene = room();
    const std::string was = "float primvars:wet = 0.75";
    scene.replace(scene.find(was), was.size(), "float primvars:wet = inf");
    const image::Image with =
        render(scene, "--spp 4 --layers bounce,data,primvar:wet,most=primvar:wet:max");
    const image::Image without = render(scene, "--spp 4 --layers bounce,data", "plain.exr");
    for (size_t i = 0; i < with.data.pixel_count(); ++i) {
        for (const char* const channel : {"R", "G", "B", "A", "invalid"})
            ASSERT_EQ(value(with, channel, i), value(without, channel, i)) << channel << " " << i;
        for (const char* const channel : {"wet", "most"})
            if (with.find(channel)) {
                ASSERT_EQ(value(with, channel, i), 0.0) << channel << " " << i;
            }
    }
}

}  // namespace velatura::test
