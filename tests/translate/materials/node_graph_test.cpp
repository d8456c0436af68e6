// SPDX-License-Identifier: Apache-2.0
// Pattern nodes against values worked out by hand from the specification, and what graphs become.
#include "translate/materials/node_graph.h"

#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <string_view>

namespace velatura::translate::materials {
namespace {

using Source = scene::Input::Source;

/// A quad whose material reads `nodes`, the last of which is called "n".
std::string stage_of(const std::string& nodes,
                     const std::string& surface,
                     const std::string& shader = "ND_UsdPreviewSurface_surfaceshader") {
    return quad("Quad",
                "texCoord2f[] primvars:st = [(0,0),(1,0),(1,1),(0,1)] (interpolation = "
                "\"vertex\")\nrel material:binding = </Mat>") +
           camera() +
           fmt::format(R"(
def Material "Mat" {{
    token outputs:mtlx:surface.connect = </Mat/S.outputs:out>
    def Shader "S" {{
        uniform token info:id = "{}"
        {}
        token outputs:out
    }}
    {}
}}
)",
                       shader, surface, nodes);
}

std::string shader(const std::string& name,
                   const std::string& id,
                   const std::string& inputs,
                   const std::string& outputs = "color3f outputs:out") {
    return fmt::format("def Shader \"{}\" {{\nuniform token info:id = \"{}\"\n{}\n{}\n}}\n", name,
                       id, inputs, outputs);
}

/// A color that can be a constant.
struct E {
    constexpr explicit E(float v) : c{v, v, v} {}

    constexpr E(float r, float g, float b) : c{r, g, b} {}

