// SPDX-License-Identifier: Apache-2.0
// The working space: every door of colors against linear Rec.709 times a matrix that is derived
// here, from the primaries and whites of the standards.
#include "translate/color/named_color_space.h"
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace velatura::translate::color {
namespace {

using Matrix = std::array<std::array<double, 3>, 3>;
using Triple = std::array<double, 3>;

Triple times(const Matrix& m, const Triple& v) {
    Triple out{};
    for (size_t i = 0; i < 3; ++i)
        for (size_t k = 0; k < 3; ++k) out[i] += m[i][k] * v[k];
    return out;
}

Matrix times(const Matrix& a, const Matrix& b) {
    Matrix out{};
    for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j)
            for (size_t k = 0; k < 3; ++k) out[i][j] += a[i][k] * b[k][j];
    return out;
}

/// Cramer's rule.
Matrix inverse(const Matrix& m) {
    const auto cofactor = [&m](size_t r, size_t c) {
        const size_t r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
        return m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
    };
    double det = 0;
    for (size_t c = 0; c < 3; ++c) det += m[0][c] * cofactor(0, c);
    Matrix out{};
    for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j) out[j][i] = cofactor(i, j) / det;
    return out;
}

/// x and y of red, green, blue and white.
using Chart = std::array<double, 8>;

constexpr Chart rec709 = {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290};
constexpr Chart ap1 = {0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767};
constexpr Chart rec2020 = {0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290};

Triple xyz(double x, double y) {
    return {x / y, 1.0, (1.0 - x - y) / y};
}

/// SMPTE RP 177: white is one part of each primary.
Matrix xyz_from(const Chart& c) {
    Matrix m{};
    for (size_t p = 0; p < 3; ++p) {
        const Triple column = xyz(c[2 * p], c[2 * p + 1]);
        for (size_t i = 0; i < 3; ++i) m[i][p] = column[i];
    }
    const Triple parts = times(inverse(m), xyz(c[6], c[7]));
    for (auto& row : m)
        for (size_t p = 0; p < 3; ++p) row[p] *= parts[p];
    return m;
}

