// SPDX-License-Identifier: Apache-2.0
// --working-space: a color chart through every door of a file, a furnace, and what commands make of
// the files. ACEScg of linear Rec.709 is by the matrix of OpenColorIO's built-in transforms, which
// tests/translate/color/working_space_test.cpp derives from the primaries.
#include "image/formats.h"
#include "rendered_image.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>

namespace velatura::test {

namespace {

using Color = std::array<double, 3>;

/// ACEScg of linear Rec.709, whites adapted by Bradford.
Color in_acescg(const Color& c) {
    constexpr double m[3][3] = {{0.613097396, 0.339523147, 0.047379456},
                                {0.070193732, 0.916353911, 0.013452357},
                                {0.020615609, 0.109569795, 0.869814635}};
    Color out{};
    for (size_t i = 0; i < 3; ++i)
        for (size_t k = 0; k < 3; ++k) out[i] += m[i][k] * c[k];
    return out;
}

double from_srgb(double code) {
    const double v = code / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

const std::string head = R"usda(#usda 1.0
def Camera "Cam"
{
    float focalLength = 21
    float horizontalAperture = 21
    float verticalAperture = 6
    double3 xformOp:translate = (0, 0, 7)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)usda";

/// Square i of seven that fill the image from left to right, with a gap above and below.
std::string square(int i, const std::string& inside) {
    return fmt::format(R"(def Mesh "Square{0}" {{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [({1}, -0.5, 0), ({2}, -0.5, 0), ({2}, 0.5, 0), ({1}, 0.5, 0)]
    uniform token subdivisionScheme = "none"
    {3}
}}
)",
                       i, i - 3.5, i - 2.5, inside);
}

std::string material(int i,
                     const std::string& output,
                     const std::string& shader,
                     const std::string& rest = "") {
    return fmt::format(
        "def Material \"M{0}\" {{\n token outputs:{1}.connect = </M{0}/S.outputs:out>\n def Shader "
        "\"S\" {{\n {2}\n token outputs:out\n }}\n {3} }}\n",
        i, output, shader, rest);
}

std::string light(int i, const std::string& inside) {
    return fmt::format(
        "def RectLight \"Light{0}\" {{\n double3 xformOp:translate = ({1}, 0, 0)\n double "
        "xformOp:rotateY = 180\n uniform token[] xformOpOrder = [\"xformOp:translate\", "
        "\"xformOp:rotateY\"]\n {2}\n}}\n",
        i, i - 3, inside);
}

/// What each door of a scene gives to the eye without any scattering.
std::string chart() {
    const std::string preview =
        "uniform token info:id = \"UsdPreviewSurface\"\n color3f "
        "inputs:diffuseColor = (0, 0, 0)\n ";
    std::string text = head;
    for (int i = 0; i < 4; ++i)
        text += square(i, fmt::format("rel material:binding = </M{}>\n color3f[] "
                                      "primvars:displayColor = [(0.05, 0.4, 0.7)]",
                                      i));
    text += material(0, "surface", preview + "color3f inputs:emissiveColor = (0.8, 0.3, 0.05)");
    text += material(1, "surface",
                     preview + "color3f inputs:emissiveColor.connect = </M1/T.outputs:rgb>",
                     "def Shader \"T\" { uniform token info:id = \"UsdUVTexture\"\n asset "
                     "inputs:file = @orange.ppm@\n float2 inputs:st = (0.5, 0.5)\n token "
                     "inputs:wrapS = \"repeat\"\n token inputs:wrapT = \"repeat\"\n float3 "
                     "outputs:rgb }\n");
    text += material(2, "surface",
                     preview + "color3f inputs:emissiveColor.connect = </M2/P.outputs:result>",
                     "def Shader \"P\" { uniform token info:id = \"UsdPrimvarReader_float3\"\n "
                     "string inputs:varname = \"displayColor\"\n float3 outputs:result }\n");
    text += material(3, "mtlx:surface",
                     "uniform token info:id = \"ND_standard_surface_surfaceshader\"\n float "
                     "inputs:base = 0\n float inputs:emission = 1\n color3f "
                     "inputs:emission_color.connect = </M3/I.outputs:out>",
                     "def Shader \"I\" { uniform token info:id = \"ND_image_color3\"\n asset "
                     "inputs:file = @orange.ppm@ (colorSpace = \"srgb_texture\")\n color3f "
                     "outputs:out }\n");
    text += light(4, "color3f inputs:color = (0.2, 0.6, 0.9)");
    text += light(5,
                  "bool inputs:enableColorTemperature = 1\n float inputs:colorTemperature = "
                  "3000");
    text += light(6, "asset inputs:texture:file = @orange.ppm@");
    text +=
        "def DomeLight \"Sky\" { asset inputs:texture:file = @orange.ppm@\n color3f "
        "inputs:color = (0.5, 1, 0.25) }\n";
    return text;
}

