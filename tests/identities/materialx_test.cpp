// SPDX-License-Identifier: Apache-2.0
// Node graphs make the image that the plain material makes which they come down to.
#include "test_assets.h"
#include "translate/translate.h"
#include "usd/stage/stage.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace velatura::test {
namespace {

constexpr const char* stage = R"usda(#usda 1.0
def Camera "Cam"
{{
    float focalLength = 24
    double3 xformOp:translate = (0, 0.5, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def RectLight "Lamp"
{{
    float inputs:intensity = 6
    float inputs:width = 3
    double3 xformOp:translate = (0, 3, 2)
    float xformOp:rotateX = -60
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
}}
def Mesh "Quad" (prepend apiSchemas = ["MaterialBindingAPI"])
{{
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 4, 5, 1, 0]
    point3f[] points = [(-1, 0, 0), (1, 0, 0), (1, 2, -1), (-1, 2, -1), (-1, -1, 2), (1, -1, 2)]
    uniform token subdivisionScheme = "none"
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1), (0, -1), (1,
        -1)] (interpolation = "vertex")
    float primvars:amount = 0.4
    color3f primvars:tint = (0.7, 0.4, 0.2)
    rel material:binding = </Mat>
}}
def Material "Mat"
{{
    token outputs:{}surface.connect = </Mat/S.outputs:surface>
    def Shader "S"
    {{
        uniform token info:id = "{}"
        {}
        token outputs:surface
    }}
    {}
}}
)usda";

uint64_t image_of(const std::string& context,
                  const std::string& id,
                  const std::string& inputs,
                  const std::string& nodes = "") {
    const scene::Scene scene =
        scene_from_usda(fmt::format(fmt::runtime(stage), context, id, inputs, nodes));
    integrator::RenderOptions options;
    options.end_sample = 8;
    return fingerprint(render_scene(scene, options));
}

constexpr const char* native = "UsdPreviewSurface";
constexpr const char* nodes_of_it = "ND_UsdPreviewSurface_surfaceshader";

TEST(MaterialX, ThePreviewSurfaceIsUsdsOwn) {
    for (const char* inputs :
         {"",
          "color3f inputs:diffuseColor = (0.2, 0.5, 0.8)\nfloat inputs:metallic = 0.3\nfloat "
          "inputs:roughness = 0.2",
          "float inputs:clearcoat = 0.6\nfloat inputs:clearcoatRoughness = 0.1\nfloat inputs:ior = "
          "1.8",
          "int inputs:useSpecularWorkflow = 1\ncolor3f inputs:specularColor = (0.5, 0.3, 0.1)",
          "float inputs:opacity = 0.3\nfloat inputs:roughness = 0.05",
          "float inputs:opacity = 0.3\nfloat inputs:opacityThreshold = 0.5",
          "color3f inputs:emissiveColor = (0.5, 0.2, 0.1)",
          "float3 inputs:normal = (0.2, 0.1, 0.9)"}) {
        EXPECT_EQ(image_of("mtlx:", nodes_of_it, inputs), image_of("", native, inputs)) << inputs;
    }
}

uint64_t image_of_file(const std::filesystem::path& file) {
    Diagnostics diagnostics;
    const Result<usd::stage::Stage> opened =
        usd::stage::Stage::open(file.string(), {}, diagnostics);
    translate::TranslateOptions options;
    options.resolution = std::array<int, 2>{64, 36};
    const Result<scene::Scene> scene = translate::translate_stage(*opened, options, diagnostics);
    EXPECT_EQ(diagnostics.error_count(), 0u) << file;
    integrator::RenderOptions rendering;
    rendering.end_sample = 4;
    return fingerprint(render_scene(*scene, rendering));
}

