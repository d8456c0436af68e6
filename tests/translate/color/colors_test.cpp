// SPDX-License-Identifier: Apache-2.0
#include "translate/color/named_color_space.h"
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace velatura::translate::color {
namespace {

/// 0.5 by the curve of IEC 61966-2-1: ((0.5 + 0.055) / 1.055)^2.4.
constexpr float half_of_srgb = 0.21404114f;

Rgb light_of(const Translated& t, const std::string& path) {
    for (const scene::Light& light : t.scene.lights)
        if (light.name == path) return light.Le;
    ADD_FAILURE() << "no light " << path;
    return Rgb(-1.0f);
}

void expect_near(const Rgb& found, const Rgb& expected, const char* what, float tolerance = 2e-6f) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], tolerance) << what;
}

/// Linear Rec.709 of (0.25, 0.5, 0.75) in the space that a name stands for.
struct SpaceCase {
    const char* name;
    Vec3d expected;
};

TEST(Colors, SpacesHaveTheNamesOfTheListAndOfConfigurations) {
    const auto srgb = [](double v) { return std::pow((v + 0.055) / 1.055, 2.4); };
    const Vec3d as_is(0.25, 0.5, 0.75), by_srgb(srgb(0.25), srgb(0.5), srgb(0.75));
    const auto power = [](double gamma) {
        return Vec3d(std::pow(0.25, gamma), std::pow(0.5, gamma), std::pow(0.75, gamma));
    };
    // AP1: rows of S-2014-004's matrix to XYZ, Bradford's from D60 to D65, Rec.709's from XYZ, as
    // OpenColorIO's built-in ACEScg has them: (1.70505, -0.62179, -0.08326), (-0.13026, 1.14080,
    // -0.01055), (-0.02400, -0.12897, 1.15297)
    const Vec3d ap1(1.70505 * 0.25 - 0.62179 * 0.5 - 0.08326 * 0.75,
                    -0.13026 * 0.25 + 1.14080 * 0.5 - 0.01055 * 0.75,
                    -0.02400 * 0.25 - 0.12897 * 0.5 + 1.15297 * 0.75);
    // AP0, the same road: (2.52169, -1.13413, -0.38756), (-0.27648, 1.37272, -0.09624),
    // (-0.01538, -0.15298, 1.16835)
    const Vec3d ap0(2.52169 * 0.25 - 1.13413 * 0.5 - 0.38756 * 0.75,
                    -0.27648 * 0.25 + 1.37272 * 0.5 - 0.09624 * 0.75,
                    -0.01538 * 0.25 - 0.15298 * 0.5 + 1.16835 * 0.75);
    // ITU-R BT.2087: (1.6605, -0.5876, -0.0728), (-0.1246, 1.1329, -0.0083), (-0.0182, -0.1006,
    // 1.1187)
    const Vec3d rec2020(1.6605 * 0.25 - 0.5876 * 0.5 - 0.0728 * 0.75,
                        -0.1246 * 0.25 + 1.1329 * 0.5 - 0.0083 * 0.75,
                        -0.0182 * 0.25 - 0.1006 * 0.5 + 1.1187 * 0.75);
    // IEC 61966-2-1: (3.2410, -1.5374, -0.4986), (-0.9692, 1.8760, 0.0416), (0.0556, -0.2040,
    // 1.0570)
    const Vec3d xyz(3.2410 * 0.25 - 1.5374 * 0.5 - 0.4986 * 0.75,
                    -0.9692 * 0.25 + 1.8760 * 0.5 + 0.0416 * 0.75,
                    0.0556 * 0.25 - 0.2040 * 0.5 + 1.0570 * 0.75);
    const SpaceCase cases[] = {{"raw", as_is},
                               {"data", as_is},
                               {"Utility - Raw", as_is},
                               {"identity", as_is},
                               {"unknown", as_is},
                               {"linear", as_is},
                               {"scene_linear", as_is},
                               {"lin_rec709_scene", as_is},
                               {"lin_rec709", as_is},
                               {"Utility - Linear - sRGB", as_is},
                               {"Linear Rec.709 (sRGB)", as_is},
                               {"scene-linear Rec.709-sRGB", as_is},
                               {"srgb_rec709_scene", by_srgb},
                               {"srgb_texture", by_srgb},
                               {"sRGB", by_srgb},
                               {"Input - Texture - sRGB", by_srgb},
                               {"Utility - sRGB - Texture", by_srgb},
                               {"sRGB - Texture", by_srgb},
                               {"sRGB Encoded Rec.709 (sRGB)", by_srgb},
                               {"g22_rec709_scene", power(2.2)},
                               {"Gamma 2.2 Encoded Rec.709", power(2.2)},
                               {"g18_rec709_scene", power(1.8)},
                               {"Utility - Gamma 2.2 - Rec.709 - Texture", power(2.2)},
                               {"Gamma 2.4 Rec.709 - Texture", power(2.4)},
                               {"g18_rec709_tx", power(1.8)},
                               {"Linear ACEScg", ap1},
                               {"Linear ACES", ap0},
                               {"Linear CIE-XYZ D65", xyz},
                               {"lin_ap1_scene", ap1},
                               {"lin_ap1", ap1},
                               {"ACEScg", ap1},
                               {"ACES - ACEScg", ap1},
                               {"lin_ap0_scene", ap0},
                               {"ACES2065-1", ap0},
                               {"lin_rec2020_scene", rec2020},
                               {"lin_ciexyzd65_scene", xyz}};
    for (const SpaceCase& k : cases) {
        const ColorSpace* space = named_color_space(k.name);
        ASSERT_NE(space, nullptr) << k.name;
        const Vec3d found = space->decoding(as_is);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], k.expected[c], 2e-4) << k.name;
    }
    // White is white in all but XYZ
    for (const char* name : {"lin_p3d65_scene", "srgb_p3d65_scene", "lin_adobergb_scene",
                             "g22_adobergb_scene", "srgb_ap1_scene", "g22_ap1_scene", "lin_ap0"}) {
        const ColorSpace* space = named_color_space(name);
        ASSERT_NE(space, nullptr) << name;
        const Vec3d white = space->decoding(Vec3d(1.0));
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(white[c], 1.0, 1e-9) << name;
    }
    // Texture spaces of the ACES configurations, with and without their suffix
    for (const auto& [texture, scene] :
         {std::pair("Gamma 2.2 AP1 - Texture", "g22_ap1_scene"),
          std::pair("g22_ap1_tx", "g22_ap1_scene"),
          std::pair("sRGB Encoded AP1 - Texture", "srgb_ap1_scene"),
          std::pair("sRGB Encoded P3-D65 - Texture", "srgb_p3d65_scene"),
          std::pair("Utility - Linear - Adobe RGB", "lin_adobergb_scene"),
          std::pair("Linear DCI-P3 D65", "lin_p3d65_scene")})
        EXPECT_EQ(named_color_space(texture)->decoding(as_is),
                  named_color_space(scene)->decoding(as_is))
            << texture;
    for (const char* name : {"my_camera_log", "ARRI LogC4", "texture", "Utility - Texture"})
        EXPECT_EQ(named_color_space(name), nullptr) << name;
}