constexpr const char* direct =
    " --res 70x20 --spp 4 --layers bounce --bounces 1 --max-depth 1 --float-layers --adaptive off "
    "--guiding off --splitting off --caustics path --filter box --progress none -q";

class WorkingSpaceCommands : public testing::Test {
  protected:
    image::Image render(const std::string& scene,
                        const std::string& arguments,
                        const std::string& file = "out.exr") {
        write_scene(scene);
        const CommandResult r = w.velatura("render s.usda -o " + file + arguments);
        EXPECT_EQ(r.exit_code, 0) << r.output;
        return read_image(w, file);
    }

    void write_scene(std::string text) {
        // A statement ends with its line
        for (size_t at = 0; (at = text.find(" }", at)) != std::string::npos;) text[at] = '\n';
        w.write("s.usda", text);
    }

    void write_orange() {
        w.write("orange.ppm", "P3\n2 2\n255\n200 100 20\n200 100 20\n200 100 20\n200 100 20\n");
    }

    std::string bytes(const std::string& file) {
        std::stringstream text;
        text << std::ifstream(w.path(file), std::ios::binary).rdbuf();
        return text.str();
    }

    Workplace w;
};

Color pixel(const image::Image& image, const std::string& layer, size_t i) {
    return {value(image, layer + ".R", i), value(image, layer + ".G", i),
            value(image, layer + ".B", i)};
}

void expect_near(const Color& found,
                 const Color& expected,
                 double tolerance,
                 const std::string& what) {
    for (size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(found[c], expected[c], tolerance * std::max(1e-3, expected[c]))
            << what << ", channel " << c;
}

/// Pixel in the middle of square i.
size_t middle(int i) {
    return 10 * 70 + size_t(10 * i + 5);
}

}  // namespace

TEST_F(WorkingSpaceCommands, EveryDoorShowsTheConvertedColor) {
    write_orange();
    const image::Image plain = render(chart(), direct),
                       aces = render(chart(), std::string(direct) + " --working-space acescg"),
                       named = render(chart(), std::string(direct) + " --working-space lin_rec709",
                                      "named.exr");
    EXPECT_EQ(w.hash("named.exr"), [&] {
        render(chart(), direct, "plain.exr");
        return w.hash("plain.exr");
    }());
    const Color orange = {from_srgb(200), from_srgb(100), from_srgb(20)};
    const Color known[] = {{0.8, 0.3, 0.05}, orange, {0.05, 0.4, 0.7}, orange, {0.2, 0.6, 0.9}};
    // Texels are halves; lights hide nothing, and the dome is behind them
    const auto tolerance = [](int i) { return i % 2 == 1 ? 1e-3 : 1e-5; };
    const auto in_front = [](const image::Image& image, int i) {
        Color color = pixel(image, "b0", middle(i));
        const Color behind = pixel(image, "b0", 5);
        for (size_t c = 0; i >= 4 && c < 3; ++c) color[c] -= behind[c];
        return color;
    };
    for (int i = 0; i < 5; ++i) {
        expect_near(in_front(plain, i), known[i], tolerance(i), fmt::format("square {}", i));
        expect_near(in_front(aces, i), in_acescg(known[i]), tolerance(i),
                    fmt::format("square {} in ACEScg", i));
    }
    expect_near(in_front(plain, 6), orange, 1e-3, "texture of a light");
    expect_near(in_front(aces, 6), in_acescg(orange), 1e-3, "texture of a light in ACEScg");
    // The product of two colors is that of the working space
    const Color sky = in_acescg(orange), tint = in_acescg({0.5, 1, 0.25});
    expect_near(pixel(aces, "b0", 5), {sky[0] * tint[0], sky[1] * tint[1], sky[2] * tint[2]}, 1e-3,
                "dome");
    for (size_t i = 0; i < 70 * 20; ++i) {
        const bool is_surface =
            i / 70 > 5 && i / 70 < 14 && i % 70 < 40 && i % 10 > 0 && i % 10 < 9;
        if (is_surface)
            expect_near(pixel(aces, "b0", i), in_acescg(pixel(plain, "b0", i)), 1e-3,
                        fmt::format("pixel {}", i));
    }
}

