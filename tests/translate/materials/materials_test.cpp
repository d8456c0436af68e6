// SPDX-License-Identifier: Apache-2.0
#include "translate/support.h"

#include <gtest/gtest.h>

#include <tuple>

namespace velatura::translate::materials {

namespace {

std::string material(const std::string& name,
                     const std::string& inputs,
                     const std::string& more = "") {
    return "def Material \"" + name + "\" {\n token outputs:surface.connect = <" + "/M/" + name +
           "/S.outputs:surface>\n def Shader \"S\" {\n uniform token info:id = "
           "\"UsdPreviewSurface\"\n" +
           inputs + "\n token outputs:surface\n }\n" + more + "}\n";
}

std::string binding(const std::string& path,
                    const std::string& suffix = "",
                    const std::string& meta = "") {
    return "rel material:binding" + suffix + " = <" + path + ">" + meta + "\n";
}

const scene::Material& material_of(const Translated& t, size_t shape) {
    return t.scene.materials.at(t.scene.shapes.at(shape).material);
}

}  // namespace

TEST(Materials, ConstantsAndFallbacks) {
    Translated t;
    translate_text(
        camera() + "def Scope \"M\" {\n" +
            material("A",
                     "color3f inputs:diffuseColor = (0.1, 0.2, 0.3)\nfloat inputs:metallic = 1\n"
                     "int inputs:useSpecularWorkflow = 1\nfloat inputs:opacityThreshold = 0.5\n"
                     "token inputs:opacityMode = \"presence\"\nfloat inputs:displacement = 2\n"
                     "float inputs:sheen = 1") +
            "}\n" + quad("Q", binding("/M/A")),
        t);
    ASSERT_EQ(t.scene.materials.size(), 1u);
    const scene::Material& m = material_of(t, 0);
    EXPECT_EQ(m.diffuse_color.value, Rgb(0.1f, 0.2f, 0.3f));
    EXPECT_EQ(m.metallic.value.x, 1.0f);
    EXPECT_TRUE(m.use_specular_workflow);
    EXPECT_EQ(m.opacity_threshold, 0.5f);
    EXPECT_TRUE(m.presence);
    EXPECT_EQ(m.roughness.value.x, 0.5f);
    EXPECT_EQ(m.ior.value.x, 1.5f);
    EXPECT_EQ(m.clearcoat_roughness.value.x, 0.01f);
    EXPECT_EQ(m.specular_color.value, Rgb(0.0f));
    EXPECT_EQ(t.count("unconnected-displacement"), 1u);
    EXPECT_FALSE(scene::is_displacing(m));
    EXPECT_EQ(t.count("unknown-shader-input"), 1u);
}

TEST(Materials, RoughTransmissionIsAnInputOfOurOwn) {
    Translated t;
    translate_text(camera() + "def Scope \"M\" {\n" +
                       material("A", "bool inputs:velatura:roughTransmission = 1") +
                       material("B", "float inputs:opacity = 0.5") + "}\n" +
                       quad("Q", binding("/M/A")) + quad("R", binding("/M/B")),
                   t);
    EXPECT_TRUE(material_of(t, 0).rough_transmission);
    EXPECT_FALSE(material_of(t, 1).rough_transmission);
    EXPECT_EQ(t.count("unknown-shader-input"), 0u);
}

TEST(Materials, OwnInputsOfSheetsBodiesAndBrushedMetal) {
    Translated t;
    translate_text(
        camera() + "def Scope \"M\" {\n" +
            material("A",
                     "float inputs:velatura:anisotropy = 0.7\n"
                     "float inputs:velatura:anisotropyRotation = 0.25\n"
                     "bool inputs:velatura:thinWalled = 1\n"
                     "float inputs:velatura:diffuseTransmission = 0.4\n"
                     "color3f inputs:velatura:diffuseTransmissionColor = (1, 0.5, 0)") +
            material("B",
                     "color3f inputs:velatura:transmissionColor = (0.5, 0.25, 1)\n"
                     "float inputs:velatura:transmissionDepth = 3") +
            "}\n" +
            quad("Q", binding("/M/A") + "texCoord2f[] primvars:UVMap = [(0,0),(1,0),(1,1),(0,1)] "
                                        "(interpolation = \"vertex\")\n") +
            quad("R", binding("/M/B")),
        t);
    const scene::Material& a = material_of(t, 0);
    EXPECT_EQ(a.anisotropy.value.x, 0.7f);
    EXPECT_EQ(a.anisotropy_rotation.value.x, 0.25f);
    EXPECT_TRUE(a.thin_walled);
    EXPECT_EQ(a.diffuse_transmission.value.x, 0.4f);
    ASSERT_TRUE(a.diffuse_transmission_color.has_value());
    EXPECT_EQ(a.diffuse_transmission_color->value, Rgb(1.0f, 0.5f, 0.0f));
    const scene::Material& b = material_of(t, 1);
    EXPECT_EQ(b.transmission_color.value, Rgb(0.5f, 0.25f, 1.0f));
    EXPECT_EQ(b.transmission_depth, 3.0f);
    EXPECT_FALSE(b.thin_walled);
    EXPECT_FALSE(b.diffuse_transmission_color.has_value());
    for (const char* code : {"unknown-shader-input", "missing-tangents", "needs-thin-walled"})
        EXPECT_EQ(t.count(code), 0u) << code;
    // The coordinates that the tangents come from are kept
    EXPECT_EQ(std::get<scene::Mesh>(t.scene.shapes[0].geometry).primvars.size(), 1u);
}

TEST(Materials, OwnInputsThatMeanNothingAreNamed) {
    Translated t;
    translate_text(camera() + "def Scope \"M\" {\n" +
                       material("A",
                                "float inputs:velatura:anisotropy = 0.7\n"
                                "float inputs:velatura:diffuseTransmission = 0.4") +
                       material("B",
                                "bool inputs:velatura:thinWalled = 1\n"
                                "float inputs:velatura:transmissionDepth = 3") +
                       "}\n" + quad("Q", binding("/M/A")) + quad("R", binding("/M/B")) +
                       "def Cube \"S\" {\n" + binding("/M/A") + "}\n" + "def Sphere \"Own\" {\n" +
                       binding("/M/A") + "}\n",
                   t);
    // The sphere has tangents of its own
    EXPECT_EQ(t.count("missing-tangents"), 2u);
    EXPECT_EQ(t.count("needs-thin-walled"), 1u);
    EXPECT_EQ(t.count("needs-body"), 1u);
}

TEST(Materials, PrimvarsThatAPrimLacksAreNamedOnce) {
    const auto text = [](const std::string& fallback, const std::string& primvar) {
        return camera() + "def Scope \"M\" {\n" +
               material("A",
                        "color3f inputs:diffuseColor.connect = </M/A/T.outputs:rgb>\n"
                        "float inputs:roughness.connect = </M/A/T.outputs:r>",
                        R"(def Shader "T" {
    uniform token info:id = "UsdUVTexture"
    asset inputs:file = @a.png@
    float2 inputs:st.connect = </M/A/P.outputs:result>
}
def Shader "P" {
    uniform token info:id = "UsdPrimvarReader_float2"
    string inputs:varname = "map1"
)" + fallback + "\n}\n") +
               "}\n" + quad("Q", binding("/M/A") + primvar) + "def Sphere \"S\" {\n" +
               binding("/M/A") + "}\n";
    };
    Translated t;
    translate_text(text("", ""), t);
    EXPECT_EQ(t.count("missing-primvar"), 2u);
    for (const Diagnostic& d : t.diagnostics.all()) {
        if (d.code != "missing-primvar") continue;
        EXPECT_NE(d.message.find(d.prim_path), std::string::npos);
        EXPECT_NE(d.message.find("/M/A"), std::string::npos);
        EXPECT_NE(d.message.find("map1"), std::string::npos);
    }
    Translated with_fallback;
    translate_text(text("float2 inputs:fallback = (0.5, 0.5)", ""), with_fallback);
    EXPECT_EQ(with_fallback.count("missing-primvar"), 0u);
    Translated with_primvar;
    translate_text(text("",
                        "texCoord2f[] primvars:map1 = [(0,0),(1,0),(1,1),(0,1)] "
                        "(interpolation = \"vertex\")\n"),
                   with_primvar);
    EXPECT_EQ(with_primvar.count("missing-primvar"), 1u);
}

