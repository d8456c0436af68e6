// SPDX-License-Identifier: Apache-2.0
// Visibility to kinds of rays from USD to the film: everything visible is nothing authored, what
// no ray sees is not there, bit for bit; and a scene with it is one image however it is made.
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>
#include <string>

namespace velatura::test {

namespace {

constexpr int width = 20, height = 16;

integrator::RenderOptions options_of(uint64_t samples) {
    integrator::RenderOptions options;
    options.end_sample = samples;
    options.seed = 3;
    options.tile_size = 16;
    return options;
}

scene::Scene scene_of(const std::string& text) {
    return scene_from_usda(text, width, height);
}

uint64_t print_of(const std::string& text) {
    return fingerprint(render_scene(scene_of(text), options_of(8)));
}

/// The room with lines in the body of a prim of it.
std::string room_with(const std::string& prim, const std::string& lines) {
    std::string text = room_usda();
    const size_t at = text.find("\"" + prim + "\"");
    EXPECT_NE(at, std::string::npos) << prim;
    text.insert(text.find('{', at) + 1, "\n" + lines + "\n");
    return text;
}

/// The room with more in its root.
std::string room_and(const std::string& prims) {
    std::string text = room_usda();
    const size_t end = text.rfind('}');
    text.insert(end, prims);
    return text;
}

constexpr const char* hidden_names[] = {
    "bool primvars:velatura:visibility:camera = 0\nbool primvars:velatura:visibility:shadow = "
    "0\nbool primvars:velatura:visibility:indirect = 0",
    "int primvars:arnold:visibility = 0",
    "string primvars:karma:object:rendervisibility = \"\"",
    "int primvars:ri:attributes:visibility:camera = 0\nint "
    "primvars:ri:attributes:visibility:indirect = 0\nint "
    "primvars:ri:attributes:visibility:transmission = 0",
};

/// One thing of every kind of geometry, of which %s is in the body.
constexpr const char* things[] = {
    "def Mesh \"T\" {{\nint[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]\n"
    "point3f[] points = [(-1, 0.2, 1), (1, 0.2, 1), (0, 2, 1)]\n{}\n}}\n",
    "def Sphere \"T\" {{\ndouble radius = 0.8\n{}\n}}\n",
    "def BasisCurves \"T\" {{\nuniform token type = \"cubic\"\nint[] curveVertexCounts = [4]\n"
    "point3f[] points = [(-2, 1, 1), (-1, 2, 1), (1, 1, 1), (2, 2, 1)]\n"
    "float[] widths = [0.4] (interpolation = \"constant\")\n{}\n}}\n",
    "def Points \"T\" {{\npoint3f[] points = [(0, 1, 2), (1, 1, 2)]\n"
    "float[] widths = [0.5] (interpolation = \"constant\")\n{}\n}}\n",
    "def PointInstancer \"T\" {{\nrel prototypes = </Root/T/Box>\nint[] protoIndices = [0, 0]\n"
    "point3f[] positions = [(0, 1, 1), (1, 2, 1)]\n{}\ndef Cube \"Box\" {{\ndouble size = 0.5\n}}\n"
    "}}\n",
    "def Xform \"T\" (\ninstanceable = true\nreferences = </Root/Model>\n) {{\n{}\n}}\n"
    "class Xform \"Model\" {{\ndef Cube \"Box\" {{\ndouble size = 1.2\n}}\n}}\n",
    "def Volume \"T\" {{\nrel field:density = </Root/Grid>\n{}\n}}\n"
    "def OpenVDBAsset \"Grid\" {{\nasset filePath = @none.vdb@\ntoken fieldName = \"waves\"\n}}\n",
};

}  // namespace

TEST(RayVisibility, OfEverythingChangesNoBit) {
    const uint64_t expected = print_of(room_usda());
    for (const char* lines :
         {"bool primvars:velatura:visibility:camera = 1\nint primvars:velatura:visibility:indirect "
          "= 1\nbool primvars:velatura:matte = 0",
          "int primvars:arnold:visibility = 255\nbool primvars:arnold:matte = 0",
          "string primvars:karma:object:rendervisibility = \"*\"\nint "
          "primvars:karma:object:holdoutmode = 0",
          "int primvars:ri:attributes:visibility:camera = 1\nint "
          "primvars:ri:attributes:visibility:transmission = 1\nint "
          "primvars:ri:attributes:Ri:Matte = 0"})
        EXPECT_EQ(print_of(room_with("Root", lines)), expected) << lines;
    EXPECT_EQ(print_of(room_with("Env", "float primvars:arnold:camera = 1")), expected);
    EXPECT_EQ(print_of(room_with("Key", "bool karma:light:renderlightgeo = 1")), expected);
}

TEST(RayVisibility, WhatNoRaySeesIsNotThere) {
    const uint64_t expected = print_of(room_usda());
    for (const char* thing : things) {
        EXPECT_NE(print_of(room_and(fmt::format(fmt::runtime(thing), ""))), expected) << thing;
        for (const char* lines : hidden_names)
            EXPECT_EQ(print_of(room_and(fmt::format(fmt::runtime(thing), lines))), expected)
                << thing << lines;
    }
    // Inherited
    EXPECT_EQ(print_of(room_and("def Xform \"Group\" {\nint primvars:arnold:visibility = 0\n"
                                "def Sphere \"A\" {}\ndef Scope \"S\" {\ndef Cube \"B\" "
                                "{}\n}\n}\n")),
              expected);
}

TEST(RayVisibility, SomeOfItChangesWhatItNames) {
    const uint64_t expected = print_of(room_usda());
    std::array<uint64_t, 7> prints = {};
    size_t i = 0;
    for (const char* kind :
         {"camera", "shadow", "diffuse_reflect", "specular_reflect", "specular_transmit"}) {
        prints[i] = print_of(
            room_with("Block", fmt::format("bool primvars:arnold:visibility:{} = 0", kind)));
        EXPECT_NE(prints[i], expected) << kind;
        for (size_t j = 0; j < i; ++j) EXPECT_NE(prints[i], prints[j]) << kind;
        ++i;
    }
}

// By way of the code that tells rays apart, where they all meet everything
TEST(RayVisibility, ByWayOfItsOwnCodeKeepsTheImage) {
    const scene::Scene plain = scene_of(room_usda());
    scene::Scene own = plain;
    scene::LinkSet all(1);
    all.add(0);
    own.linking.sets = {all, all};
    own.linking.visible.fill(0);
    // Sets of other numbers, so that lobes are drawn
    own.linking.visible[size_t(scene::RayKind::Diffuse)] = 1;
    for (scene::Light& light : own.lights) light.links = scene::plain_links(own);
    const auto mean = [](const scene::Scene& scene, uint64_t seed, double& variance) {
        double sum = 0, squares = 0;
        constexpr int runs = 24;
        for (int run = 0; run < runs; ++run) {
            integrator::RenderOptions options = options_of(16);
            options.seed = seed + uint64_t(run);
            double of_image = 0;
            for (const double v : beauty(render_scene(scene, options))) of_image += v;
            sum += of_image;
            squares += of_image * of_image;
        }
        variance = (squares - sum * sum / runs) / (runs - 1) / runs;
        return sum / runs;
    };
    double a = 0, b = 0;
    const double expected = mean(plain, 100, a), found = mean(own, 200, b);
    EXPECT_NEAR(found, expected, 4 * std::sqrt(a + b));
    EXPECT_LT(std::sqrt(a + b), 0.02 * expected);
}

TEST(RayVisibility, IsOneImageHoweverItIsMade) {
    std::string text = room_with("Block",
                                 "string primvars:karma:object:rendervisibility = "
                                 "\"-diffuse\"");
    const size_t ball = text.find('{', text.find("\"Ball\""));
    text.insert(ball + 1, "\nbool primvars:arnold:matte = 1\n");
    const size_t glass = text.find('{', text.find("\"Glass\""));
    text.insert(glass + 1, "\nbool primvars:arnold:visibility:shadow = 0\n");
    const scene::Scene scene = scene_of(text);
    RenderSetup setup{.threads = 1, .branches = 0};
    const uint64_t whole = fingerprint(render_scene(scene, options_of(24), setup));
    integrator::RenderOptions tiles = options_of(24);
    tiles.mode = integrator::RenderMode::Tile;
    setup.threads = 3;
    setup.sample_splits = {5, 16};
    setup.bvh_quality = accel::BvhQuality::Fast;
    EXPECT_EQ(fingerprint(render_scene(scene, tiles, setup)), whole);
}

// A light that the camera does not see is the same light everywhere else
TEST(RayVisibility, LightsHiddenFromTheCameraGiveTheirLight) {
    const char* names[] = {"bool primvars:velatura:visibility:camera = 0",
                           "float primvars:arnold:camera = 0",
                           "bool inputs:karma:light:renderlightgeo = 0",
                           "int karma:light:renderlightgeo = 0",
                           "string primvars:karma:object:rendervisibility = \"-primary\"",
                           "int primvars:ri:attributes:visibility:camera = 0"};
    const film::Film seen = render_scene(scene_of(room_usda()), options_of(8));
    for (const char* name : names) {
        const film::Film hidden = render_scene(scene_of(room_with("Env", name)), options_of(8));
        const auto& table = seen.sums().table();
        double direct = 0;
        std::set<uint32_t> changed;
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                const uint32_t beauty = accumulate::AccumulatorTable::beauty;
                direct += double(seen.sums().total(x, y, beauty).x) -
                          double(hidden.sums().total(x, y, beauty).x);
                // Of all else every bit stays
                for (uint32_t a = 2; a < table.total_count(); ++a) {
                    const double v = seen.sums().total(x, y, a).x,
                                 w = hidden.sums().total(x, y, a).x;
                    EXPECT_TRUE(v == w || w < v) << name << a;
                    if (v != w) changed.insert(a);
                }
            }
        }
        EXPECT_GT(direct, 0.0) << name;
        // The background: of its bounce, of its light, and of both
        EXPECT_LE(changed.size(), 3u) << name;
    }
}

}  // namespace velatura::test