/// Linear Rec.709 in the other space, whites adapted by Bradford's cone responses (ICC.1:2022,
/// annex E).
Matrix from_rec709_to(const Chart& to) {
    constexpr Matrix cones = {
        {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
    const Triple seen = times(cones, xyz(rec709[6], rec709[7])),
                 wanted = times(cones, xyz(to[6], to[7]));
    Matrix scaled = cones;
    for (size_t i = 0; i < 3; ++i)
        for (double& v : scaled[i]) v *= wanted[i] / seen[i];
    const Matrix adapted = times(inverse(cones), times(scaled, xyz_from(rec709)));
    return times(inverse(xyz_from(to)), adapted);
}

Rgb expected(const Matrix& m, const Rgb& c) {
    const Triple v = times(m, Triple{double(c.x), double(c.y), double(c.z)});
    return {float(v[0]), float(v[1]), float(v[2])};
}

void expect_near(const Rgb& found, const Rgb& expected, const std::string& what) {
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(found[c], expected[c], 1e-6f * std::max(1.0f, std::abs(expected[c])))
            << what << " " << c;
}

/// A scene in a working space.
struct In : Translated {
    In(const std::string& text, const char* space) {
        TranslateOptions options;
        options.working_space = space;
        // A statement ends with its line
        std::string lines = camera() + text;
        for (size_t at = 0; (at = lines.find(" }", at)) != std::string::npos;) lines[at] = '\n';
        translate_text(lines, *this, options);
    }
};

std::string bound(const std::string& shader,
                  const std::string& rest = "",
                  const std::string& output = "surface",
                  const std::string& of = "surface") {
    return "def Sphere \"S\" { rel material:binding = </M>; }\ndef Material \"M\" {\n token "
           "outputs:" +
           output + ".connect = </M/S.outputs:" + of + ">\n def Shader \"S\" {\n" + shader +
           "\n token outputs:" + of + "\n }\n" + rest + "}\n";
}

std::string preview(const std::string& inputs, const std::string& rest = "") {
    return bound(" uniform token info:id = \"UsdPreviewSurface\"\n" + inputs, rest);
}

std::string standard(const std::string& inputs, const std::string& rest = "") {
    return bound(" uniform token info:id = \"ND_standard_surface_surfaceshader\"\n" + inputs, rest,
                 "mtlx:surface", "out");
}

std::string hair(const std::string& inputs) {
    return bound(" uniform token info:id = \"VelaturaHair\"\n" + inputs, "", "velatura:surface");
}

const char* const volume =
    "def Volume \"V\" { rel field:density = </V/D>\n color3f velatura:volume:albedo = (0.8, 0.3, "
    "0.05)\n color3f velatura:volume:emissionColor = (0.8, 0.3, 0.05)\n color3f "
    "velatura:volume:extinctionColor = (0.8, 0.3, 0.05)\n def OpenVDBAsset \"D\" { asset filePath "
    "= @none.vdb@\n token fieldName = \"density\" } }\n";

const scene::Material& material(const Translated& t) {
    return t.scene.materials.at(0);
}

/// Where a scene holds a color, or three numbers that are none.
struct Door {
    const char* name;
    std::string text;
    Rgb (*read)(const Translated& t);
};

const Door colors[] = {
    {"displayColor", "def Sphere \"S\" { color3f[] primvars:displayColor = [(0.8, 0.3, 0.05)] }\n",
     [](const Translated& t) {
         const auto& v = t.gprim(0).primvars.at(0).values;
         return Rgb(v.at(0), v.at(1), v.at(2));
     }},
    {"diffuse color", preview("color3f inputs:diffuseColor = (0.8, 0.3, 0.05)"),
     [](const Translated& t) { return material(t).diffuse_color.value; }},
    {"a color of another type", preview("float3 inputs:diffuseColor = (0.8, 0.3, 0.05)"),
     [](const Translated& t) { return material(t).diffuse_color.value; }},
    {"emissive color", preview("color3f inputs:emissiveColor = (8, 3, 0.5)"),
     [](const Translated& t) { return material(t).emissive_color.value; }},
    {"transmission color", preview("color3f inputs:velatura:transmissionColor = (0.8, 0.3, 0.05)"),
     [](const Translated& t) { return material(t).transmission_color.value; }},
    {"MaterialX", standard("color3f inputs:base_color = (0.8, 0.3, 0.05)\n float inputs:base = 1"),
     [](const Translated& t) { return material(t).diffuse_color.value; }},
    {"a node of MaterialX",
     standard("color3f inputs:emission_color.connect = </M/N.outputs:out>\n float inputs:emission "
              "= 1",
              "def Shader \"N\" { uniform token info:id = \"ND_constant_color3\"\n color3f "
              "inputs:value = (0.8, 0.3, 0.05)\n color3f outputs:out }\n"),
     [](const Translated& t) { return material(t).emissive_color.value; }},
    {"hair", hair("color3f inputs:color = (0.8, 0.3, 0.05)"),
     [](const Translated& t) { return material(t).hair->color.value; }},
    {"light", "def SphereLight \"L\" { color3f inputs:color = (0.8, 0.3, 0.05)\n }\n",
     [](const Translated& t) { return t.scene.lights.at(0).Le; }},
    {"light of a temperature",
     "def SphereLight \"L\" { bool inputs:enableColorTemperature = 1\n float "
     "inputs:colorTemperature = 3000\n float inputs:intensity = 4 }\n",
     [](const Translated& t) { return t.scene.lights.at(0).Le; }},
    {"shadow color",
     "def SphereLight \"L\" (prepend apiSchemas = [\"ShadowAPI\"]) { color3f inputs:shadow:color = "
     "(0.8, 0.3, 0.05) }\n",
     [](const Translated& t) { return t.scene.lights.at(0).links.shadow_color; }},
    {"focus tint",
     "def SphereLight \"L\" (prepend apiSchemas = [\"ShapingAPI\"]) { float inputs:shaping:focus = "
     "2\n color3f inputs:shaping:focusTint = (0.8, 0.3, 0.05) }\n",
     [](const Translated& t) { return t.scene.lights.at(0).shaping.focus_tint; }},
    {"mesh light",
     "def Sphere \"S\" (prepend apiSchemas = [\"MeshLightAPI\"]) { color3f inputs:color = (0.8, "
     "0.3, 0.05) }\n",
     [](const Translated& t) { return t.scene.mesh_lights.at(0).Le; }},
    {"albedo of a volume", volume,
     [](const Translated& t) { return t.scene.volumes.at(0).optics.albedo; }},
    {"emission of a volume", volume,
     [](const Translated& t) { return t.scene.volumes.at(0).optics.emission; }},
    {"a flame that nobody colors",
     "def Volume \"V\" { rel field:density = </V/D>\n def OpenVDBAsset \"D\" { asset filePath = "
     "@none.vdb@\n token fieldName = \"density\" } }\n",
     [](const Translated& t) { return t.scene.volumes.at(0).optics.emission; }},
    {"black body of a volume", volume,
     [](const Translated& t) { return t.scene.volumes.at(0).optics.blackbody_colors.at(20); }},
    {"fallback of a texture",
     preview("color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>",
             "def Shader \"T\" { uniform token info:id = \"UsdUVTexture\"\n float4 inputs:fallback "
             "= (0.8, 0.3, 0.05, 0.5)\n float3 outputs:rgb }\n"),
     [](const Translated& t) {
         const auto& f = t.scene.textures.at(0).fallback;
         EXPECT_EQ(f[3], 0.5f);
         return Rgb(f[0], f[1], f[2]);
     }},
    {"default of an image",
     standard("color3f inputs:base_color.connect = </M/N.outputs:out>",
              "def Shader \"N\" { uniform token info:id = \"ND_image_color3\"\n color3f "
              "inputs:default = (0.8, 0.3, 0.05)\n color3f outputs:out }\n"),
     [](const Translated& t) {
         const auto& f = t.scene.textures.at(0).fallback;
         return Rgb(f[0], f[1], f[2]);
     }},
};

const Door numbers[] = {
    {"vector primvar",
     preview("color3f inputs:diffuseColor.connect = </M/P.outputs:result>",
             "def Shader \"P\" { uniform token info:id = \"UsdPrimvarReader_float3\"\n string "
             "inputs:varname = \"v\"\n float3 outputs:result }\n") +
         "def Sphere \"T\" { rel material:binding = </M>\n vector3f[] primvars:v = [(0.8, 0.3, "
         "0.05)] }\n",
     [](const Translated& t) {
         for (size_t i = 0; i < t.scene.shapes.size(); ++i)
             for (const scene::Primvar& p : t.gprim(i).primvars)
                 if (t.scene.primvar_names.at(p.name) == "v")
                     return Rgb(p.values.at(0), p.values.at(1), p.values.at(2));
         return Rgb(-1.0f);
     }},
    {"normal", preview("normal3f inputs:normal = (0.8, 0.3, 0.05)"),
     [](const Translated& t) { return material(t).normal.value; }},
    {"radius of subsurface scattering",
     preview("color3f inputs:velatura:subsurfaceRadius = (0.8, 0.3, 0.05)\n float "
             "inputs:velatura:subsurface = 1"),
     [](const Translated& t) { return material(t).subsurface_radius.value; }},
    {"radius in MaterialX",
     standard("color3f inputs:subsurface_radius = (0.8, 0.3, 0.05)\n float inputs:subsurface = 1"),
     [](const Translated& t) { return material(t).subsurface_radius.value; }},
    {"roughness", preview("float inputs:roughness = 0.37"),
     [](const Translated& t) { return material(t).roughness.value; }},
    {"absorption of hair", hair("color3f inputs:absorption = (0.8, 0.3, 0.05)"),
     [](const Translated& t) { return material(t).hair->absorption.value; }},
    {"extinction of a volume", volume,
     [](const Translated& t) { return t.scene.volumes.at(0).optics.extinction_color; }},
    {"a channel of a color that is a roughness",
     standard(
         "float inputs:specular_roughness.connect = </M/N.outputs:out>",
         "def Shader \"N\" { uniform token info:id = \"ND_extract_color3\"\n color3f inputs:in "
         "= (0.8, 0.3, 0.05)\n float outputs:out }\n"),
     [](const Translated& t) { return material(t).roughness.value; }},
};

}  // namespace

TEST(WorkingSpace, MatricesAreThoseOfThePrimaries) {
    for (const auto& [name, chart] :
         {std::pair{"acescg", ap1}, std::pair{"lin_rec2020", rec2020}}) {
        const auto space = WorkingSpace::named(name);
        ASSERT_TRUE(space) << name;
        const Matrix m = from_rec709_to(chart);
        for (size_t p = 0; p < 3; ++p) {
            Vec3d primary(0.0);
            primary[int(p)] = 1.0;
            const Vec3d found = space->from_rec709(primary);
            for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(found[int(i)], m[i][p], 1e-12) << name;
        }
        // Its own numbers stay as they are, and so does what is no color
        for (const char* own : {name, "raw", "data"}) {
            const ColorSpace* known = named_color_space(own);
            ASSERT_NE(known, nullptr) << own;
            EXPECT_TRUE(space->from(*known).is_identity()) << own;
        }
    }
    EXPECT_TRUE(WorkingSpace().from(ColorSpace()).is_identity());
}

TEST(WorkingSpace, EveryDoorConvertsColorsOnce) {
    const Matrix m = from_rec709_to(ap1);
    for (const Door& door : colors) {
        const Rgb plain = door.read(In(door.text, "")),
                  named = door.read(In(door.text, "lin_rec709")),
                  converted = door.read(In(door.text, "acescg"));
        EXPECT_EQ(named, plain) << door.name;
        EXPECT_NE(converted, plain) << door.name;
        expect_near(converted, expected(m, plain), door.name);
    }
}

TEST(WorkingSpace, GrayStaysWhatItIs) {
    for (const Door& door : colors) {
        std::string text = door.text;
        for (const char* color : {"(0.8, 0.3, 0.05", "(8, 3, 0.5"}) {
            for (size_t at = 0; (at = text.find(color)) != std::string::npos;)
                text.replace(at, std::string(color).size(), "(0.37, 0.37, 0.37");
        }
        const bool is_gray =
            text != door.text && door.name != std::string("black body of a volume");
        if (!is_gray) continue;
        for (const char* space : {"acescg", "lin_rec2020", "lin_p3d65", "aces2065-1"})
            expect_near(door.read(In(text, space)), door.read(In(text, "")),
                        std::string(door.name) + " " + space);
    }
}

TEST(WorkingSpace, NumbersThatAreNoColorsStay) {
    for (const Door& door : numbers) {
        const Rgb plain = door.read(In(door.text, ""));
        EXPECT_NE(plain, Rgb(-1.0f)) << door.name;
        EXPECT_EQ(door.read(In(door.text, "acescg")), plain) << door.name;
    }
}

TEST(WorkingSpace, ColorsOfTheSpaceItselfAreTakenAsTheyAre) {
    const In t(
        "def SphereLight \"L\" { color3f inputs:color = (0.1, 0.9, 0.2) (colorSpace = "
        "\"ACEScg\") }\n",
        "lin_ap1_scene");
    EXPECT_EQ(t.scene.lights.at(0).Le, Rgb(0.1f, 0.9f, 0.2f));
    EXPECT_EQ(t.count("color-outside-gamut"), 0u);
}

TEST(WorkingSpace, LightsOutsideOfItAreClipped) {
    const In t(
        "def SphereLight \"L\" { color3f inputs:color = (0, 1, 0) (colorSpace = "
        "\"lin_rec2020_scene\") }\n",
        "lin_p3d65");
    EXPECT_EQ(t.scene.lights.at(0).Le.x, 0.0f);
    EXPECT_GT(t.scene.lights.at(0).Le.y, 1.0f);
    EXPECT_EQ(t.count("color-outside-gamut"), 1u);
    EXPECT_NE(t.messages("color-outside-gamut").find("linear P3-D65"), std::string::npos);
}

/// What stands on a texture, and how it is read for a color and for a number.
struct TextureCase {
    const char* inputs;
    scene::SourceColorSpace curve;
    bool is_converted;  ///< where it is a color
};

TEST(WorkingSpace, TexelsAreConvertedWhereTheyAreColors) {
    using Space = scene::SourceColorSpace;
    const TextureCase cases[] = {
        {"", Space::Auto, true},
        {"token inputs:sourceColorSpace = \"auto\"", Space::Auto, true},
        {"token inputs:sourceColorSpace = \"sRGB\"", Space::Srgb, true},
        {"token inputs:sourceColorSpace = \"raw\"", Space::Raw, false},
        {"token inputs:sourceColorSpace = \"ACEScg\"", Space::Raw, false},
        {"token inputs:sourceColorSpace = \"lin_rec709\"", Space::Raw, true}};
    for (const TextureCase& k : cases) {
        for (const bool is_color : {true, false}) {
            const std::string input = is_color ? "color3f inputs:diffuseColor"
                                               : "float inputs:roughness",
                              output = is_color ? "rgb" : "r";
            const std::string text = preview(
                input + ".connect = </M/T.outputs:" + output + ">",
                fmt::format("def Shader \"T\" {{ uniform token info:id = \"UsdUVTexture\"\n "
                            "asset inputs:file = @none.png@\n float2 inputs:st = (0, 0)\n "
                            "{}\n float3 outputs:rgb\n float outputs:r }}\n",
                            k.inputs));
            const In plain(text, ""), t(text, "acescg");
            const scene::TexelColors& colors = t.scene.textures.at(0).colors;
            EXPECT_EQ(colors.curve, k.curve) << k.inputs;
            if (!is_color) {
                EXPECT_EQ(colors.decoding, plain.scene.textures.at(0).colors.decoding) << k.inputs;
                continue;
            }
            EXPECT_EQ(colors.decoding.has_primaries(), k.is_converted) << k.inputs;
            if (k.is_converted) {
                const Vec3d red = colors.decoding(Vec3d(1, 0, 0));
                EXPECT_NEAR(red.x, from_rec709_to(ap1)[0][0], 1e-12) << k.inputs;
            }
        }
    }
}

TEST(WorkingSpace, OneImageCanBeAColorAndANumber) {
    const In t(
        preview("color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>\n float "
                "inputs:roughness.connect = </M/T.outputs:g>",
                "def Shader \"T\" { uniform token info:id = \"UsdUVTexture\"\n asset inputs:file = "
                "@none.png@\n float2 inputs:st = (0, 0)\n float3 outputs:rgb\n float outputs:g "
                "}\n"),
        "acescg");
    ASSERT_EQ(t.scene.textures.size(), 2u);
    const auto colors_of = [&](const scene::Input& input) {
        return t.scene.textures.at(input.texture).colors.decoding;
    };
    EXPECT_TRUE(colors_of(material(t).diffuse_color).has_primaries());
    EXPECT_FALSE(colors_of(material(t).roughness).has_primaries());
}

TEST(WorkingSpace, NormalMapsOfMaterialXAreNumbers) {
    const In t(standard("vector3f inputs:normal.connect = </M/N.outputs:out>\n color3f "
                        "inputs:base_color.connect = </M/C.outputs:out>",
                        "def Shader \"N\" { uniform token info:id = \"ND_normalmap\"\n vector3f "
                        "inputs:in.connect = </M/I.outputs:out>\n vector3f outputs:out }\n"
                        "def Shader \"I\" { uniform token info:id = \"ND_image_color3\"\n asset "
                        "inputs:file = @n.png@\n color3f outputs:out }\n"
                        "def Shader \"C\" { uniform token info:id = \"ND_image_color3\"\n asset "
                        "inputs:file = @c.png@\n color3f outputs:out }\n"),
               "acescg");
    size_t seen = 0;
    for (const scene::Texture& texture : t.scene.textures) {
        ++seen;
        EXPECT_EQ(texture.colors.decoding.has_primaries(), texture.authored == "c.png")
            << texture.authored;
    }
    EXPECT_GE(seen, 2u);
}

TEST(WorkingSpace, ImagesOfLightsAreColors) {
    const char* const dome = "def DomeLight \"D\" { asset inputs:texture:file = @none.exr@ {} }\n";
    for (const bool is_own : {false, true}) {
        std::string text = dome;
        text.replace(text.find("{}"), 2, is_own ? "(colorSpace = \"ACEScg\")" : "");
        const In t(text, "acescg");
        EXPECT_EQ(t.scene.lights.at(0).texture_colors.decoding.has_primaries(), !is_own);
    }
}

TEST(WorkingSpace, PigmentsOfHairLetTheSameColorPass) {
    const Matrix m = from_rec709_to(ap1);
    const auto passed = [](const Rgb& absorption) {
        return Rgb(std::exp(-absorption.x), std::exp(-absorption.y), std::exp(-absorption.z));
    };
    const In plain(hair("float inputs:eumelanin = 1"), ""),
        t(hair("float inputs:eumelanin = 1"), "acescg");
    EXPECT_EQ(material(plain).hair->eumelanin_absorption, scene::Hair().eumelanin_absorption);
    expect_near(passed(material(t).hair->eumelanin_absorption),
                expected(m, passed(scene::Hair().eumelanin_absorption)), "eumelanin");
    expect_near(passed(material(t).hair->pheomelanin_absorption),
                expected(m, passed(scene::Hair().pheomelanin_absorption)), "pheomelanin");
}

TEST(WorkingSpace, IsThatOfTheOptionElseOfTheSettings) {
    const auto settings = [](const char* space) {
        return std::string(
                   "#usda 1.0\n( renderSettingsPrimPath = \"/R\" )\ndef RenderSettings "
                   "\"R\" { uniform token renderingColorSpace = \"") +
               space + "\"; }\n" + camera();
    };

    struct Case {
        const char *authored, *option, *used;
        size_t warnings;
    };

    const Case cases[] = {{"", "", "lin_rec709_scene", 0},
                          {"lin_rec709_scene", "", "lin_rec709_scene", 0},
                          {"lin_ap1_scene", "", "lin_ap1_scene", 0},
                          {"acescg", "", "lin_ap1_scene", 0},
                          {"acescg", "lin_rec2020", "lin_rec2020_scene", 0},
                          {"my_space", "acescg", "lin_ap1_scene", 0},
                          {"my_space", "", "lin_rec709_scene", 1},
                          {"srgb_rec709_scene", "", "lin_rec709_scene", 1},
                          {"lin_ciexyzd65_scene", "", "lin_rec709_scene", 1},
                          {"raw", "", "lin_rec709_scene", 1}};
    for (const Case& k : cases) {
        Translated t;
        TranslateOptions options;
        options.working_space = k.option;
        translate_text(settings(k.authored), t, options);
        EXPECT_EQ(t.scene.settings.working_space, k.used) << k.authored << " " << k.option;
        EXPECT_EQ(t.count("unsupported-color-space"), k.warnings) << k.authored << " " << k.option;
    }
    Translated t;
    TranslateOptions options;
    options.working_space = "srgb_texture";
    translate_text(camera(), t, options);
    EXPECT_EQ(t.error, "unknown-working-space");
    for (const char* name : {"srgb_texture", "lin_ap1_scene (ACEScg)", "lin_rec709_scene"})
        EXPECT_NE(t.error_message.find(name), std::string::npos) << t.error_message;
}

}  // namespace velatura::translate::color