// Pairs of stages, one with .mtlx files and one without, which OpenUSD holds against each other by
// eye. Two more of its pairs differ in what they author (clearcoatRoughness 0.01 and 1,
// diffuseColor 0.2 and 1)
TEST(MaterialX, OpenUsdsPairsAreTheSameImage) {
    const std::filesystem::path folder =
        test_assets() / "openusd/imaging/testUsdImagingGLMaterialXvsNative";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no test assets";
    for (const auto& [nodes, plain] :
         {std::pair("Default", "default"), std::pair("Emissive", "emissive"),
          std::pair("Metallic", "metallic"), std::pair("Opacity", "opacity"),
          std::pair("Workflow", "workflow")})
        EXPECT_EQ(image_of_file(folder / fmt::format("materialX{}.usda", plain)),
                  image_of_file(folder / fmt::format("native{}.usda", nodes)))
            << nodes;
}

TEST(MaterialX, ReadersOfPrimvarsAreUsdsOwn) {
    const std::string reader = R"usda(
    def Shader "R"
    {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "tint"
        vector3f outputs:result
    })usda";
    const std::string node = R"usda(
    def Shader "R"
    {
        uniform token info:id = "ND_geompropvalue_color3"
        string inputs:geomprop = "tint"
        color3f outputs:out
    })usda";
    EXPECT_EQ(image_of("mtlx:", nodes_of_it,
                       "color3f inputs:diffuseColor.connect = </Mat/R.outputs:out>", node),
              image_of("", native, "color3f inputs:diffuseColor.connect = </Mat/R.outputs:result>",
                       reader));
}

// The same graph twice: of constants, which translation folds, and of constant primvars, which are
// looked up at every point
TEST(MaterialX, FoldingIsEvaluation) {
    const auto graph = [](const std::string& amount, const std::string& tint) {
        return fmt::format(
            R"usda(
    def Shader "Amount"
    {{
        uniform token info:id = "{}"
        {}
        float outputs:out
    }}
    def Shader "Tint"
    {{
        uniform token info:id = "{}"
        {}
        color3f outputs:out
    }}
    def Shader "Hsv"
    {{
        uniform token info:id = "ND_rgbtohsv_color3"
        color3f inputs:in.connect = </Mat/Tint.outputs:out>
        color3f outputs:out
    }}
    def Shader "Power"
    {{
        uniform token info:id = "ND_power_color3FA"
        color3f inputs:in1.connect = </Mat/Hsv.outputs:out>
        float inputs:in2.connect = </Mat/Amount.outputs:out>
        color3f outputs:out
    }}
    def Shader "Swizzle"
    {{
        uniform token info:id = "ND_swizzle_color3_vector3"
        color3f inputs:in.connect = </Mat/Power.outputs:out>
        string inputs:channels = "bgr"
        float3 outputs:out
    }}
    def Shader "Noise"
    {{
        uniform token info:id = "ND_fractal3d_vector3FA"
        float3 inputs:position.connect = </Mat/Swizzle.outputs:out>
        float inputs:amplitude = 2
        float3 outputs:out
    }}
    def Shader "N"
    {{
        uniform token info:id = "ND_mix_vector3"
        float3 inputs:bg.connect = </Mat/Noise.outputs:out>
        float3 inputs:fg.connect = </Mat/Swizzle.outputs:out>
        float inputs:mix.connect = </Mat/Amount.outputs:out>
        float3 outputs:out
    }})usda",
            amount.empty() ? "ND_geompropvalue_float" : "ND_constant_float",
            amount.empty() ? "string inputs:geomprop = \"amount\""
                           : "float inputs:value = " + amount,
            tint.empty() ? "ND_geompropvalue_color3" : "ND_constant_color3",
            tint.empty() ? "string inputs:geomprop = \"tint\"" : "color3f inputs:value = " + tint);
    };
    const std::string inputs =
        "color3f inputs:base_color.connect = </Mat/N.outputs:out>\nfloat "
        "inputs:specular_roughness.connect = </Mat/Amount.outputs:out>";
    const char* id = "ND_standard_surface_surfaceshader";
    EXPECT_EQ(image_of("mtlx:", id, inputs, graph("", "")),
              image_of("mtlx:", id, inputs, graph("0.4", "(0.7, 0.4, 0.2)")));
}