TEST(Materials, TexturesThroughNodeGraphsTransformsAndInterfaces) {
    Translated t;
    translate_text(
        camera() + R"(def Scope "M" {
    def Material "A" {
        float inputs:rough = 0.25
        token inputs:stname = "map7"
        token outputs:surface.connect = </M/A/S.outputs:surface>
        def Shader "S" {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </M/A/G.outputs:color>
            float inputs:roughness.connect = </M/A.inputs:rough>
            float inputs:opacity.connect = </M/A/G/T.outputs:a>
            float inputs:metallic.connect = </M/A/P.outputs:result>
            token outputs:surface
        }
        def Shader "P" {
            uniform token info:id = "UsdPrimvarReader_float"
            string inputs:varname = "shine"
            float inputs:fallback = 0.75
            float outputs:result
        }
        def NodeGraph "G" {
            color3f outputs:color.connect = </M/A/G/T.outputs:rgb>
            def Shader "T" {
                uniform token info:id = "UsdUVTexture"
                asset inputs:file = @tex/a.png@
                token inputs:wrapS = "repeat"
                token inputs:wrapT = "mirror"
                token inputs:sourceColorSpace = "raw"
                float4 inputs:scale = (2, 2, 2, 1)
                float4 inputs:bias = (-1, -1, -1, 0)
                float2 inputs:st.connect = </M/A/G/X.outputs:result>
                float3 outputs:rgb
                float outputs:a
            }
            def Shader "X" {
                uniform token info:id = "UsdTransform2d"
                float2 inputs:in.connect = </M/A/G/R.outputs:result>
                float inputs:rotation = 90
                float2 inputs:scale = (2, 3)
                float2 inputs:translation = (10, 20)
                float2 outputs:result
            }
            def Shader "R" {
                uniform token info:id = "UsdPrimvarReader_float2"
                string inputs:varname.connect = </M/A.inputs:stname>
                float2 outputs:result
            }
        }
    }
}
)" +
            quad("Q", binding("/M/A") + "float2[] primvars:map7 = [(0,0),(1,0),(1,1),(0,1)] "
                                        "(interpolation = \"vertex\")\n"
                                        "float2[] primvars:unused = [(0,0),(1,0),(1,1),(0,1)] "
                                        "(interpolation = \"vertex\")"),
        t);
    const scene::Material& m = material_of(t, 0);
    ASSERT_EQ(m.diffuse_color.source, scene::Input::Source::Texture);
    EXPECT_EQ(m.diffuse_color.output, scene::TextureOutput::Rgb);
    EXPECT_EQ(m.opacity.output, scene::TextureOutput::A);
    EXPECT_EQ(m.opacity.texture, m.diffuse_color.texture);
    EXPECT_EQ(m.roughness.value.x, 0.25f);
    EXPECT_EQ(m.metallic.source, scene::Input::Source::Primvar);
    EXPECT_EQ(t.scene.primvar_names[m.metallic.primvar], "shine");
    EXPECT_EQ(m.metallic.value.x, 0.75f);
    const scene::Texture& texture = t.scene.textures.at(m.diffuse_color.texture);
    EXPECT_EQ(texture.authored, "tex/a.png");
    EXPECT_NE(texture.file.find("/tex/a.png"), std::string::npos);
    EXPECT_EQ(texture.wrap_s, scene::Wrap::Repeat);
    EXPECT_EQ(texture.wrap_t, scene::Wrap::Mirror);
    EXPECT_EQ(texture.colors.curve, scene::SourceColorSpace::Raw);
    EXPECT_EQ(texture.scale[0], 2.0f);
    EXPECT_EQ(texture.bias[2], -1.0f);
    EXPECT_EQ(t.scene.primvar_names[texture.st], "map7");
    // (s, t) → scale (2s, 3t) → quarter turn (−3t, 2s) → (−3t + 10, 2s + 20)
    EXPECT_EQ(texture.st_matrix, (std::array<float, 4>{0, 2, -3, 0}));
    EXPECT_EQ(texture.st_offset, Vec2(10, 20));
    // Only what the material reads comes along
    ASSERT_EQ(t.mesh(0).primvars.size(), 1u);
    EXPECT_EQ(t.mesh(0).primvars[0].name, texture.st);
}