TEST_F(WorkingSpaceCommands, AChartOfPaintInAWhiteFurnace) {
    constexpr Color paints[] = {{0.4, 0.1, 0.05},  {0.7, 0.4, 0.3}, {0.1, 0.2, 0.4},
                                {0.1, 0.15, 0.05}, {0.2, 0.2, 0.5}, {0.9, 0.8, 0.1},
                                {0.5, 0.5, 0.5}};
    std::string scene = head + "def DomeLight \"Sky\" {}\n";
    for (int i = 0; i < 7; ++i)
        scene += square(i, fmt::format("color3f[] primvars:displayColor = [({}, {}, {})]",
                                       paints[i][0], paints[i][1], paints[i][2]));
    const image::Image plain = render(scene, direct),
                       aces = render(scene, std::string(direct) + " --working-space acescg");
    for (int i = 0; i < 7; ++i) {
        // Nothing hides the sky: radiance is the albedo, times a sum that the samples make of 1
        const Color seen = pixel(plain, "b1", middle(i));
        const double one = seen[1] / paints[i][1];
        EXPECT_NEAR(one, 1.0, 0.1) << i;
        Color expected = in_acescg(paints[i]);
        for (double& v : expected) v *= one;
        expect_near(pixel(aces, "b1", middle(i)), expected, 1e-5, fmt::format("paint {}", i));
        expect_near(pixel(aces, "b1", middle(i)), in_acescg(seen), 1e-5,
                    fmt::format("paint {}", i));
    }
    expect_near(pixel(aces, "b0", 5), {1, 1, 1}, 1e-6, "a white sky is white");
}

// Mirrors of thin films under a white sky: of colors that both spaces hold, one is the matrix of
// the other
TEST_F(WorkingSpaceCommands, ThinFilmsHaveOneColorInEverySpace) {
    std::string scene = head + "def DomeLight \"Sky\" {}\n";
    constexpr int thickness[] = {80, 160, 240, 300, 420, 560, 900};
    for (int i = 0; i < 7; ++i) {
        scene += square(i, fmt::format("rel material:binding = </M{}>", i));
        scene += material(
            i, "mtlx:surface",
            fmt::format("uniform token info:id = \"ND_standard_surface_surfaceshader\"\n float "
                        "inputs:base = 0\n float inputs:specular_roughness = 0\n float "
                        "inputs:thin_film_thickness = {}\n float inputs:thin_film_IOR = 2.2",
                        thickness[i]));
    }
    const image::Image plain = render(scene, direct),
                       aces = render(scene, std::string(direct) + " --working-space acescg");
    double most = 0;
    for (int i = 0; i < 7; ++i) {
        const Color seen = pixel(plain, "b1", middle(i));
        most = std::max(most, std::abs(seen[0] - seen[2]));
        expect_near(pixel(aces, "b1", middle(i)), in_acescg(seen), 1e-4,
                    fmt::format("film of {} nm", thickness[i]));
    }
    EXPECT_GT(most, 0.05) << "no colors";
    const CommandResult r = w.velatura("render s.usda -o out.exr --working-space acescg --strict" +
                                       std::string(direct));
    EXPECT_EQ(r.exit_code, 0) << r.output;
}

