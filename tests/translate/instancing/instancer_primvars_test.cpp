// SPDX-License-Identifier: Apache-2.0
// Primvars that instances hand down to their prototypes. Right values: UsdGeomPointInstancer,
// "Primvars on PointInstancer" (constant and uniform: the whole value for each instance; other
// interpolations: the element of the instance, as for points).
#include "translate/support.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <variant>
#include <vector>

namespace velatura::translate::instancing {

namespace {

using Row = std::vector<float>;

/// A material whose color is the primvar `tint`.
const std::string tinted = R"(
def Material "M" {
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </M/R.outputs:result>
        token outputs:surface
    }
    def Shader "R" {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "tint"
        float3 outputs:result
    }
}
)";

const std::string bound = "rel material:binding = </M>\n";

/// Three instances of a cube beside each other, which are tinted.
std::string three(const std::string& lines, const std::string& metadata = "") {
    return camera() + tinted + "def PointInstancer \"P\" (" + metadata + ") {\n" + R"(
    rel prototypes = </P/C>
    int[] protoIndices = [0, 0, 0]
    point3f[] positions = [(1, 0, 0), (3, 0, 0), (5, 0, 0)]
)" + lines +
           "def Cube \"C\" {\n" + bound + "}\n}\n";
}

}  // namespace

TEST(InstancerPrimvars, GoToTheInstanceThatTheyAreOf) {
    struct Case {
        const char* lines;
        Row first, last;
        size_t instances;
        const char* metadata = "";
    };

    const Case cases[] = {
        {"color3f[] primvars:tint = [(1,0,0),(0,1,0),(0,0,1)] (interpolation = \"vertex\")\n",
         {1, 0, 0},
         {0, 0, 1},
         3},
        {"color3f[] primvars:tint = [(1,0,0),(0,1,0),(0,0,1)] (interpolation = \"faceVarying\")\n",
         {1, 0, 0},
         {0, 0, 1},
         3},
        {"color3f[] primvars:tint = [(1,0,0),(0,0,1)] (interpolation = \"varying\")\n"
         "int[] primvars:tint:indices = [1, 0, 0]\n",
         {0, 0, 1},
         {1, 0, 0},
         3},
        {"color3f[] primvars:tint = [(1,0,0)] (interpolation = \"constant\")\n",
         {1, 0, 0},
         {1, 0, 0},
         3},
        {"color3f[] primvars:tint = [(1,0,0)] (interpolation = \"uniform\")\n",
         {1, 0, 0},
         {1, 0, 0},
         3},
        {"color3f primvars:tint = (1,0,0)\n", {1, 0, 0}, {1, 0, 0}, 3},
        // What is not shown keeps its element: the third instance is the second that is there
        {"color3f[] primvars:tint = [(1,0,0),(0,1,0),(0,0,1)] (interpolation = \"vertex\")\n"
         "int64[] ids = [7, 8, 9]\nint64[] invisibleIds = [8]\n",
         {1, 0, 0},
         {0, 0, 1},
         2},
        {"color3f[] primvars:tint = [(1,0,0),(0,1,0),(0,0,1)] (interpolation = \"vertex\")\n",
         {0, 1, 0},
         {0, 0, 1},
         2,
         "inactiveIds = [0]"},
    };
    for (const Case& c : cases) {
        SCOPED_TRACE(c.lines);
        Translated t;
        translate_text(three(c.lines, c.metadata), t);
        for (const char* code : {"bad-primvar", "missing-primvar", "unsupported-primvar"})
            EXPECT_EQ(t.messages(code), "");
        ASSERT_EQ(t.scene.instances.size(), c.instances);
        EXPECT_EQ(t.inherited(0, "tint"), c.first);
        EXPECT_EQ(t.inherited(c.instances - 1, "tint"), c.last);
    }
}

TEST(InstancerPrimvars, OfATimeAreThoseOfIt) {
    Translated t;
    translate_at(1,
                 three("color3f[] primvars:tint.timeSamples = { 0: [(0,0,0),(0,0,0),(0,0,0)], 2: "
                       "[(1,0,0),(0,1,0),(0,0,1)] }\nuniform token primvars:x = \"\"\n"
                       "color3f[] primvars:tint (interpolation = \"vertex\")\n"),
                 t);
    EXPECT_EQ(t.inherited(2, "tint"), (Row{0, 0, 0.5f}));
}

TEST(InstancerPrimvars, ThatNothingReadsAreNotKept) {
    Translated t;
    translate_text(three("float[] primvars:weight = [1, 2, 3] (interpolation = \"vertex\")\n"), t);
    EXPECT_TRUE(t.scene.instance_values.empty());
    // What is wrong with it is of no consequence either; that tint is missing is
    EXPECT_EQ(t.messages("bad-primvar"), "");
    EXPECT_EQ(t.count("missing-primvar"), 1u);
}