TEST(Materials, BindingsByNearestStrengthPurposeAndSubset) {
    const std::string scope =
        "def Scope \"M\" {\n" + material("A", "") + material("B", "") + material("C", "") + "}\n";
    const std::string strong = " (bindMaterialAs = \"strongerThanDescendants\")";
    Translated t;
    translate_text(
        camera() + scope + "def Xform \"W\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) {\n" +
            binding("/M/A") + quad("A_Inherits") + quad("B_Own", binding("/M/B")) +
            quad("C_Full", binding("/M/B") + binding("/M/C", ":full")) + "}\n" +
            "def Xform \"X\" {\n" + binding("/M/A", "", strong) + quad("Weak", binding("/M/B")) +
            "}\n" + quad("Y_Unbound") + quad("Z_Broken", binding("/M/Nope")),
        t);
    ASSERT_EQ(t.scene.shapes.size(), 6u);
    EXPECT_EQ(material_of(t, 0).name, "/M/A");
    EXPECT_EQ(material_of(t, 1).name, "/M/B");
    EXPECT_EQ(material_of(t, 2).name, "/M/C");
    EXPECT_EQ(material_of(t, 3).name, "/M/A");
    EXPECT_EQ(t.scene.shapes[4].material, scene::none);
    EXPECT_EQ(t.scene.shapes[5].material, scene::none);
    EXPECT_EQ(t.count("usd-binding-target"), 1u);
}