TEST_F(WorkingSpaceCommands, GrayScenesAndLinearOnesAgree) {
    // An open box of gray walls, in which light is reflected many times
    std::string gray = head;
    for (const auto& [name, at] :
         {std::pair{"Back", "(0, 0, -3)"}, std::pair{"Left", "(-2.2, 0, -1)"},
          std::pair{"Right", "(2.2, 0, -1)"}, std::pair{"Floor", "(0, -1.8, -1)"}})
        gray += fmt::format(
            "def Cube \"{}\" {{ double size = 2\n color3f[] primvars:displayColor = [(0.6, 0.6, "
            "0.6)]\n double3 xformOp:translate = {}\n uniform token[] xformOpOrder = "
            "[\"xformOp:translate\"] }}\n",
            name, at);
    const auto lit = [&](const char* color) {
        return gray +
               "def SphereLight \"Bulb\" { float inputs:radius = 0.3\n float "
               "inputs:intensity = 5\n color3f inputs:color = " +
               color +
               "\n double3 xformOp:translate = (0, 0.7, -0.6)\n uniform token[] xformOpOrder = "
               "[\"xformOp:translate\"] }\n";
    };
    const std::string arguments =
        " --res 35x10 --spp 64 --layers bounce --bounces 2 --float-layers --progress none -q "
        "--adaptive off";
    const image::Image plain = render(lit("(0.7, 0.7, 0.7)"), arguments),
                       aces = render(lit("(0.7, 0.7, 0.7)"), arguments + " --working-space acescg");
    double sum = 0;
    for (size_t i = 0; i < 35 * 10; ++i) {
        for (const char* layer : {"b0", "b1", "b2", "tail"})
            expect_near(pixel(aces, layer, i), pixel(plain, layer, i), 1e-5,
                        fmt::format("{} of gray pixel {}", layer, i));
        sum += value(plain, "tail.G", i);
    }
    EXPECT_GT(sum, 0.0);
    // A color of the light scales all of it: whatever luminance decides, the mean is that of the
    // matrix
    const image::Image warm = render(lit("(1, 0.3, 0.02)"), arguments),
                       warm_aces =
                           render(lit("(1, 0.3, 0.02)"), arguments + " --working-space acescg");
    for (const char* layer : {"b1", "b2", "tail"}) {
        Color mean{}, mean_aces{};
        for (size_t i = 0; i < 35 * 10; ++i) {
            const Color a = pixel(warm, layer, i), b = pixel(warm_aces, layer, i);
            for (size_t c = 0; c < 3; ++c) mean[c] += a[c], mean_aces[c] += b[c];
        }
        expect_near(mean_aces, in_acescg(mean), layer == std::string("tail") ? 0.03 : 0.01, layer);
    }
}

TEST_F(WorkingSpaceCommands, FilesSayWhatTheyHold) {
    write_orange();

    struct Case {
        const char *option, *id;
        image::Chromaticities primaries;
    };

    const Case cases[] = {
        {"", "lin_rec709_scene", {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f}},
        {" --working-space acescg",
         "lin_ap1_scene",
         {0.713f, 0.293f, 0.165f, 0.830f, 0.128f, 0.044f, 0.32168f, 0.33767f}},
        {" --working-space 'Linear Rec.2020'",
         "lin_rec2020_scene",
         {0.708f, 0.292f, 0.170f, 0.797f, 0.131f, 0.046f, 0.3127f, 0.3290f}}};
    for (const Case& k : cases) {
        const image::Image image = render(chart(), std::string(direct) + k.option);
        EXPECT_EQ(image.text("colorInteropID"), k.id);
        EXPECT_EQ(std::get<image::Chromaticities>(image.attributes.at("chromaticities")),
                  k.primaries);
        EXPECT_EQ(w.comp("verify out.exr").exit_code, 0);
    }
}