// Without coat and sheen a dielectric of standard_surface is that of UsdPreviewSurface
TEST(MaterialX, PlainStandardSurfaceIsAPreviewSurface) {
    EXPECT_EQ(image_of("mtlx:", "ND_standard_surface_surfaceshader",
                       "color3f inputs:base_color = (0.3, 0.5, 0.7)\nfloat "
                       "inputs:specular_roughness = 0.35\nfloat inputs:specular_IOR = 1.6"),
              image_of("", native,
                       "color3f inputs:diffuseColor = (0.3, 0.5, 0.7)\nfloat inputs:roughness = "
                       "0.35\nfloat inputs:ior = 1.6"));
    EXPECT_EQ(
        image_of("mtlx:", "ND_open_pbr_surface_surfaceshader",
                 "color3f inputs:base_color = (0.3, 0.5, 0.7)\nfloat inputs:specular_roughness = "
                 "0.35\nfloat inputs:specular_ior = 1.6\nfloat inputs:coat_weight = 0"),
        image_of("", native,
                 "color3f inputs:diffuseColor = (0.3, 0.5, 0.7)\nfloat inputs:roughness = "
                 "0.35\nfloat inputs:ior = 1.6"));
}

// What glTF and OpenPBR can both say is one image
TEST(MaterialX, GltfIsOpenPbrInOtherWords) {
    const struct {
        std::string gltf, open_pbr;
    } pairs[] = {
        {"color3f inputs:base_color = (0.3, 0.5, 0.7)\nfloat inputs:metallic = 0\nfloat "
         "inputs:roughness = 0.35\nfloat inputs:ior = 1.6",
         "color3f inputs:base_color = (0.3, 0.5, 0.7)\nfloat inputs:specular_roughness = "
         "0.35\nfloat inputs:specular_ior = 1.6"},
        {"color3f inputs:base_color = (0.9, 0.5, 0.2)\nfloat inputs:roughness = 0.4",
         "color3f inputs:base_color = (0.9, 0.5, 0.2)\nfloat inputs:base_metalness = 1\nfloat "
         "inputs:specular_roughness = 0.4"},
        {"float inputs:metallic = 0\nfloat inputs:clearcoat = 1\nfloat "
         "inputs:clearcoat_roughness = 0.1\ncolor3f inputs:sheen_color = (0.2, 0.1, 0)\nfloat "
         "inputs:sheen_roughness = 0.4",
         "color3f inputs:base_color = (1, 1, 1)\nfloat inputs:specular_roughness = 1\nfloat "
         "inputs:coat_weight = 1\nfloat inputs:coat_ior = 1.5\nfloat inputs:coat_darkening = "
         "0\nfloat inputs:coat_roughness = 0.1\nfloat inputs:fuzz_weight = 1\ncolor3f "
         "inputs:fuzz_color = (0.2, 0.1, 0)\nfloat inputs:fuzz_roughness = 0.4"},
        {"float inputs:metallic = 0\nfloat inputs:alpha = 0.5\nint inputs:alpha_mode = "
         "2\ncolor3f inputs:emissive = (1, 0, 0.5)\nfloat inputs:emissive_strength = 3",
         "color3f inputs:base_color = (1, 1, 1)\nfloat inputs:specular_roughness = 1\nfloat "
         "inputs:geometry_opacity = 0.5\ncolor3f inputs:emission_color = (1, 0, 0.5)\nfloat "
         "inputs:emission_luminance = 3"}};

    for (const auto& pair : pairs)
        EXPECT_EQ(image_of("mtlx:", "ND_gltf_pbr_surfaceshader", pair.gltf),
                  image_of("mtlx:", "ND_open_pbr_surface_surfaceshader", pair.open_pbr))
            << pair.gltf;
}