    float c[3];
};

struct NodeCase {
    const char* id;
    const char* inputs;
    E expected;
    const char* output = "out";
};

void expect_value(const NodeCase& k) {
    const std::string type = std::string(k.output) == "out" ? "color3f" : "float";
    Translated t;
    translate_text(
        stage_of(
            shader("n", k.id, k.inputs, fmt::format("{} outputs:{}", type, k.output)),
            fmt::format("color3f inputs:emissiveColor.connect = </Mat/n.outputs:{}>", k.output)),
        t);
    ASSERT_EQ(t.error, "") << t.error_message;
    ASSERT_EQ(t.scene.materials.size(), 1u);
    const scene::Input& e = t.scene.materials[0].emissive_color;
    EXPECT_EQ(e.source, Source::Constant) << k.id;
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(e.value[c], k.expected.c[c], 2e-6f + 2e-6f * std::abs(k.expected.c[c]))
            << k.id << " channel " << c;
    EXPECT_EQ(t.count("unsupported-shader") + t.count("wrong-type"), 0u) << k.id;
}

constexpr NodeCase cases[] = {
    {"ND_constant_color3", "color3f inputs:value = (1, 2, 3)", E(1, 2, 3)},
    {"ND_add_color3", "color3f inputs:in1 = (1, 2, 3)\ncolor3f inputs:in2 = (4, 5, 7)",
     E(5, 7, 10)},
    {"ND_add_color3FA", "color3f inputs:in1 = (1, 2, 3)\nfloat inputs:in2 = 0.5",
     E(1.5f, 2.5f, 3.5f)},
    {"ND_subtract_float", "float inputs:in1 = 1\nfloat inputs:in2 = 0.25", E(0.75f)},
    {"ND_multiply_vector3", "float3 inputs:in1 = (1, 2, 3)\nfloat3 inputs:in2 = (2, 3, -4)",
     E(2, 6, -12)},
    {"ND_multiply_color3", "color3f inputs:in1 = (1, 2, 3)", E(1, 2, 3)},
    {"ND_divide_color3", "color3f inputs:in1 = (1, 2, 3)\ncolor3f inputs:in2 = (2, 4, 0)",
     E(0.5f, 0.5f, 0)},
    {"ND_modulo_float", "float inputs:in1 = -1.25\nfloat inputs:in2 = 1", E(0.75f)},
    {"ND_power_color3FA", "color3f inputs:in1 = (4, 9, 16)\nfloat inputs:in2 = 0.5", E(2, 3, 4)},
    {"ND_min_color3", "color3f inputs:in1 = (1, 5, 3)\ncolor3f inputs:in2 = (2, 4, 3)", E(1, 4, 3)},
    {"ND_max_color3FA", "color3f inputs:in1 = (1, 5, 3)\nfloat inputs:in2 = 2", E(2, 5, 3)},
    {"ND_absval_color3", "color3f inputs:in = (-1, 2, -3)", E(1, 2, 3)},
    {"ND_sign_color3", "color3f inputs:in = (-1, 0, 3)", E(-1, 0, 1)},
    {"ND_floor_color3", "color3f inputs:in = (-1.5, 0.5, 3)", E(-2, 0, 3)},
    {"ND_ceil_color3", "color3f inputs:in = (-1.5, 0.5, 3)", E(-1, 1, 3)},
    {"ND_round_float", "float inputs:in = 2.6", E(3)},
    {"ND_sqrt_float", "float inputs:in = 2.25", E(1.5f)},
    {"ND_exp_float", "float inputs:in = 1", E(2.718281828f)},
    {"ND_ln_float", "float inputs:in = 2.718281828", E(1)},
    {"ND_sin_float", "float inputs:in = 0.5", E(0.479425539f)},
    {"ND_cos_float", "float inputs:in = 0.5", E(0.877582562f)},
    {"ND_tan_float", "float inputs:in = 0.5", E(0.546302490f)},
    {"ND_asin_float", "float inputs:in = 0.5", E(0.523598776f)},
    {"ND_acos_float", "float inputs:in = 0.5", E(1.047197551f)},
    {"ND_atan2_float", "float inputs:iny = 1\nfloat inputs:inx = -1", E(2.356194490f)},
    {"ND_invert_color3", "color3f inputs:in = (0.25, 0, 1)", E(0.75f, 1, 0)},
    {"ND_clamp_color3", "color3f inputs:in = (-1, 0.5, 3)", E(0, 0.5f, 1)},
    {"ND_clamp_color3FA",
     "color3f inputs:in = (-1, 0.5, 3)\nfloat inputs:low = 0.6\nfloat inputs:high = 2",
     E(0.6f, 0.6f, 2)},
    {"ND_smoothstep_float", "float inputs:in = 0.25", E(0.15625f)},
    {"ND_remap_float",
     "float inputs:in = 3\nfloat inputs:inlow = 1\nfloat inputs:inhigh = 5\nfloat inputs:outlow = "
     "10\nfloat inputs:outhigh = 20",
     E(15)},
    {"ND_range_float",
     "float inputs:in = 0.25\nfloat inputs:gamma = 2\nfloat inputs:outhigh = 4\nbool "
     "inputs:doclamp = 1",
     E(2)},
    {"ND_contrast_float",
     "float inputs:in = 0.75\nfloat inputs:amount = 2\nfloat inputs:pivot = 0.5", E(1)},
    {"ND_mix_color3",
     "color3f inputs:bg = (0, 1, 2)\ncolor3f inputs:fg = (4, 5, 6)\nfloat inputs:mix = 0.25",
     E(1, 2, 3)},
    {"ND_mix_color3_color3",
     "color3f inputs:bg = (0, 0, 0)\ncolor3f inputs:fg = (4, 4, 4)\ncolor3f inputs:mix = (0, 0.5, "
     "1)",
     E(0, 2, 4)},
    {"ND_normalize_vector3", "float3 inputs:in = (2, 3, 6)", E(2 / 7.0f, 3 / 7.0f, 6 / 7.0f)},
    {"ND_magnitude_vector2", "float2 inputs:in = (3, 4)", E(5)},
    {"ND_distance_vector3", "float3 inputs:in1 = (1, 1, 1)\nfloat3 inputs:in2 = (3, 4, 7)", E(7)},
    {"ND_dotproduct_vector3", "float3 inputs:in1 = (1, 2, 3)\nfloat3 inputs:in2 = (4, 5, 6)",
     E(32)},
    {"ND_crossproduct_vector3", "float3 inputs:in1 = (1, 0, 0)\nfloat3 inputs:in2 = (0, 1, 0)",
     E(0, 0, 1)},
    {"ND_rotate3d_vector3",
     "float3 inputs:in = (1, 0, 0)\nfloat inputs:amount = 90\nfloat3 inputs:axis = (0, 0, 2)",
     E(0, -1, 0)},
    {"ND_luminance_color3", "color3f inputs:in = (1, 0, 0)", E(0.2722287f)},
    {"ND_saturate_color3", "color3f inputs:in = (1, 0, 0)\nfloat inputs:amount = 0", E(0.2722287f)},
    {"ND_rgbtohsv_color3", "color3f inputs:in = (0.2, 0.8, 0.2)", E(1 / 3.0f, 0.75f, 0.8f)},
    {"ND_hsvtorgb_color3", "color3f inputs:in = (0.33333334, 0.75, 0.8)", E(0.2f, 0.8f, 0.2f)},
    {"ND_hsvadjust_color3",
     "color3f inputs:in = (0.2, 0.8, 0.2)\nfloat3 inputs:amount = (0.33333334, 1, 0.5)",
     E(0.1f, 0.1f, 0.4f)},
    {"ND_extract_color3", "color3f inputs:in = (1, 2, 3)\nint inputs:index = 1", E(2)},
    {"ND_separate3_color3", "color3f inputs:in = (1, 2, 3)", E(3), "outb"},
    {"ND_separate4_vector4", "float4 inputs:in = (1, 2, 3, 4)", E(4), "outw"},
    {"ND_combine3_color3", "float inputs:in1 = 1\nfloat inputs:in2 = 2\nfloat inputs:in3 = 3",
     E(1, 2, 3)},
    {"ND_swizzle_color3_color3", "color3f inputs:in = (1, 2, 3)\nstring inputs:channels = \"b1r\"",
     E(3, 1, 1)},
    {"ND_convert_float_color3", "float inputs:in = 0.4", E(0.4f)},
    {"ND_convert_color4_color3", "color4f inputs:in = (1, 2, 3, 4)", E(1, 2, 3)},
    {"ND_convert_vector2_vector3", "float2 inputs:in = (1, 2)", E(1, 2, 0)},
    {"ND_plus_color3",
     "color3f inputs:fg = (1, 2, 3)\ncolor3f inputs:bg = (1, 1, 1)\nfloat inputs:mix = 0.5",
     E(1.5f, 2, 2.5f)},
    {"ND_minus_color3", "color3f inputs:fg = (1, 2, 3)\ncolor3f inputs:bg = (1, 1, 1)",
     E(0, -1, -2)},
    {"ND_difference_color3", "color3f inputs:fg = (1, 2, 3)\ncolor3f inputs:bg = (2, 2, 2)",
     E(1, 0, 1)},
    {"ND_screen_color3", "color3f inputs:fg = (0.5, 0, 1)\ncolor3f inputs:bg = (0.5, 0.5, 0.5)",
     E(0.75f, 0.5f, 1)},
    {"ND_ifgreater_color3",
     "float inputs:value1 = 2\nfloat inputs:value2 = 1\ncolor3f inputs:in1 = (1, 2, 3)",
     E(1, 2, 3)},
    {"ND_ifgreatereq_float",
     "float inputs:value1 = 1\nfloat inputs:value2 = 1\nfloat inputs:in1 = 5", E(5)},
    {"ND_ifequal_float",
     "float inputs:value1 = 1\nfloat inputs:value2 = 2\nfloat inputs:in1 = 5\nfloat inputs:in2 = 6",
     E(6)},
    {"ND_switch_float",
     "float inputs:in1 = 5\nfloat inputs:in2 = 6\nfloat inputs:in3 = 7\nfloat inputs:which = 1",
     E(6)},
    {"ND_switch_float", "float inputs:in1 = 5\nfloat inputs:in2 = 6\nfloat inputs:which = -0.5",
     E(5)},
    {"ND_switch_float", "float inputs:in1 = 5\nfloat inputs:which = 10", E(0)},
    {"ND_ramplr_color3",
     "color3f inputs:valuel = (0, 0, 0)\ncolor3f inputs:valuer = (1, 2, 4)\nfloat2 inputs:texcoord "
     "= (0.25, 0)",
     E(0.25f, 0.5f, 1)},
    {"ND_ramptb_float",
     "float inputs:valuet = 1\nfloat inputs:valueb = 3\nfloat2 inputs:texcoord = (0, 0.75)",
     E(1.5f)},
    {"ND_ramp4_float",
     "float inputs:valuetl = 1\nfloat inputs:valuetr = 2\nfloat inputs:valuebl = 3\nfloat "
     "inputs:valuebr = 5\nfloat2 inputs:texcoord = (0.5, 0.5)",
     E(2.75f)},
    {"ND_splitlr_float",
     "float inputs:valuel = 1\nfloat inputs:valuer = 2\nfloat inputs:center = 0.3\nfloat2 "
     "inputs:texcoord = (0.4, 0)",
     E(2)},
    {"ND_splittb_float",
     "float inputs:valuet = 1\nfloat inputs:valueb = 2\nfloat2 inputs:texcoord = (0.4, 0.2)", E(2)},
    // Gradient noise is 0 at integer points
    {"ND_noise2d_float",
     "float inputs:amplitude = 3\nfloat inputs:pivot = 0.5\nfloat2 inputs:texcoord = (3, -7)",
     E(0.5f)},
    {"ND_noise3d_color3FA",
     "float inputs:amplitude = 3\nfloat inputs:pivot = 0.25\nfloat3 inputs:position = (3, -7, 12)",
     E(0.25f)},
    {"ND_fractal3d_float", "float inputs:amplitude = 3\nfloat3 inputs:position = (3, -7, 12)",
     E(0)},
};

TEST(NodeGraph, NodesGiveWhatTheSpecificationSays) {
    for (const NodeCase& k : cases) expect_value(k);
}

/// What one channel of a node of constants is.
float number_of(const std::string& id,
                const std::string& type,
                const std::string& inputs,
                int channel) {
    Translated t;
    translate_text(
        stage_of(
            shader("v", id, inputs, type + " outputs:out") +
                shader("n", "ND_extract_" + parse_node_name(id).types.back(),
                       fmt::format(
                           "{} inputs:in.connect = </Mat/v.outputs:out>\nint inputs:index = {}",
                           type, channel),
                       "float outputs:out"),
            "float inputs:roughness.connect = </Mat/n.outputs:out>"),
        t);
    EXPECT_EQ(t.scene.materials.size(), 1u) << t.error_message;
    const scene::Input& r = t.scene.materials.at(0).roughness;
    EXPECT_EQ(r.source, Source::Constant) << id;
    return r.value.x;
}

// As in NG_saturate_color4, NG_convert_vector3_vector4, NG_convert_float_color4 of stdlib_ng.mtlx
TEST(NodeGraph, FourthChannelsAreThoseOfTheLibrary) {
    EXPECT_EQ(number_of("ND_saturate_color4", "color4f",
                        "color4f inputs:in = (1, 0, 0, 0.5)\nfloat inputs:amount = 0", 3),
              0.5f);
    EXPECT_EQ(number_of("ND_luminance_color4", "color4f", "color4f inputs:in = (1, 0, 0, 0.5)", 3),
              0.5f);
    EXPECT_EQ(number_of("ND_convert_vector3_vector4", "float4", "float3 inputs:in = (2, 3, 4)", 3),
              1.0f);
    EXPECT_EQ(number_of("ND_convert_color3_color4", "color4f", "color3f inputs:in = (2, 3, 4)", 3),
              1.0f);
    EXPECT_EQ(number_of("ND_convert_float_color4", "color4f", "float inputs:in = 0.25", 3), 0.25f);
}

// mx_fractal3d_noise_vec2 and _vec4 of MaterialX read one of their channels at (19, 193, 17) from
// the place
TEST(NodeGraph, FractalsOfTwoAndFourReadOneElsewhere) {
    const auto at = [](const char* id, const char* type, const char* place, int channel) {
        return number_of(id, type, fmt::format("float3 inputs:position = {}", place), channel);
    };
    const char *here = "(0.3, 1.7, -2.2)", *there = "(19.3, 194.7, 14.8)";
    const auto one = [&](const char* place) {
        Translated t;
        translate_text(
            stage_of(shader("n", "ND_fractal3d_float",
                            fmt::format("float3 inputs:position = {}", place), "float outputs:out"),
                     "float inputs:roughness.connect = </Mat/n.outputs:out>"),
            t);
        return t.scene.materials.at(0).roughness.value.x;
    };
    EXPECT_EQ(at("ND_fractal3d_vector2", "float2", here, 0), one(here));
    EXPECT_NEAR(at("ND_fractal3d_vector2", "float2", here, 1), one(there), 1e-4f);
    EXPECT_NEAR(at("ND_fractal3d_vector4", "float4", here, 3), one(there), 1e-4f);
    EXPECT_EQ(at("ND_fractal3d_vector4", "float4", here, 1),
              at("ND_fractal3d_vector3", "float3", here, 1));
    EXPECT_GT(std::abs(one(here) - one(there)), 1e-2f);
}

// A new node needs a case here, and a row in docs/reference/materialx.md
TEST(NodeGraph, EveryNodeHasACase) {
    // These read a surface or a file, or pass on what they are given
    const std::set<std::string_view> elsewhere = {
        "image",       "tiledimage", "UsdUVTexture",    "texcoord",  "geompropvalue",
        "geomcolor",   "position",   "normal",          "place2d",   "UsdTransform2d",
        "rotate2d",    "combine2",   "combine4",        "separate2", "cellnoise2d",
        "cellnoise3d", "dot",        "UsdPrimvarReader"};
    std::set<std::string> covered;
    for (const NodeCase& k : cases) covered.insert(parse_node_name(k.id).category);
    for (const std::string_view category : node_categories())
        EXPECT_NE(covered.count(std::string(category)), elsewhere.count(category)) << category;
}

TEST(NodeGraph, ThePageListsTheNodes) {
    std::ifstream in(std::string(VELATURA_SOURCE_DIR) + "/docs/reference/materialx.md");
    const std::string page{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    const size_t start = page.find("| group | nodes |"), end = page.find("\n\n", start);
    ASSERT_NE(end, std::string::npos);
    std::set<std::string> listed;
    for (size_t at = page.find('`', start); at < end; at = page.find('`', at + 1)) {
        const size_t close = page.find('`', at + 1);
        listed.insert(page.substr(at + 1, close - at - 1));
        at = close;
    }
    std::set<std::string> made;
    for (const std::string_view category : node_categories()) made.emplace(category);
    EXPECT_EQ(listed, made);
}

TEST(NodeGraph, NamesAreTakenApart) {
    EXPECT_EQ(parse_node_name("ND_multiply_color3FA").category, "multiply");
    EXPECT_EQ(parse_node_name("ND_mix_color3_color3").types.size(), 2u);
    EXPECT_EQ(parse_node_name("ND_UsdPrimvarReader_float2").types[0], "float2");
    EXPECT_EQ(parse_node_name("ND_unknown_thing").category, "unknown");
    EXPECT_EQ(width_of_type("color3FA"), 3);
    EXPECT_EQ(width_of_type("float"), 1);
    EXPECT_EQ(width_of_type("float2"), 2);
    EXPECT_EQ(width_of_type("vector4"), 4);
    EXPECT_EQ(width_of_type("integer"), 1);
    EXPECT_EQ(width_of_type("surfaceshader"), 0);
}

std::string image(const std::string& name, const std::string& extra = "") {
    return shader(name, "ND_image_color3",
                  "asset inputs:file = @none.png@ (colorSpace = \"srgb_texture\")\n" + extra);
}

// 1·x + 0 of an image is the image: it takes the way that UsdPreviewSurface takes
TEST(NodeGraph, WhatComesDownToATextureIsOne) {
    Translated t;
    translate_text(
        stage_of(
            image("p") +
                shader("one", "ND_multiply_color3",
                       "color3f inputs:in1.connect = </Mat/p.outputs:out>\ncolor3f inputs:in2 = "
                       "(1, 1, 1)") +
                shader("n", "ND_add_color3FA",
                       "color3f inputs:in1.connect = </Mat/one.outputs:out>\nfloat inputs:in2 = 0"),
            "color3f inputs:diffuseColor.connect = </Mat/n.outputs:out>"),
        t);
    ASSERT_EQ(t.scene.materials.size(), 1u) << t.error_message;
    const scene::Input& d = t.scene.materials[0].diffuse_color;
    EXPECT_EQ(d.source, Source::Texture);
    EXPECT_TRUE(t.scene.patterns.empty());
    const scene::Texture& texture = t.scene.textures[d.texture];
    EXPECT_EQ(texture.colors.curve, scene::SourceColorSpace::Srgb);
    EXPECT_EQ(texture.wrap_s, scene::Wrap::Repeat);
    EXPECT_EQ(t.scene.primvar_names[texture.st], "st");
    EXPECT_EQ(texture.st_matrix, (std::array<float, 4>{1, 0, 0, 1}));
}

/// ND_UsdUVTexture of usd_preview_surface.mtlx: st is UV0, wrapS and wrapT periodic, and what has
/// no color space is taken as it is. USD's own node of that name reads (0, 0), useMetadata and
/// auto.
TEST(NodeGraph, NodesThatShareANameHaveTheirOwnDefaults) {
    const auto texture_of = [](const std::string& id, const std::string& inputs) {
        Translated t;
        translate_text(stage_of(shader("n", id, "asset inputs:file = @none.png@\n" + inputs,
                                       "color3f outputs:rgb"),
                                "color3f inputs:diffuseColor.connect = </Mat/n.outputs:rgb>"),
                       t);
        EXPECT_EQ(t.scene.textures.size(), 1u) << id << inputs;
        return t.scene.textures.empty() ? scene::Texture() : t.scene.textures[0];
    };
    for (const char* id : {"ND_UsdUVTexture_23", "ND_UsdUVTexture"}) {
        const scene::Texture x = texture_of(id, "");
        EXPECT_EQ(x.wrap_s, scene::Wrap::Repeat) << id;
        EXPECT_EQ(x.wrap_t, scene::Wrap::Repeat) << id;
        EXPECT_NE(x.st, scene::none) << id;
        EXPECT_EQ(x.colors.curve, scene::SourceColorSpace::Raw) << id;
    }
    const scene::Texture usd = texture_of("UsdUVTexture", "");
    EXPECT_EQ(usd.wrap_s, scene::Wrap::UseMetadata);
    EXPECT_EQ(usd.st, scene::none);
    EXPECT_EQ(usd.colors.curve, scene::SourceColorSpace::Auto);
    const std::pair<const char*, scene::Wrap> modes[] = {{"constant", scene::Wrap::Black},
                                                         {"black", scene::Wrap::Black},
                                                         {"clamp", scene::Wrap::Clamp},
                                                         {"periodic", scene::Wrap::Repeat},
                                                         {"repeat", scene::Wrap::Repeat},
                                                         {"mirror", scene::Wrap::Mirror},
                                                         {"useMetadata", scene::Wrap::UseMetadata}};
    for (const auto& [name, wrap] : modes) {
        const scene::Texture x =
            texture_of("ND_UsdUVTexture_23", fmt::format("string inputs:wrapS = \"{}\"", name));
        EXPECT_EQ(x.wrap_s, wrap) << name;
        EXPECT_EQ(x.wrap_t, scene::Wrap::Repeat) << name;
    }
    const scene::Texture marked =
        texture_of("ND_UsdUVTexture_23",
                   "token inputs:sourceColorSpace = \"sRGB\"\nfloat2 inputs:st = (2, 3)");
    EXPECT_EQ(marked.colors.curve, scene::SourceColorSpace::Srgb);
    EXPECT_EQ(marked.st, scene::none);
    EXPECT_EQ(marked.st_constant, Vec2(2.0f, 3.0f));
}

TEST(NodeGraph, PlacesOfImagesAreOneMatrix) {
    Translated t;
    translate_text(
        stage_of(shader("place", "ND_place2d_vector2",
                        "float2 inputs:pivot = (0.5, 0.5)\nfloat2 inputs:scale = (2, 4)\nfloat "
                        "inputs:rotate = 90\nfloat2 inputs:offset = (0.1, 0.2)",
                        "float2 outputs:out") +
                     image("n", "float2 inputs:texcoord.connect = </Mat/place.outputs:out>"),
                 "color3f inputs:diffuseColor.connect = </Mat/n.outputs:out>"),
        t);
    ASSERT_EQ(t.scene.materials.size(), 1u) << t.error_message;
    const scene::Input& d = t.scene.materials[0].diffuse_color;
    ASSERT_EQ(d.source, Source::Texture);
    const scene::Texture& x = t.scene.textures[d.texture];
    // By hand for st = (0.7, 0.1): less the pivot (0.2, -0.4), over the scale (0.1, -0.1),
    // clockwise by 90 degrees (-0.1, -0.1), less the offset (-0.2, -0.3), and the pivot again:
    // (0.3, 0.2)
    const float s = 0.7f, v = 0.1f;
    EXPECT_NEAR(s * x.st_matrix[0] + v * x.st_matrix[2] + x.st_offset.x, 0.3f, 1e-6f);
    EXPECT_NEAR(s * x.st_matrix[1] + v * x.st_matrix[3] + x.st_offset.y, 0.2f, 1e-6f);
}

TEST(NodeGraph, NormalMapsAreDecodedByTheirTexture) {
    Translated t;
    translate_text(
        stage_of(
            shader("image", "ND_image_vector3",
                   "asset inputs:file = @none.png@ (colorSpace = \"srgb_texture\")",
                   "float3 outputs:out") +
                shader(
                    "n", "ND_normalmap",
                    "float3 inputs:in.connect = </Mat/image.outputs:out>\nfloat inputs:scale = 0.5",
                    "float3 outputs:out"),
            "float3 inputs:normal.connect = </Mat/n.outputs:out>",
            "ND_standard_surface_surfaceshader"),
        t);
    ASSERT_EQ(t.scene.materials.size(), 1u) << t.error_message;
    const scene::Input& n = t.scene.materials[0].normal;
    ASSERT_EQ(n.source, Source::Texture);
    const scene::Texture& x = t.scene.textures[n.texture];
    EXPECT_EQ(x.colors.curve, scene::SourceColorSpace::Raw) << "vectors have no color space";
    EXPECT_EQ(x.scale[0], 1.0f);
    EXPECT_EQ(x.bias[1], -0.5f);
    EXPECT_EQ(x.scale[2], 2.0f);
    EXPECT_EQ(x.bias[2], -1.0f);
}

TEST(NodeGraph, WhatCannotBeReadIsNamedAndKeepsItsDefault) {
    Translated t;
    translate_text(
        stage_of(
            shader("n", "ND_blur_color3", "") +
                shader("m", "ND_add_vector2", "float2 inputs:in1 = (1, 2)", "float2 outputs:out") +
                shader("a", "ND_add_color3", "color3f inputs:in1.connect = </Mat/b.outputs:out>") +
                shader("b", "ND_add_color3", "color3f inputs:in1.connect = </Mat/a.outputs:out>"),
            "color3f inputs:diffuseColor.connect = </Mat/n.outputs:out>\n"
            "color3f inputs:emissiveColor.connect = </Mat/m.outputs:out>\n"
            "color3f inputs:specularColor.connect = </Mat/a.outputs:out>\nfloat inputs:extra = 1"),
        t);
    ASSERT_EQ(t.scene.materials.size(), 1u) << t.error_message;
    EXPECT_EQ(t.scene.materials[0].diffuse_color.value, Rgb(0.18f));
    EXPECT_EQ(t.scene.materials[0].emissive_color.value, Rgb(0.0f));
    EXPECT_EQ(t.count("unsupported-shader"), 1u);
    EXPECT_EQ(t.count("wrong-type"), 1u);
    EXPECT_EQ(t.count("connection-cycle"), 1u);
    EXPECT_EQ(t.count("unknown-shader-input"), 1u);
}

TEST(NodeGraph, GraphsThatAreTooLargeAreRefused) {
    std::string nodes = shader("n0", "ND_texcoord_vector2", "", "float2 outputs:out");
    nodes += shader("x0", "ND_extract_vector2", "float2 inputs:in.connect = </Mat/n0.outputs:out>",
                    "float outputs:out");
    for (int i = 1; i < 100; ++i)
        nodes +=
            shader(fmt::format("x{}", i), "ND_range_float",
                   fmt::format("float inputs:in.connect = </Mat/x{0}.outputs:out>\nfloat "
                               "inputs:inlow.connect = </Mat/x{1}.outputs:out>\nfloat inputs:gamma "
                               "= {2}.5\nfloat inputs:outlow = {2}\nfloat inputs:outhigh = 99.5",
                               i - 1, i / 2, i),
                   "float outputs:out");
    Translated t;
    translate_text(stage_of(nodes, "float inputs:roughness.connect = </Mat/x99.outputs:out>"), t);
    ASSERT_EQ(t.scene.materials.size(), 1u) << t.error_message;
    EXPECT_EQ(t.count("pattern-too-large"), 1u);
    EXPECT_EQ(t.scene.materials[0].roughness.source, Source::Constant);
    EXPECT_EQ(t.scene.materials[0].roughness.value.x, 0.5f);
}

// More steps than a Port can name: nothing of the material is half a graph
TEST(NodeGraph, WhatHasNoEndOfStepsIsRefusedWhole) {
    scene::Scene scene;
    PatternBuilder builder(scene);
    const Port x = builder.position(true);
    Port sum = x;
    for (int i = 1; i < 40000; ++i)
        sum = builder.add(builder.multiply(x, builder.constant(float(i))), sum);
    EXPECT_FALSE(builder.input(sum, Rgb(0.5f)).has_value());
    EXPECT_FALSE(
        builder.input(builder.multiply(x, builder.constant(-1.0f)), Rgb(0.5f)).has_value());
}

TEST(NodeGraph, ColorsAreBroughtIntoTheWorkingSpace) {
    Translated t;
    translate_text(
        stage_of("",
                 "color3f inputs:diffuseColor = (0.5, 0.5, 0.5) (colorSpace = \"srgb_texture\")\n"
                 "color3f inputs:emissiveColor = (1, 1, 1) (colorSpace = \"acescg\")\n"
                 "color3f inputs:specularColor = (0.5, 1, 0) (colorSpace = \"gamma22\")"),
        t);
    ASSERT_EQ(t.scene.materials.size(), 1u) << t.error_message;
    const scene::Material& m = t.scene.materials[0];
    EXPECT_NEAR(m.diffuse_color.value.x, 0.21404114f, 1e-6f);
    // White stays white
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(m.emissive_color.value[c], 1.0f, 1e-5f);
    EXPECT_NEAR(m.specular_color.value.x, 0.21763764f, 1e-6f);
    EXPECT_NEAR(m.specular_color.value.y, 1.0f, 1e-6f);
}

}  // namespace
}  // namespace velatura::translate::materials