/// Each message says what becomes of it.
TEST(InstancerPrimvars, ThatDoNotFitFallBackWithAMessage) {
    struct Case {
        const char* lines;
        const char* code;
        const char* message;
        Row value;
    };

    const Case cases[] = {
        {"color3f[] primvars:tint = [(1,0,0),(0,1,0)] (interpolation = \"vertex\")\n",
         "bad-primvar",
         "/P: primvar tint has 2 values, expected 3, one for each instance; it is ignored; "
         "instances use the primvars of their prototypes\n",
         {}},
        {"color3f[] primvars:tint = [(1,0,0)] (interpolation = \"vertex\")\n",
         "bad-primvar",
         "/P: primvar tint has 1 values, expected 3, one for each instance; it is used for all "
         "instances\n",
         {1, 0, 0}},
        {"color3f[] primvars:tint = [(1,0,0),(0,1,0),(0,0,1)]\n",
         "bad-primvar",
         "/P: primvar tint is constant and has 3 values, expected 1; the first is "
         "used everywhere\n",
         {1, 0, 0}},
        {"color3f[] primvars:tint = [(1,0,0)] (interpolation = \"vertex\")\n"
         "int[] primvars:tint:indices = [0, 4, 0]\n",
         "bad-primvar",
         "/P: primvar tint has the index 4, expected 0 to 0; it is ignored; instances use the "
         "primvars of their prototypes\n",
         {}},
        {"color3f[] primvars:tint = [(1,0,0)] (interpolation = \"vertex\")\n"
         "int[] primvars:tint:indices = [0, 0]\n",
         "bad-primvar",
         "/P: primvar tint has 2 indices, expected 3, one for each instance; it is ignored; "
         "instances use the primvars of their prototypes\n",
         {}},
        {"color3f[] primvars:tint = [(1,0,0),(0,1,0),(0,0,1)] (interpolation = \"vertex\"\n"
         "elementSize = 2)\n",
         "unsupported-primvar",
         "/P: primvar tint has elementSize 2, only 1 is supported; it is ignored; instances use "
         "the primvars of their prototypes\n",
         {}},
        {"string[] primvars:tint = [\"a\", \"b\", \"c\"] (interpolation = \"vertex\")\n",
         "unsupported-primvar",
         "/P: primvar tint of type string[] is not supported; it is ignored; instances use the "
         "primvars of their prototypes\n",
         {}},
    };
    for (const Case& c : cases) {
        SCOPED_TRACE(c.lines);
        Translated t;
        translate_text(three(c.lines), t);
        ASSERT_EQ(t.scene.instances.size(), 3u);
        EXPECT_EQ(t.messages(c.code), c.message);
        EXPECT_EQ(t.inherited(2, "tint"), c.value);
        EXPECT_EQ(t.count("missing-primvar"), 0u) << "its own fault is reported";
    }
}

/// An instancer in a prototype of another: the nearer value counts, as with namespace inheritance.
TEST(InstancerPrimvars, OfNestedInstancersTheNearestCounts) {
    const auto nested = [](const std::string& inner) {
        return camera() + tinted + R"(
def Scope "Protos" {
    color3f[] primvars:tint = [(0.5, 0.5, 0.5)]
    def PointInstancer "Inner" {
        rel prototypes = </Protos/Inner/C>
        int[] protoIndices = [0, 0]
        point3f[] positions = [(1, 0, 0), (3, 0, 0)]
)" + inner + "def Cube \"C\" {\n" +
               bound + R"(}
    }
}
def PointInstancer "Outer" {
    rel prototypes = </Protos/Inner>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(0, 0, 0), (0, 3, 0)]
    color3f[] primvars:tint = [(1, 0, 0), (0, 1, 0)] (interpolation = "vertex")
}
)";
    };
    // The two of the stage itself come first: those below Protos are drawn as well
    Translated outer, inner;
    translate_text(nested(""), outer);
    ASSERT_EQ(outer.scene.instances.size(), 6u);
    std::multiset<Row> colors;
    for (size_t i = 0; i < 6; ++i) colors.insert(outer.inherited(i, "tint"));
    const Row gray = {0.5f, 0.5f, 0.5f};
    EXPECT_EQ(colors.count({1, 0, 0}), 2u);
    EXPECT_EQ(colors.count({0, 1, 0}), 2u);
    EXPECT_EQ(colors.count(gray), 2u) << "what is inherited from above the prototype is further";
    translate_text(
        nested("color3f[] primvars:tint = [(0,0,1),(0,1,1)] (interpolation = \"vertex\")\n"),
        inner);
    ASSERT_EQ(inner.scene.instances.size(), 6u);
    colors.clear();
    for (size_t i = 0; i < 6; ++i) colors.insert(inner.inherited(i, "tint"));
    EXPECT_EQ(colors.count({0, 0, 1}), 3u);
    EXPECT_EQ(colors.count({0, 1, 1}), 3u);
}