TEST(Materials, BindingsOfAnotherPurposeAreNamedAndChosenByOption) {
    const std::string text = camera() + "def Scope \"M\" {\n" +
                             material("A", "float inputs:metallic = 0.25") +
                             material("B", "float inputs:metallic = 0.5") + "}\n" +
                             quad("Alone", binding("/M/A", ":preview")) +
                             quad("Both", binding("/M/A", ":preview") + binding("/M/B")) +
                             quad("Full", binding("/M/B", ":full"));

    struct Case {
        const char* option;
        float metallic[3];  ///< of Alone, Both, Full; below 0: its displayColor
        size_t warnings;
    };

    const Case cases[] = {{"", {-1, 0.5f, 0.5f}, 1},
                          {"full", {-1, 0.5f, 0.5f}, 1},
                          {"preview", {0.25f, 0.25f, -1}, 1},
                          {"allPurpose", {-1, 0.5f, -1}, 2}};
    for (const Case& k : cases) {
        Translated t;
        TranslateOptions options;
        options.material_purpose = k.option;
        translate_text(text, t, options);
        ASSERT_EQ(t.scene.shapes.size(), 3u);
        for (size_t i = 0; i < 3; ++i) {
            const bool is_bound = t.scene.shapes[i].material != scene::none;
            ASSERT_EQ(is_bound, k.metallic[i] >= 0.0f) << k.option << i;
            if (!is_bound) continue;
            EXPECT_EQ(material_of(t, i).metallic.value.x, k.metallic[i]) << k.option;
        }
        EXPECT_EQ(t.count("other-material-purpose"), k.warnings) << k.option;
    }
    // As the settings' list has it: the first purpose that something is bound for
    Translated t;
    translate_text(
        "#usda 1.0\n( renderSettingsPrimPath = \"/R\" )\ndef RenderSettings \"R\" { "
        "uniform token[] materialBindingPurposes = [\"full\", \"preview\"]; }\n" +
            text,
        t);
    ASSERT_EQ(t.scene.shapes.size(), 3u);
    for (size_t i = 0; i < 3; ++i) EXPECT_NE(t.scene.shapes[i].material, scene::none) << i;
    EXPECT_EQ(material_of(t, 1).metallic.value.x, 0.25f) << "preview before all purposes";
}

