// SPDX-License-Identifier: Apache-2.0
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace velatura::translate::instancing {

namespace {

Vec3 position(const scene::Instance& i) {
    return {i.render_from_prototype[3][0], i.render_from_prototype[3][1],
            i.render_from_prototype[3][2]};
}

std::string lamp_instances(const std::string& second = "") {
    return camera() + R"(
class Xform "Lamp" {
    def Xform "Body" {
        double3 xformOp:translate = (0, 1, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
)" + quad("Q") +
           R"(
    }
    def SphereLight "Bulb" {
        double3 xformOp:translate = (0, 3, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def Xform "A" (instanceable = true
    inherits = </Lamp>) {
    double3 xformOp:translate = (10, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "B" (instanceable = true
    inherits = </Lamp>) {
    double3 xformOp:translate = (20, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
)" + second +
           "}\n";
}

}  // namespace

TEST(NativeInstancing, SharesOnePrototypeAndPlacesItsLights) {
    Translated t;
    translate_text(lamp_instances(), t);
    ASSERT_EQ(t.scene.prototypes.size(), 1u);
    ASSERT_EQ(t.scene.instances.size(), 2u);
    EXPECT_TRUE(t.scene.shapes.empty());
    // The first corner of the body, (0, 1, 0), is the prototype's origin
    EXPECT_EQ(position(t.scene.instances[0]), Vec3(10, 1, 0));
    EXPECT_EQ(position(t.scene.instances[1]), Vec3(20, 1, 0));
    ASSERT_EQ(t.scene.prototypes[0].shapes.size(), 1u);
    EXPECT_EQ(std::get<scene::Mesh>(t.scene.prototypes[0].shapes[0].geometry).points[0],
              Vec3(0, 0, 0));
    ASSERT_EQ(t.scene.lights.size(), 2u);
    EXPECT_EQ(t.scene.lights[0].render_from_light[3][0], 10.0);
    EXPECT_EQ(t.scene.lights[1].render_from_light[3][0], 20.0);
    EXPECT_EQ(t.scene.lights[1].render_from_light[3][1], 3.0);
    EXPECT_EQ(t.scene.lights[0].group, t.scene.lights[1].group);
}

TEST(NativeInstancing, DifferentInheritedColorNeedsItsOwnPrototype) {
    Translated t;
    translate_text(
        lamp_instances(
            "color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = \"constant\")\n"),
        t);
    EXPECT_EQ(t.scene.instances.size(), 2u);
    ASSERT_EQ(t.scene.prototypes.size(), 2u);
    EXPECT_EQ(std::get<scene::Mesh>(t.scene.prototypes[1].shapes[0].geometry).primvars.size(), 1u);
}

TEST(NativeInstancing, FarFromThePrototypesOriginEqualsNoInstancing) {
    const auto text = [](const char* metadata) {
        return camera() + "def Xform \"A\" (" + metadata + R"(
    inherits = </Proto>) {
    double3 xformOp:translate = (-100000000, 0, -5.3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
class Xform "Proto" {
    def Sphere "S" {
        double3 xformOp:translate = (100000000, 0.7, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
)";
    };
    Translated plain, instanced;
    translate_text(text(""), plain);
    translate_text(text("instanceable = true"), instanced);
    ASSERT_EQ(plain.scene.shapes.size(), 1u);
    ASSERT_EQ(instanced.scene.instances.size(), 1u);
    const auto& shape = instanced.scene.prototypes[0].shapes[0];
    const Mat4d placed = std::get<scene::Gprim>(shape.geometry).shape_from_gprim *
                         Mat4d(instanced.scene.instances[0].render_from_prototype);
    for (int r = 0; r < 4; ++r)
        for (int c = 0; c < 3; ++c)
            EXPECT_EQ(float(placed[r][c]), float(plain.gprim(0).shape_from_gprim[r][c]));
}

TEST(NativeInstancing, ShiftsOnAGridLeaveTheBitsAlone) {
    // The stage moves by `stage` with its camera, the prototype's content by `content` against it
    const auto text = [](int64_t stage, int64_t content) {
        const auto move = [](int64_t x, const char* rest) {
            return "double3 xformOp:translate = (" + std::to_string(x) + rest +
                   ")\nuniform token[] xformOpOrder = [\"xformOp:translate\"]\n";
        };
        return camera(move(stage + 3, ".5, 2, 1")) + "class Xform \"P\" {\ndef Xform \"X\" {\n" +
               move(content, ".25, 0.5, 0") + quad("Q") + "}\n}\n" +
               "def Xform \"A\" (instanceable = true\ninherits = </P>) {\n" +
               move(stage - content, ", 0.75, -4") + "}\n" + "def PointInstancer \"I\" {\n" +
               move(stage, ", 0, 0") +
               "rel prototypes = </P>\nint[] protoIndices = [0]\npoint3f[] positions = [(" +
               std::to_string(-content) + ", 1.5, -8)]\n}\n";
    };
    constexpr int64_t far = int64_t(1) << 30;
    Translated at_home;
    translate_text(text(0, 0), at_home);
    ASSERT_EQ(at_home.scene.instances.size(), 2u);
    for (const auto& [stage, content] :
         {std::pair<int64_t, int64_t>{far, 0}, {0, far}, {far, far}}) {
        Translated t;
        translate_text(text(stage, content), t);
        ASSERT_EQ(t.scene.instances.size(), 2u);
        for (size_t i = 0; i < 2; ++i)
            EXPECT_EQ(t.scene.instances[i].render_from_prototype,
                      at_home.scene.instances[i].render_from_prototype);
        EXPECT_EQ(std::get<scene::Mesh>(t.scene.prototypes[0].shapes[0].geometry).points,
                  std::get<scene::Mesh>(at_home.scene.prototypes[0].shapes[0].geometry).points);
    }
}

TEST(NativeInstancing, NestedOnesResolveToLeaves) {
    const std::string text = camera() + "class Xform \"Leaf\" {\n" + quad("Q") + R"(}
class Xform "Branch" {
    def Xform "L1" (instanceable = true
        inherits = </Leaf>) {
        double3 xformOp:translate = (1, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Xform "L2" (instanceable = true
        inherits = </Leaf>) {
        double3 xformOp:translate = (2, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def Xform "T1" (instanceable = true
    inherits = </Branch>) {
    double3 xformOp:translate = (10, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "T2" (instanceable = true
    inherits = </Branch>) {
    double3 xformOp:translate = (20, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
)";
    Translated t;
    translate_text(text, t);
    ASSERT_EQ(t.scene.instances.size(), 4u);
    EXPECT_EQ(t.scene.prototypes.size(), 1u);
    EXPECT_EQ(position(t.scene.instances[3]), Vec3(22, 0, 0));
    TranslateOptions options;
    options.max_instances = 3;
    Translated capped;
    translate_text(text, capped, options);
    // Each of the two comes to three, itself counted
    EXPECT_EQ(capped.scene.instances.size(), 0u);
    EXPECT_EQ(capped.count("too-many-instances"), 2u);
    // What asks for most is left out, and the rest lives
    Translated rest;
    translate_text(text + "def Xform \"T3\" (instanceable = true\n inherits = </Leaf>) {\n}\n",
                   rest, options);
    EXPECT_EQ(rest.scene.instances.size(), 1u);
    EXPECT_EQ(rest.count("too-many-instances"), 2u);
    options.max_instances = 6;
    Translated whole;
    translate_text(text, whole, options);
    EXPECT_EQ(whole.scene.instances.size(), 4u);
    EXPECT_EQ(whole.count("too-many-instances"), 0u);
}

// Copies within copies would come to a million
TEST(NativeInstancing, CopiesInOnePlaceAreOne) {
    std::string text = camera() + "class Xform \"P0\" {\n" + quad("Q") + "}\n";
    const auto instance = [](const std::string& name, const std::string& of,
                             const std::string& more) {
        return "def Xform \"" + name + "\" (instanceable = true\ninherits = </" + of + ">) {\n" +
               more + "}\n";
    };
    for (int level = 1; level <= 6; ++level) {
        text += "class Xform \"P" + std::to_string(level) + "\" {\n";
        for (char i = 'a'; i < 'k'; ++i)
            text += instance(std::string(1, i), "P" + std::to_string(level - 1), "");
        text += "}\n";
    }
    text += instance("First", "P6", "") + instance("Second", "P6", "") +
            instance("Third", "P6",
                     "double3 xformOp:translate = (1, 0, 0)\nuniform token[] xformOpOrder = "
                     "[\"xformOp:translate\"]\n");
    TranslateOptions options;
    options.max_instances = 20;
    Translated t;
    translate_text(text, t, options);
    ASSERT_EQ(t.scene.instances.size(), 2u);
    EXPECT_EQ(position(t.scene.instances[0]) + Vec3(1, 0, 0), position(t.scene.instances[1]));
    EXPECT_EQ(t.count("too-many-instances"), 0u);
    ASSERT_EQ(t.count("duplicate-instances"), 1u);
}

TEST(PointInstancer, CopiesInOnePlaceAreOneUnlessTheyDiffer) {
    const auto instances = [](const std::string& prototypes, const std::string& more) {
        Translated t;
        translate_text(camera() +
                           "def PointInstancer \"I\" {\n rel prototypes = [</I/A>, </I/B>]\n" +
                           more + prototypes + "}\n",
                       t);
        return t.scene.instances.size() + 100 * t.count("duplicate-instances");
    };
    const std::string plain = "def Sphere \"A\" {}\ndef Cube \"B\" {}\n";
    const std::string four = "int[] protoIndices = [0, 1, 0, 0]\n";
    const std::string one_place =
        "point3f[] positions = [(1, 2, 3), (1, 2, 3), (1, 2, 3), (1, 2, 3)]\n";
    EXPECT_EQ(instances(plain, four + one_place), 102u);
    EXPECT_EQ(
        instances(plain,
                  four + "point3f[] positions = [(0, 2, 3), (0, 2, 3), (-0, 2, 3), (1, 2, 3)]\n"),
        103u);
    EXPECT_EQ(
        instances(plain,
                  four + one_place +
                      "float3[] scales = [(1, 1, 1), (1, 1, 1), (1, 1, 1), (1, 1, 1.0000001)]\n"),
        103u);
    EXPECT_EQ(instances(plain, four + one_place +
                                   "color3f[] primvars:displayColor = [(1, 0, 0), (1, 0, 0), (1, "
                                   "0, 0), (0, 1, 0)] (interpolation = \"vertex\")\n"),
              103u);
    EXPECT_EQ(instances(plain, "int[] protoIndices = [0, 0, 0, 0]\n" + one_place +
                                   "color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (1, "
                                   "0, 0), (0, 1, 0)] (interpolation = \"vertex\")\n"),
              102u);
    // What adds up is kept
    const std::string glowing =
        "def Xform \"A\" {\ndef Sphere \"S\" {}\ndef SphereLight \"L\" {}\n}\ndef Cube \"B\" {}\n";
    EXPECT_EQ(instances(glowing, four + one_place), 4u);
}

// Collections of light linking tell prims apart that stand in one place
TEST(NativeInstancing, CopiesThatLightsTellApartAreKept) {
    const auto instances = [](const std::string& light) {
        Translated t;
        translate_text(camera() + light + "class Xform \"P\" {\n" + quad("Q") + "}\n" +
                           "def Xform \"A\" (instanceable = true\ninherits = </P>) {\n}\n" +
                           "def Xform \"B\" (instanceable = true\ninherits = </P>) {\n}\n",
                       t);
        return t.scene.instances.size();
    };
    EXPECT_EQ(instances("def DomeLight \"D\" {\n}\n"), 1u);
    EXPECT_EQ(instances("def DomeLight \"D\" {\nrel collection:shadowLink:excludes = </A>\n}\n"),
              2u);
}

// Little of what asks for too much is shown, so that it does not fill the memory up to the limit
TEST(PointInstancer, TheRestOfTooManyIsSmall) {
    std::string indices, points;
    for (int i = 0; i < 1100; ++i) {
        indices += i ? ",0" : "0";
        points += fmt::format("{}({},0,0)", i ? "," : "", i);
    }
    const auto nested = [&](const std::string& name, int count) {
        // 1100 prototypes, each of them `count` instances of one ball
        std::string few_indices, few_points;
        for (int i = 0; i < count; ++i) {
            few_indices += i ? ",0" : "0";
            few_points += fmt::format("{}(0,{},0)", i ? "," : "", i);
        }
        return "def PointInstancer \"" + name + "\" {\n rel prototypes = </" + name +
               "/In>\n int[] protoIndices = [" + indices + "]\n point3f[] positions = [" + points +
               "]\n def PointInstancer \"In\" {\n rel prototypes = </" + name +
               "/In/S>\n int[] protoIndices = [" + few_indices + "]\n point3f[] positions = [" +
               few_points + "]\n def Sphere \"S\" {}\n }\n}\n";
    };
    TranslateOptions options;
    options.max_instances = 4'000'000;
    Translated within, beyond;
    translate_text(camera() + nested("A", 1000) + nested("B", 1200), within, options);
    EXPECT_EQ(within.scene.instances.size(), 1100u * 2200u);
    translate_text(
        camera() + nested("A", 1000) + nested("B", 1200) + nested("C", 1500) + nested("D", 10),
        beyond, options);
    EXPECT_EQ(beyond.count("too-many-instances"), 3u);
    EXPECT_EQ(beyond.scene.instances.size(), 1100u * 10u);
}

// Few lines that stand for a thousand million volumes and lights
TEST(Instancing, WhatInstancesBringHasALimitOfItsOwn) {
    const auto thousand = [](const std::string& name, const std::string& inside) {
        std::string points, indices;
        for (int i = 0; i < 1000; ++i) {
            points += i ? ", (1, 0, 0)" : "(0, 0, 0)";
            indices += i ? ", 0" : "0";
        }
        return "def PointInstancer \"" + name + "\" {\n rel prototypes = <" + inside +
               ">\n int[] protoIndices = [" + indices + "]\n point3f[] positions = [" + points +
               "]\n";
    };
    Translated t;
    TranslateOptions options;
    options.max_copies = 2500;
    options.max_instances = SIZE_MAX;
    translate_text(
        camera() + thousand("A", "/A/B") + thousand("B", "/A/B/C") + thousand("C", "/A/B/C/Leaf") +
            "def Xform \"Leaf\" {\n def SphereLight \"L\" {\n }\n def Volume \"V\" {\n rel "
            "field:density = </D>\n }\n }\n }\n }\n }\n def OpenVDBAsset \"D\" {\n asset "
            "filePath = @d.vdb@\n }\n",
        t, options);
    EXPECT_EQ(t.count("too-many-instances"), 1u);
    EXPECT_EQ(t.scene.volumes.size(), 1250u);
    EXPECT_EQ(t.scene.lights.size(), 1250u);
}

// A flat instance has a mesh of its own
TEST(Instancing, LargeFlatMeshesAreFewer) {
    std::string indices, counts, points;
    for (int i = 0; i < 80; ++i) {
        counts += i ? ",3" : "3";
        indices += fmt::format("{}{},{},{}", i ? "," : "", i, i + 1, i + 2);
    }
    for (int i = 0; i < 82; ++i) points += fmt::format("{}({},{},0)", i ? "," : "", i, i % 2);
    const std::string text =
        camera() +
        "def PointInstancer \"P\" {\n rel prototypes = </P/M>\n int[] protoIndices = [0, 0, 0]\n"
        " point3f[] positions = [(1, 0, 0), (2, 0, 0), (3, 0, 0)]\n float3[] scales = [(1, 1, 0), "
        "(1, 1, 0), (1, 1, 0)]\n"
        " def Mesh \"M\" {\n uniform token subdivisionScheme = \"none\"\n int[] faceVertexCounts = "
        "[" +
        counts + "]\n int[] faceVertexIndices = [" + indices + "]\n point3f[] points = [" + points +
        "]\n }\n}\n";
    TranslateOptions options;
    for (const auto& [limit, shapes] : {std::pair<size_t, size_t>{33, 3}, {32, 2}}) {
        options.max_copies = limit;  // 1 + 240 / 24 each
        Translated t;
        translate_text(text, t, options);
        EXPECT_EQ(t.scene.shapes.size(), shapes) << limit;
        EXPECT_EQ(t.count("too-many-instances"), 3 - shapes) << limit;
    }
}

TEST(PointInstancer, PlacesScalesRotatesHidesAndColors) {
    Translated t;
    translate_text(camera() + R"(
def PointInstancer "P" (inactiveIds = [13]) {
    double3 xformOp:translate = (100, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    rel prototypes = [</P/Protos/Cube>, </P/Protos/Ball>]
    int[] protoIndices = [0, 1, 0, 1, 7]
    int64[] ids = [10, 11, 12, 13, 14]
    int64[] invisibleIds = [11]
    point3f[] positions = [(1, 0, 0), (2, 0, 0), (3, 0, 0), (4, 0, 0), (5, 0, 0)]
    float3[] scales = [(2, 2, 2), (1, 1, 1), (1, 3, 1), (1, 1, 1), (1, 1, 1)]
    quath[] orientations = [(1, 0, 0, 0), (1, 0, 0, 0), (0.70710678, 0, 0, 0.70710678),
        (1, 0, 0, 0), (1, 0, 0, 0)]
    color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1),
        (0, 0, 0)] (interpolation = "vertex")
    over "Protos" {
        def Cube "Cube" {
            double3 xformOp:translate = (0, 1, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
        def Sphere "Ball" {}
    }
}
)",
                   t);
    ASSERT_EQ(t.scene.instances.size(), 2u);
    EXPECT_TRUE(t.scene.shapes.empty());
    // The cube's own move of (0, 1, 0), scaled by 2, went from its shape into the instance
    EXPECT_EQ(position(t.scene.instances[0]), Vec3(101, 2, 0));
    EXPECT_EQ(t.scene.instances[0].render_from_prototype[1][1], 2.0f);
    EXPECT_EQ(t.inherited(1, "displayColor"), (std::vector<float>{0, 0, 1}));
    // Scale (1, 3, 1), then a quarter turn about z: the prototype's y goes to −3x
    const Mat4& m = t.scene.instances[1].render_from_prototype;
    EXPECT_NEAR(m[1][0], -3.0f, 1e-3f);
    EXPECT_NEAR(m[1][1], 0.0f, 1e-3f);
    const auto& gprim = std::get<scene::Gprim>(t.scene.prototypes[0].shapes[0].geometry);
    EXPECT_EQ(gprim.shape_from_gprim[3][1], 0.0);
    EXPECT_EQ(t.count("bad-instancer"), 1u);
}

TEST(PointInstancer, FlatInstancesAreBaked) {
    Translated t;
    translate_text(camera() + R"(
def PointInstancer "P" {
    rel prototypes = </P/Q>
    int[] protoIndices = [0, 0, 0]
    point3f[] positions = [(1, 0, 0), (2, 0, 0), (3, 0, 0)]
    float3[] scales = [(1, 1, 0), (1, 1, 1), (0, 0, 0)]
    color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1)] (interpolation = "vertex")
)" + quad("Q") + "}\n",
                   t);
    EXPECT_EQ(t.scene.instances.size(), 1u);
    ASSERT_EQ(t.scene.shapes.size(), 1u);
    EXPECT_EQ(t.mesh(0).points[2], Vec3(2, 1, 0));
    // The color of the instance follows it
    ASSERT_EQ(t.mesh(0).primvars.size(), 1u);
    EXPECT_EQ(t.scene.primvar_names[t.mesh(0).primvars[0].name], "displayColor");
    EXPECT_EQ(t.mesh(0).primvars[0].values, (std::vector<float>{1, 0, 0}));
    EXPECT_EQ(t.count("bad-transform"), 1u);
}

}  // namespace velatura::translate::instancing