TEST(Colors, CurvesMirrorNegativeNumbers) {
    const ColorSpace* space = named_color_space("srgb_rec709_scene");
    ASSERT_NE(space, nullptr);
    const Vec3d found = space->decoding(Vec3d(-0.5, 0.5, 0.01));
    EXPECT_EQ(found.x, -found.y);
    EXPECT_NEAR(found.z, 0.01 / 12.92, 1e-12);
}

/// One color, (0.5, 0.5, 0.5) as it stands there, read in each place where a scene holds colors.
struct Place {
    const char* name;
    const char* text;  ///< {} stands for the metadata
    Rgb (*read)(const Translated& t);
};

Rgb display_color(const Translated& t) {
    const auto& values = t.gprim(0).primvars.at(0).values;
    return {values.at(0), values.at(1), values.at(2)};
}

const Place places[] = {
    {"displayColor",
     "def Sphere \"S\" {{ color3f[] primvars:displayColor = [(0.5, 0.5, 0.5)] {}\n}}\n",
     display_color},
    {"UsdPreviewSurface",
     "def Sphere \"S\" {{ rel material:binding = </M>; }}\ndef Material \"M\" {{\n token "
     "outputs:surface.connect = </M/S.outputs:surface>\n def Shader \"S\" {{\n uniform token "
     "info:id = \"UsdPreviewSurface\"\n color3f inputs:diffuseColor = (0.5, 0.5, 0.5) {}\n token "
     "outputs:surface\n }}\n }}\n",
     [](const Translated& t) { return t.scene.materials.at(0).diffuse_color.value; }},
    {"interface of a Material",
     "def Sphere \"S\" {{ rel material:binding = </M>; }}\ndef Material \"M\" {{\n color3f "
     "inputs:c = (0.5, 0.5, 0.5) {}\n token outputs:surface.connect = </M/S.outputs:surface>\n def "
     "Shader \"S\" {{\n uniform token info:id = \"UsdPreviewSurface\"\n color3f "
     "inputs:diffuseColor.connect = </M.inputs:c>\n token outputs:surface\n }}\n }}\n",
     [](const Translated& t) { return t.scene.materials.at(0).diffuse_color.value; }},
    {"MaterialX",
     "def Sphere \"S\" {{ rel material:binding = </M>; }}\ndef Material \"M\" {{\n token "
     "outputs:mtlx:surface.connect = </M/S.outputs:out>\n def Shader \"S\" {{\n uniform token "
     "info:id = \"ND_UsdPreviewSurface_surfaceshader\"\n color3f inputs:diffuseColor = (0.5, 0.5, "
     "0.5) {}\n token outputs:out\n }}\n }}\n",
     [](const Translated& t) { return t.scene.materials.at(0).diffuse_color.value; }},
    {"light", "def SphereLight \"L\" {{ color3f inputs:color = (0.5, 0.5, 0.5) {}\n}}\n",
     [](const Translated& t) { return t.scene.lights.at(0).Le; }},
    {"shadow color",
     "def SphereLight \"L\" (prepend apiSchemas = [\"ShadowAPI\"]) {{ color3f "
     "inputs:shadow:color = (0.5, 0.5, 0.5) {}\n}}\n",
     [](const Translated& t) { return t.scene.lights.at(0).links.shadow_color; }},
    {"focus tint",
     "def SphereLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) {{ float inputs:shaping:focus "
     "= 2\n color3f inputs:shaping:focusTint = (0.5, 0.5, 0.5) {}\n}}\n",
     [](const Translated& t) { return t.scene.lights.at(0).shaping.focus_tint; }},
    {"mesh light",
     "def Sphere \"S\" (prepend apiSchemas = [\"MeshLightAPI\"]) {{ color3f inputs:color = (0.5, "
     "0.5, 0.5) {}\n}}\n",
     [](const Translated& t) { return t.scene.mesh_lights.at(0).Le; }},
};