/// What a prototype inherits from above the instancer yields to the instancer's own; what stands
/// on the prototype or below does not.
TEST(InstancerPrimvars, AreNearerThanWhatPrototypesInheritFromAbove) {
    const auto yields = [](const std::string& world, const std::string& proto) {
        Translated t;
        translate_text(camera() + tinted + "def Xform \"W\" {\n" + world + R"(
def PointInstancer "P" {
    rel prototypes = </W/P/X>
    int[] protoIndices = [0]
    point3f[] positions = [(1, 0, 0)]
    color3f[] primvars:tint = [(1, 0, 0)] (interpolation = "vertex")
    def Xform "X" {
)" + proto + "def Cube \"C\" {\n" +
                           bound + "}\n}\n}\n}\n",
                       t);
        const auto& primvars =
            std::get<scene::Gprim>(t.scene.prototypes.at(0).shapes.at(0).geometry).primvars;
        return primvars.size() == 1 ? int(primvars[0].yields_to_instance) : -1;
    };
    const std::string blue =
        "color3f[] primvars:tint = [(0, 0, 1)] (interpolation = \"constant\")\n";
    EXPECT_EQ(yields(blue, ""), -1) << "hidden by the instancer's, which is not constant";
    EXPECT_EQ(yields("", blue), 0);
    Translated t;
    // The prototype stands elsewhere, below something that has the primvar
    translate_text(camera() + tinted + "over \"Away\" {\n" + blue + "def Cube \"C\" {\n" + bound +
                       R"(}
}
def PointInstancer "P" {
    rel prototypes = </Away/C>
    int[] protoIndices = [0]
    point3f[] positions = [(1, 0, 0)]
    color3f[] primvars:tint = [(1, 0, 0)] (interpolation = "vertex")
}
)",
                   t);
    const auto& away = std::get<scene::Gprim>(t.scene.prototypes.at(0).shapes.at(0).geometry);
    ASSERT_EQ(away.primvars.size(), 1u);
    EXPECT_TRUE(away.primvars[0].yields_to_instance);
}

TEST(InstancerPrimvars, ReachFlatInstancesAndAreNamedWhereTheyDisplace) {
    Translated t;
    translate_text(three("color3f[] primvars:tint = [(1,0,0),(0,1,0),(0,0,1)] (interpolation = "
                         "\"vertex\")\nfloat3[] scales = [(1,1,0),(1,1,1),(1,1,1)]\n"),
                   t);
    ASSERT_EQ(t.scene.shapes.size(), 1u);
    ASSERT_EQ(t.gprim(0).primvars.size(), 1u);
    EXPECT_EQ(t.gprim(0).primvars[0].values, (Row{1, 0, 0}));

    Translated moved;
    translate_text(camera() + R"(
def Material "D" {
    token outputs:surface.connect = </D/S.outputs:surface>
    token outputs:displacement.connect = </D/S.outputs:displacement>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:displacement.connect = </D/R.outputs:result>
        token outputs:surface
        token outputs:displacement
    }
    def Shader "R" {
        uniform token info:id = "UsdPrimvarReader_float"
        string inputs:varname = "height"
        float outputs:result
    }
}
def PointInstancer "P" {
    rel prototypes = </P/Q>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(1, 0, 0), (3, 0, 0)]
    float[] primvars:height = [0.5, 1] (interpolation = "vertex")
)" + quad("Q", "rel material:binding = </D>\n") +
                       "}\n",
                   moved);
    EXPECT_EQ(moved.count("unsupported-displacement"), 1u);
}

/// Two instances whose indexed constants differ by their indices alone.
TEST(NativeInstancing, IndicesOfInheritedPrimvarsTellInstancesApart) {
    Translated t;
    const auto instance = [](const char* name, const char* index) {
        return std::string("def Xform \"") + name +
               "\" (instanceable = true\ninherits = </Proto>) " +
               "{\ncolor3f[] primvars:tint = [(1,0,0),(0,0,1)] (interpolation = \"constant\")\n" +
               "int[] primvars:tint:indices = [" + index + "]\n}\n";
    };
    translate_text(camera() + tinted + "class Xform \"Proto\" {\ndef Cube \"C\" {\n" + bound +
                       "}\n}\n" + instance("A", "0") + instance("B", "1"),
                   t);
    EXPECT_EQ(t.scene.prototypes.size(), 2u);
}

/// An instancer may itself be the root of an instance, as after a reference to an asset.
TEST(NativeInstancing, OfAPointInstancerIsAPointInstancer) {
    Translated t;
    translate_text(camera() + R"(
class PointInstancer "Proto" {
    rel prototypes = </Proto/C>
    int[] protoIndices = [0, 0, 0]
    point3f[] positions = [(1, 0, 0), (3, 0, 0), (5, 0, 0)]
    def Cube "C" {}
}
def "A" (instanceable = true
    inherits = </Proto>) {}
)",
                   t);
    EXPECT_EQ(t.scene.instances.size(), 3u);
    EXPECT_TRUE(t.scene.shapes.empty());
}

}  // namespace velatura::translate::instancing