TEST(Materials, FallbacksOfTexturesMayComeFromReaders) {
    Translated t;
    translate_text(
        camera() + R"(
def Material "M" {
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" { uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>
        token outputs:surface; }
    def Shader "T" { uniform token info:id = "UsdUVTexture"
        asset inputs:file = @none.png@
        float2 inputs:st = (0, 0)
        float4 inputs:fallback.connect = </M/R.outputs:result>
        float3 outputs:rgb; }
    def Shader "R" { uniform token info:id = "UsdPrimvarReader_float4"
        string inputs:varname = "tint"
        float4 inputs:fallback = (0.5, 0.25, 0.125, 1)
        float4 outputs:result; }
}
)" +
            quad("Q", binding("/M") + "float4[] primvars:tint = [(1, 2, 3, 1)] (interpolation = "
                                      "\"constant\")"),
        t);
    ASSERT_EQ(t.scene.textures.size(), 1u);
    const scene::Texture& x = t.scene.textures[0];
    EXPECT_EQ(x.fallback, (std::array<float, 4>{0.5f, 0.25f, 0.125f, 1.0f}));
    ASSERT_NE(x.fallback_primvar, scene::none);
    EXPECT_EQ(t.scene.primvar_names[x.fallback_primvar], "tint");
    ASSERT_EQ(t.mesh(0).primvars.size(), 1u) << "the mesh brings what the texture may need";
    EXPECT_EQ(t.count("unsupported-connection"), 0u);
}

/// UsdShade: where connections end without a value, the nearest value on the way counts.
TEST(Materials, EndsWithoutAValueLeaveTheInputItsOwn) {
    Translated t;
    translate_text(camera() + "def Scope \"M\" {\n" +
                       material("A",
                                "float inputs:metallic = 0.25\nfloat inputs:metallic.connect = "
                                "</M/A.inputs:shine>",
                                "float inputs:shine\n") +
                       "}\n" + quad("Q", binding("/M/A")),
                   t);
    EXPECT_EQ(material_of(t, 0).metallic.value.x, 0.25f);
}

TEST(Materials, SubsetsBindFaces) {
    Translated t;
    translate_text(camera() + "def Scope \"M\" {\n" + material("A", "") + material("B", "") +
                       "}\n" + R"(
def Mesh "Q" {
    point3f[] points = [(0,0,0),(1,0,0),(1,1,0),(0,1,0)]
    int[] faceVertexCounts = [3, 3]
    int[] faceVertexIndices = [0,1,2, 0,2,3]
    uniform token subdivisionScheme = "none"
)" + binding("/M/A") + R"(
    def GeomSubset "S" {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1]
)" + binding("/M/B") + R"(
    }
    def GeomSubset "Other" {
        uniform token elementType = "face"
        uniform token familyName = "somethingElse"
        int[] indices = [0]
)" + binding("/M/B") + "}\n}\n",
                   t);
    ASSERT_EQ(t.mesh(0).face_materials.size(), 2u);
    EXPECT_EQ(t.scene.materials[t.mesh(0).face_materials[0]].name, "/M/A");
    EXPECT_EQ(t.scene.materials[t.mesh(0).face_materials[1]].name, "/M/B");
}

TEST(Materials, DisplayColorIsInheritedWhenConstant) {
    Translated t;
    translate_text(camera() +
                       "def Xform \"W\" {\ncolor3f[] primvars:displayColor = [(0.5, 0.25, 1)]\n" +
                       quad("Q") + "def Sphere \"S\" {}\n}\n",
                   t);
    ASSERT_EQ(t.mesh(0).primvars.size(), 1u);
    EXPECT_EQ(t.mesh(0).primvars[0].values, (std::vector<float>{0.5f, 0.25f, 1}));
    ASSERT_EQ(t.gprim(1).primvars.size(), 1u);
    EXPECT_EQ(t.gprim(1).primvars[0].interpolation, scene::Interpolation::Constant);
}