TEST(Colors, EveryReaderTakesTheSpaceOfTheAttribute) {
    for (const Place& p : places) {
        Translated plain, marked, unknown;
        translate_text(camera() + fmt::format(fmt::runtime(p.text), ""), plain);
        translate_text(
            camera() + fmt::format(fmt::runtime(p.text), "(colorSpace = \"srgb_rec709_scene\")"),
            marked);
        translate_text(
            camera() + fmt::format(fmt::runtime(p.text), "(colorSpace = \"my_camera_log\")"),
            unknown);
        expect_near(p.read(plain), Rgb(0.5f), p.name);
        expect_near(p.read(marked), Rgb(half_of_srgb), p.name);
        EXPECT_EQ(marked.count("unknown-color-space"), 0u) << p.name;
        expect_near(p.read(unknown), Rgb(0.5f), p.name);
        EXPECT_GE(unknown.count("unknown-color-space"), 1u) << p.name;
    }
}

TEST(Colors, EveryReaderTakesTheSpaceOfThePrimAbove) {
    for (const Place& p : places) {
        Translated t;
        std::string text = fmt::format(fmt::runtime(p.text), "");
        // Paths below the group
        for (size_t at = 0; (at = text.find("</M", at)) != std::string::npos; at += 3)
            text.replace(at, 3, "</G/M");
        translate_text(camera() +
                           "def Scope \"G\" (prepend apiSchemas = [\"ColorSpaceAPI\"]) {\n uniform "
                           "token colorSpace:name = \"srgb_rec709_scene\"\n" +
                           text + "}\n",
                       t);
        expect_near(p.read(t), Rgb(half_of_srgb), p.name);
    }
}