TEST_F(WorkingSpaceCommands, TheMixedPictureIsTheSame) {
    std::string scene = head + "def DomeLight \"Sky\" {}\n";
    for (int i = 0; i < 7; ++i)
        scene += square(i, fmt::format("color3f[] primvars:displayColor = [({}, {}, {})]",
                                       0.1 + 0.1 * i, 0.7 - 0.1 * i, 0.05 * i));
    for (const auto& [file, option] :
         {std::pair{"plain", ""}, std::pair{"aces", " --working-space acescg"},
          std::pair{"wide", " --working-space lin_rec2020"}}) {
        render(scene, std::string(direct) + " --layers bounce,light" + option,
               std::string(file) + ".exr");
        const CommandResult r = w.comp(fmt::format("mix {0}.exr -o {0}.png --gain Sky=1.25", file));
        EXPECT_EQ(r.exit_code, 0) << r.output;
    }
    const auto shown = [&](const std::string& name) {
        return image::read_rgb_image(w.path(name + ".png"), image::SourceColorSpace::Raw);
    };
    const auto plain = shown("plain");
    ASSERT_TRUE(plain);
    const auto [darkest, brightest] =
        std::minmax_element(plain->pixels.begin(), plain->pixels.end());
    EXPECT_GT(*brightest - *darkest, 0.4f);
    for (const char* other : {"aces", "wide"}) {
        const auto image = shown(other);
        ASSERT_TRUE(image) << other;
        ASSERT_EQ(image->pixels.size(), plain->pixels.size());
        // A step of 8 bits, and what a display rounds
        for (size_t i = 0; i < plain->pixels.size(); ++i)
            EXPECT_NEAR(image->pixels[i], plain->pixels[i], 1.5f / 255) << other << " " << i;
    }
}

TEST_F(WorkingSpaceCommands, FilesOfTwoSpacesAreNotPartsOfOneRender) {
    write_orange();
    const std::string common = " --res 16x8 --layers bounce --progress none -q --resumable";
    render(chart(), common + " --samples 0:2", "a.exr");
    render(chart(), common + " --samples 2:4 --working-space acescg", "b.exr");
    const CommandResult merged = w.comp("merge a.exr b.exr -o all.exr");
    EXPECT_EQ(merged.exit_code, 5);
    EXPECT_NE(merged.output.find("--working-space lin_rec709_scene and lin_ap1_scene"),
              std::string::npos)
        << merged.output;
    const CommandResult resumed =
        w.velatura("render s.usda -o a.exr" + common + " --resume --spp 8 --working-space acescg");
    EXPECT_EQ(resumed.exit_code, 5) << resumed.output;
    EXPECT_NE(resumed.output.find("--working-space"), std::string::npos) << resumed.output;
}

TEST_F(WorkingSpaceCommands, UnknownSpacesAreRefusedWithAList) {
    write_orange();
    write_scene(chart());
    for (const char* name : {"my_camera_log", "srgb_texture", "raw"}) {
        const CommandResult r =
            w.velatura(fmt::format("render s.usda -o o.exr --spp 1 --working-space {}", name));
        EXPECT_EQ(r.exit_code, 2) << r.output;
        EXPECT_NE(r.output.find("lin_ap1_scene (ACEScg)"), std::string::npos) << r.output;
        EXPECT_FALSE(w.exists("o.exr"));
    }
}

TEST_F(WorkingSpaceCommands, BakedLightsHaveTheColorOfTheMix) {
    std::string scene = head;
    scene += square(3, "color3f[] primvars:displayColor = [(0.5, 0.5, 0.5)]");
    scene += "def DomeLight \"Sky\" { color3f inputs:color = (0.9, 0.6, 0.3) }\n";
    const std::string aces = " --working-space acescg";
    render(scene, direct + aces, "a.exr");
    const CommandResult baked = w.comp("bake a.exr --tint Sky=0.5,1,2 -o baked.usda");
    ASSERT_EQ(baked.exit_code, 0) << baked.output;
    EXPECT_NE(bytes("baked.usda").find("colorSpace = \"lin_ap1_scene\""), std::string::npos)
        << bytes("baked.usda");
    const CommandResult again =
        w.velatura("render s.usda --session baked.usda -o b.exr" + (direct + aces));
    ASSERT_EQ(again.exit_code, 0) << again.output;
    const image::Image before = read_image(w, "a.exr"), after = read_image(w, "b.exr");
    for (const size_t i : {size_t(5), middle(3)}) {
        const char* layer = i == 5 ? "b0" : "b1";
        const Color c = pixel(before, layer, i);
        expect_near(pixel(after, layer, i), {0.5 * c[0], c[1], 2 * c[2]}, 1e-5, layer);
    }
}

}  // namespace velatura::test