// By the height of the points, once as a primvar and once as their position
TEST(MaterialX, DisplacementReadsWhereTheSurfaceIs) {
    const auto moved = [](const std::string& source) {
        std::string text = fmt::format(fmt::runtime(stage),
                                       "mtlx:", "ND_standard_surface_surfaceshader", "", R"usda(
    token outputs:mtlx:displacement.connect = </Mat/D.outputs:out>
    def Shader "D"
    {
        uniform token info:id = "ND_displacement_float"
        float inputs:displacement.connect = </Mat/H.outputs:out>
        float inputs:scale = 0.25
        token outputs:out
    })usda" + source);
        text.insert(
            text.find("    float primvars:amount"),
            "    float[] primvars:height = [0, 0, 2, 2, -1, -1] (interpolation = \"vertex\")\n");
        integrator::RenderOptions options;
        options.end_sample = 4;
        return fingerprint(render_scene(scene_from_usda(text), options));
    };
    const std::string read = R"usda(
    def Shader "H"
    {
        uniform token info:id = "ND_geompropvalue_float"
        string inputs:geomprop = "height"
        float outputs:out
    })usda";
    const std::string found = R"usda(
    def Shader "P"
    {
        uniform token info:id = "ND_position_vector3"
        float3 outputs:out
    }
    def Shader "H"
    {
        uniform token info:id = "ND_extract_vector3"
        float3 inputs:in.connect = </Mat/P.outputs:out>
        int inputs:index = 1
        float outputs:out
    })usda";
    const std::string none = R"usda(
    def Shader "H"
    {
        uniform token info:id = "ND_constant_float"
        float outputs:out
    })usda";
    EXPECT_EQ(moved(found), moved(read));
    EXPECT_NE(moved(read), moved(none));
}

// World and object space agree where the object stands at the origin; a moved one takes its noise
// along
TEST(MaterialX, ObjectsTakeTheirNoiseAlong) {
    const auto nodes = [](const char* space) {
        return fmt::format(R"usda(
    def Shader "P"
    {{
        uniform token info:id = "ND_position_vector3"
        string inputs:space = "{}"
        float3 outputs:out
    }}
    def Shader "N"
    {{
        uniform token info:id = "ND_noise3d_float"
        float3 inputs:position.connect = </Mat/P.outputs:out>
        float outputs:out
    }})usda",
                           space);
    };
    const std::string inputs = "float inputs:base.connect = </Mat/N.outputs:out>";
    const auto scene_of = [&](const char* space) {
        return scene_from_usda(fmt::format(fmt::runtime(stage),
                                           "mtlx:", "ND_standard_surface_surfaceshader", inputs,
                                           nodes(space)));
    };
    const scene::Scene object = scene_of("object"), world = scene_of("world");
    integrator::RenderOptions options;
    options.end_sample = 8;
    const std::vector<double> a = beauty(render_scene(object, options)),
                              b = beauty(render_scene(world, options));
    ASSERT_EQ(a.size(), b.size());
    double difference = 0, sum = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        difference += std::abs(a[i] - b[i]);
        sum += std::abs(a[i]);
    }
    EXPECT_LT(difference, 1e-4 * sum);
    EXPECT_GT(sum, 0.0);

    // Everything two to the side: the same places of the object, others of the world
    const auto moved_by_two = [&](const char* space) {
        std::string text =
            fmt::format(fmt::runtime(stage), "mtlx:", "ND_standard_surface_surfaceshader", inputs,
                        nodes(space));
        for (const auto& [from, to] :
             {std::pair("(0, 0.5, 5)", "(2, 0.5, 5)"), std::pair("(0, 3, 2)", "(2, 3, 2)")})
            text.replace(text.find(from), std::string(from).size(), to);
        const char* quad = "    int[] faceVertexCounts";
        text.insert(text.find(quad),
                    "    double3 xformOp:translate = (2, 0, 0)\n    uniform token[] xformOpOrder = "
                    "[\"xformOp:translate\"]\n");
        return beauty(render_scene(scene_from_usda(text), options));
    };
    const auto apart = [](const std::vector<double>& x, const std::vector<double>& y) {
        double max = 0;
        for (size_t i = 0; i < x.size(); ++i) max = std::max(max, std::abs(x[i] - y[i]));
        return max;
    };
    EXPECT_LT(apart(moved_by_two("object"), a), 1e-4);
    EXPECT_GT(apart(moved_by_two("world"), b), 1e-2);
}

}  // namespace
}  // namespace velatura::test