TEST(Colors, TheNearestSpaceWins) {
    Translated t;
    translate_text(camera() + R"(
def Xform "G" (prepend apiSchemas = ["ColorSpaceAPI"]) {
    uniform token colorSpace:name = "srgb_rec709_scene"
    def Xform "H" (prepend apiSchemas = ["ColorSpaceAPI"]) {
        uniform token colorSpace:name = "g22_rec709_scene"
        def SphereLight "A" { color3f inputs:color = (0.5, 0.5, 0.5); }
        def SphereLight "B" {
            color3f inputs:color = (0.5, 0.5, 0.5) (colorSpace = "lin_rec709_scene")
        }
    }
    def SphereLight "C" { color3f inputs:color = (0.5, 0.5, 0.5); }
    def Xform "I" {
        uniform token colorSpace:name = "g18_rec709_scene"
        def SphereLight "D" { color3f inputs:color = (0.5, 0.5, 0.5); }
    }
}
)",
                   t);
    ASSERT_EQ(t.scene.lights.size(), 4u);
    expect_near(light_of(t, "/G/H/A"), Rgb(0.21763764f), "0.5^2.2");
    expect_near(light_of(t, "/G/H/B"), Rgb(0.5f), "its own metadata");
    expect_near(light_of(t, "/G/C"), Rgb(half_of_srgb), "the group's");
    expect_near(light_of(t, "/G/I/D"), Rgb(half_of_srgb), "without the API the name says nothing");
    EXPECT_EQ(t.count("unapplied-schema"), 1u);
}

TEST(Colors, ScenesDefineSpacesOfTheirOwn) {
    Translated t;
    translate_text(camera() + R"(
def Xform "G" (prepend apiSchemas = ["ColorSpaceDefinitionAPI:mine", "ColorSpaceAPI",
        "ColorSpaceDefinitionAPI:flat"]) {
    uniform token colorSpaceDefinition:mine:name = "cube"
    float2 colorSpaceDefinition:mine:redChroma = (0.64, 0.33)
    float2 colorSpaceDefinition:mine:greenChroma = (0.3, 0.6)
    float2 colorSpaceDefinition:mine:blueChroma = (0.15, 0.06)
    float2 colorSpaceDefinition:mine:whitePoint = (0.3127, 0.329)
    float colorSpaceDefinition:mine:gamma = 3
    uniform token colorSpaceDefinition:flat:name = "line"
    float2 colorSpaceDefinition:flat:redChroma = (0.1, 0.1)
    float2 colorSpaceDefinition:flat:greenChroma = (0.2, 0.2)
    float2 colorSpaceDefinition:flat:blueChroma = (0.3, 0.3)
    uniform token colorSpace:name = "cube"
    def SphereLight "A" { color3f inputs:color = (0.5, 0.5, 0.5); }
    def SphereLight "B" { color3f inputs:color = (0.5, 0.5, 0.5) (colorSpace = "line"); }
}
)",
                   t);
    ASSERT_EQ(t.scene.lights.size(), 2u);
    expect_near(light_of(t, "/G/A"), Rgb(0.125f), "0.5^3 in the primaries of Rec.709");
    expect_near(light_of(t, "/G/B"), Rgb(0.5f), "three primaries on a line are no space");
    EXPECT_EQ(t.count("bad-color-space"), 1u);
}

TEST(Colors, LightsOutsideTheGamutAreClippedAndNamed) {
    Translated t;
    translate_text(camera() +
                       "def SphereLight \"L\" { color3f inputs:color = (0, 1, 0) "
                       "(colorSpace = \"lin_ap1_scene\"); }\n",
                   t);
    ASSERT_EQ(t.scene.lights.size(), 1u);
    // Column of AP1's green: (-0.62179, 1.14080, -0.12897)
    expect_near(t.scene.lights[0].Le, Rgb(0.0f, 1.14080474f, 0.0f), "green of AP1");
    EXPECT_EQ(t.count("color-outside-gamut"), 1u);
}

