// SPDX-License-Identifier: Apache-2.0
// Shaders of fibers.
#include "translate/support.h"

#include <gtest/gtest.h>

namespace velatura::translate::materials {

namespace {

std::string hair(const std::string& inputs) {
    return "def Material \"M\" {\n token outputs:surface.connect = </M/S.outputs:surface>\n def "
           "Shader "
           "\"S\" {\n uniform token info:id = \"VelaturaHair\"\n" +
           inputs + "\n token outputs:surface\n }\n}\n";
}

std::string strand(const std::string& extra = "") {
    return "def BasisCurves \"Strand\" {\n int[] curveVertexCounts = [2]\n uniform token type = "
           "\"linear\"\n point3f[] points = [(0, 0, -5), (0, 1, -5)]\n float[] widths = [0.1]\n "
           "rel "
           "material:binding = </M>\n" +
           extra + "}\n";
}

/// Codes of all warnings.
std::string warnings(const Translated& t) {
    std::string codes;
    for (const Diagnostic& d : t.diagnostics.all())
        if (d.severity != Severity::Note) codes += d.code + " ";
    return codes;
}

const scene::Hair& hair_of(const Translated& t) {
    return t.scene.materials.at(t.scene.shapes.at(0).material).hair.value();
}

}  // namespace

using Absorber = scene::Hair::Absorber;

// What other renderers show stands beside it
TEST(Hair, GoesBeforeTheSurfaceOfOtherRenderers) {
    Translated t;
    translate_text(camera() + strand() + R"usda(
def Material "M" {
    token outputs:velatura:surface.connect = </M/H.outputs:surface>
    token outputs:surface.connect = </M/P.outputs:surface>
    def Shader "H" {
        uniform token info:id = "VelaturaHair"
        float inputs:eumelanin = 0.3
        token outputs:surface
    }
    def Shader "P" {
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
    }
}
)usda",
                   t);
    EXPECT_EQ(warnings(t), "no-lights ");
    EXPECT_EQ(hair_of(t).eumelanin.value.x, 0.3f);
}

TEST(Hair, ReadsItsInputs) {
    Translated t;
    translate_text(camera() +
                       hair("float inputs:eumelanin = 0.3\nfloat inputs:roughness = 0.2\n"
                            "float inputs:azimuthalRoughness = 0.4\nfloat inputs:ior = 1.4\n"
                            "float inputs:cuticleAngle = 3") +
                       strand(),
                   t);
    EXPECT_EQ(warnings(t), "no-lights ");
    const scene::Hair& h = hair_of(t);
    EXPECT_EQ(h.absorber, Absorber::Melanin);
    EXPECT_EQ(h.eumelanin.value.x, 0.3f);
    EXPECT_EQ(h.pheomelanin.value.x, 0.0f);
    EXPECT_EQ(h.roughness.value.x, 0.2f);
    EXPECT_EQ(h.azimuthal_roughness.value.x, 0.4f);
    EXPECT_EQ(h.ior, 1.4f);
    EXPECT_EQ(h.cuticle_angle_deg, 3.0f);
}

TEST(Hair, IsBrownUnlessToldOtherwise) {
    Translated t;
    translate_text(camera() + hair("") + strand(), t);
    EXPECT_EQ(warnings(t), "no-lights ");
    EXPECT_EQ(hair_of(t).absorber, Absorber::Melanin);
    EXPECT_EQ(hair_of(t).eumelanin.value.x, 1.3f);
    Translated red;
    translate_text(camera() + hair("float inputs:pheomelanin = 2") + strand(), red);
    EXPECT_EQ(hair_of(red).eumelanin.value.x, 0.0f);
}

TEST(Hair, ColorsVaryByStrand) {
    Translated t;
    translate_text(camera() +
                       hair("color3f inputs:color.connect = </M/R.outputs:result>\n token "
                            "outputs:surface\n }\n def Shader \"R\" {\n uniform token info:id = "
                            "\"UsdPrimvarReader_float3\"\n string inputs:varname = \"tone\"\n "
                            "float3 outputs:result\n") +
                       strand("color3f[] primvars:tone = [(0.5, 0.2, 0.1)]\n"),
                   t);
    EXPECT_EQ(warnings(t), "no-lights ");
    EXPECT_EQ(hair_of(t).absorber, Absorber::Color);
    EXPECT_EQ(hair_of(t).color.source, scene::Input::Source::Primvar);
    EXPECT_EQ(std::get<scene::Curves>(t.scene.shapes.at(0).geometry).primvars.size(), 1u);
}

TEST(Hair, SaysWhatItCannotHonor) {
    Translated t;
    translate_text(camera() +
                       hair("float inputs:eumelanin = -1\ncolor3f inputs:color = (2, 0, 0)\n"
                            "color3f inputs:absorption = (0.1, 0.2, 0.3)\nfloat inputs:ior = 9\n"
                            "float inputs:roughness = 1.5\nfloat inputs:gloss = 1") +
                       strand() + quad("Q", "rel material:binding = </M>\n"),
                   t);
    EXPECT_EQ(hair_of(t).absorber, Absorber::Coefficient);
    EXPECT_EQ(t.count("several-hair-colors"), 1u);
    EXPECT_EQ(t.count("material-out-of-range"), 4u);
    EXPECT_EQ(t.count("unknown-shader-input"), 1u);
    EXPECT_EQ(t.count("hair-without-curves"), 1u);
}

}  // namespace velatura::translate::materials