TEST(Materials, OtherShadersAreNamed) {
    Translated t;
    translate_text(camera() + R"(def Scope "M" {
    def Material "A" {
        token outputs:arnold:surface.connect = </M/A/S.outputs:surface>
        def Shader "S" { uniform token info:id = "arnold:standard_surface"; }
    }
    def Material "B" {
        token outputs:surface.connect = </M/B/S.outputs:surface>
        def Shader "S" { uniform token info:id = "ND_open_pbr"; }
    }
}
)" + quad("Q", binding("/M/A")) +
                       quad("R", binding("/M/B")),
                   t);
    EXPECT_EQ(t.count("unsupported-material"), 1u);
    EXPECT_EQ(t.count("unsupported-shader"), 1u);
    EXPECT_EQ(t.scene.shapes[0].material, scene::none);
}

TEST(Materials, EmissionStandsInForLights) {
    Translated t;
    translate_text(camera() + "def Scope \"M\" {\n" +
                       material("A", "color3f inputs:emissiveColor = (1, 1, 1)") + "}\n" +
                       quad("Q", binding("/M/A")),
                   t);
    EXPECT_TRUE(t.scene.lights.empty());
    ASSERT_EQ(t.scene.groups.size(), 1u);
    EXPECT_EQ(t.scene.groups[0].name, "emissive");
}

TEST(Materials, ConnectionCyclesEnd) {
    Translated t;
    translate_text(camera() + R"(def Scope "M" {
    def Material "A" {
        float inputs:a.connect = </M/A.inputs:b>
        float inputs:b.connect = </M/A.inputs:a>
        token outputs:surface.connect = </M/A/S.outputs:surface>
        def Shader "S" {
            uniform token info:id = "UsdPreviewSurface"
            float inputs:roughness.connect = </M/A.inputs:a>
            token outputs:surface
        }
    }
}
)" + quad("Q", binding("/M/A")),
                   t);
    EXPECT_EQ(t.count("connection-cycle"), 1u);
    EXPECT_EQ(material_of(t, 0).roughness.value.x, 0.5f);
}

TEST(Materials, PrioritiesAreWholeNumbers) {
    for (const auto& [authored, expected, warnings] :
         {std::tuple("3", 3, 0u), std::tuple("-2", -2, 0u), std::tuple("1e9", 0, 1u)}) {
        Translated t;
        translate_text(
            camera() + "def Scope \"M\" {\n" +
                material("A",
                         std::string("double inputs:velatura:dielectricPriority = ") + authored) +
                "}\n" + quad("Q", binding("/M/A")),
            t);
        EXPECT_EQ(material_of(t, 0).dielectric_priority, expected);
        EXPECT_EQ(t.count("bad-priority"), warnings);
    }
}

TEST(Materials, ScatterBelowTheSurface) {
    Translated t;
    translate_text(
        camera() + "def Scope \"M\" {\n" +
            material(
                "A",
                "float inputs:velatura:subsurface = 0.7\ncolor3f inputs:velatura:subsurfaceRadius "
                "= (1, 0.5, -1)\nfloat inputs:velatura:subsurfaceAnisotropy = 2") +
            material("B",
                     "bool inputs:velatura:thinWalled = 1\nfloat inputs:velatura:subsurface = 1\n"
                     "color3f inputs:velatura:subsurfaceColor = (0.9, 0.6, 0.5)") +
            "}\n" + quad("Q", binding("/M/A")) + quad("R", binding("/M/B")),
        t);
    EXPECT_EQ(material_of(t, 0).subsurface.value.x, 0.7f);
    EXPECT_EQ(material_of(t, 0).subsurface_radius.value, Rgb(1.0f, 0.5f, -1.0f));
    EXPECT_FALSE(material_of(t, 0).subsurface_color);
    EXPECT_EQ(material_of(t, 1).subsurface_color->value, Rgb(0.9f, 0.6f, 0.5f));
    EXPECT_EQ(t.count("material-out-of-range"), 2u);
    EXPECT_EQ(t.count("needs-body"), 1u);
    EXPECT_TRUE(scene::can_scatter_below(material_of(t, 0)));
    EXPECT_FALSE(scene::can_scatter_below(material_of(t, 1)));
}

}  // namespace velatura::translate::materials