TEST(Colors, ImagesTakeTheSpaceThatIsNamedNearest) {
    struct Case {
        const char* inputs;
        scene::SourceColorSpace curve;
        double exponent;
        bool has_primaries;
        size_t warnings;
    };

    using Space = scene::SourceColorSpace;
    const Case cases[] = {
        {"", Space::Auto, 1, false, 0},
        {"token inputs:sourceColorSpace = \"sRGB\"", Space::Srgb, 1, false, 0},
        {"token inputs:sourceColorSpace = \"raw\"", Space::Raw, 1, false, 0},
        {"token inputs:sourceColorSpace = \"linear\"", Space::Raw, 1, false, 0},
        {"token inputs:sourceColorSpace = \"Utility - Raw\"", Space::Raw, 1, false, 0},
        {"token inputs:sourceColorSpace = \"scene_linear\"", Space::Raw, 1, false, 0},
        {"token inputs:sourceColorSpace = \"lin_ap1\"", Space::Raw, 1, true, 0},
        {"token inputs:sourceColorSpace = \"ACEScg\"", Space::Raw, 1, true, 0},
        {"token inputs:sourceColorSpace = \"Input - Texture - sRGB\"", Space::Srgb, 1, false, 0},
        {"token inputs:sourceColorSpace = \"g22_rec709_scene\"", Space::Raw, 2.2, false, 0},
        {"token inputs:sourceColorSpace = \"srgb_p3d65_scene\"", Space::Srgb, 1, true, 0},
        {"token inputs:sourceColorSpace = \"my_camera_log\"", Space::Auto, 1, false, 1},
        {"uniform token colorSpace:name = \"lin_ap1_scene\"", Space::Raw, 1, true, 0},
        {"uniform token colorSpace:name = \"lin_ap1_scene\"\ntoken inputs:sourceColorSpace = "
         "\"sRGB\"",
         Space::Srgb, 1, false, 0}};
    for (const Case& k : cases) {
        Translated t;
        translate_text(
            camera() +
                fmt::format(
                    "def Sphere \"S\" {{ rel material:binding = </M>; }}\ndef Material \"M\" {{\n "
                    "token outputs:surface.connect = </M/S.outputs:surface>\n def Shader \"S\" "
                    "{{\n uniform token info:id = \"UsdPreviewSurface\"\n color3f "
                    "inputs:diffuseColor.connect = </M/T.outputs:rgb>\n token outputs:surface\n "
                    "}}\n def Shader \"T\" (prepend apiSchemas = [\"ColorSpaceAPI\"]) {{\n uniform "
                    "token info:id = \"UsdUVTexture\"\n asset inputs:file = @none.png@\n float2 "
                    "inputs:st = (0, 0)\n {}\n float3 outputs:rgb\n }}\n }}\n",
                    k.inputs),
            t);
        ASSERT_EQ(t.scene.textures.size(), 1u) << k.inputs;
        const scene::TexelColors& colors = t.scene.textures[0].colors;
        EXPECT_EQ(colors.curve, k.curve) << k.inputs;
        EXPECT_EQ(colors.decoding.exponent, k.exponent) << k.inputs;
        EXPECT_EQ(colors.decoding.has_primaries(), k.has_primaries) << k.inputs;
        EXPECT_EQ(t.count("unknown-color-space"), k.warnings) << k.inputs;
    }
}

TEST(Colors, ConfigurationsAreNotRead) {
    Translated t;
    translate_text(
        "#usda 1.0\n( colorConfiguration = @studio.ocio@\n colorManagementSystem = "
        "\"ocio\" )\n" +
            camera(),
        t);
    EXPECT_EQ(t.count("color-configuration"), 1u);
    for (const char* space : {"lin_rec709_scene", "lin_ap1_scene", "srgb_rec709_scene"}) {
        Translated settings;
        translate_text(
            "#usda 1.0\n( renderSettingsPrimPath = \"/R\" )\ndef RenderSettings \"R\" { "
            "uniform token renderingColorSpace = \"" +
                std::string(space) + "\"; }\n" + camera(),
            settings);
        EXPECT_EQ(settings.count("unsupported-color-space"), space[0] == 'l' ? 0u : 1u) << space;
    }
}

TEST(Colors, ImagesOfLightsHaveASpace) {
    Translated t;
    translate_text(camera() +
                       "def DomeLight \"D\" { asset inputs:texture:file = @none.exr@ "
                       "(colorSpace = \"lin_ap1_scene\"); }\n",
                   t);
    ASSERT_EQ(t.scene.lights.size(), 1u);
    EXPECT_EQ(t.scene.lights[0].texture_colors.curve, scene::SourceColorSpace::Raw);
    EXPECT_TRUE(t.scene.lights[0].texture_colors.decoding.has_primaries());
}

}  // namespace
}  // namespace velatura::translate::color
