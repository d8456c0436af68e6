// SPDX-License-Identifier: Apache-2.0
// Whatever a stage holds that is lost, a prim, an array or a binding, is named in a message that
// says what becomes of it; and one bad array that may be missing costs no more than itself.
#include "support.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

namespace velatura::translate {

namespace {

struct Case {
    const char* code;
    const char* consequence;  ///< part of the message
    std::string prims;
    bool is_rendered = true;  ///< whether something is left of it
};

const std::string strand = R"(
    uniform token type = "cubic"
    uniform token basis = "bspline"
    int[] curveVertexCounts = [7]
    point3f[] points = [(-3,0,0), (-2,0,0), (-1,0,0), (0,0,0), (1,0,0), (2,0,0), (3,0,0)]
)";
const std::string balls = "point3f[] points = [(0,0,0), (1,0,0)]\n";
const std::string two = R"(
    rel prototypes = </P/C>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(1, 0, 0), (3, 0, 0)]
    def Cube "C" {}
)";

std::string curves(const std::string& lines) {
    return "def BasisCurves \"P\" {\n" + strand + lines + "}\n";
}

std::string points(const std::string& lines) {
    return "def Points \"P\" {\n" + lines + "}\n";
}

std::string instancer(const std::string& lines) {
    return "def PointInstancer \"P\" {\n" + two + lines + "}\n";
}

/// A quad that is subdivided.
std::string smooth_quad(const std::string& lines) {
    std::string text = quad("P", lines);
    const std::string none = "uniform token subdivisionScheme = \"none\"";
    return text.erase(text.find(none), none.size());
}

std::string without(std::string text, const std::string& line) {
    const size_t at = text.find(line);
    return text.erase(at, text.find('\n', at) - at);
}

std::vector<Case> cases() {
    return {
        // Curves: 7 vertices of a B-spline have 5 varying elements (4 segments)
        {"bad-widths", "7 widths or indices, expected 5 (varying); they are taken as vertex",
         curves("float[] widths = [1,1,1,1,1,1,1] (interpolation = \"varying\")\n")},
        {"bad-widths", "3 widths or indices, expected 7 (vertex); widths fall back to 1",
         curves("float[] widths = [1, 1, 1]\n")},
        {"bad-widths", "the index 9, expected 0 to 0; widths fall back to 1",
         curves("float[] primvars:widths = [1] (interpolation = \"uniform\")\n"
                "int[] primvars:widths:indices = [9]\n")},
        {"bad-widths", "widths have 3 components, expected 1; widths fall back to 1",
         curves("float3[] widths = [(1,1,1)]\n")},
        {"bad-widths", "1 of 7 widths are negative or not finite; these are set to 0",
         curves("float[] widths = [1,1,-1,1,1,1,1]\n")},
        {"bad-widths", "1 of 1 widths are negative or not finite; widths fall back to 1",
         curves("float[] widths = [nan]\n")},
        {"missing-widths", "taken to be 1 wide", curves("")},
        {"bad-normals", "normals are ignored, the curves are round",
         curves("float[] widths = [1]\nnormal3f[] normals = [(0,0,1),(0,0,1)]\n")},
        {"bad-normals",
         "some normals are not finite; normals are ignored, and the curves are round",
         curves("float[] widths = [1]\nnormal3f[] normals = [(0,0,1),(0,0,1),(0,nan,1),(0,0,1),"
                "(0,0,1),(0,0,1),(0,0,1)]\n")},
        {"bad-primvar", "it is ignored, its fallback is used",
         curves("float[] widths = [1]\ncolor3f[] primvars:displayColor = [(1,0,0),(0,1,0)] "
                "(interpolation = \"vertex\")\n")},
        {"bad-primvar", "is constant and has 2 values, expected 1; the first is used everywhere",
         curves("float[] widths = [1]\ncolor3f[] primvars:displayColor = [(1,0,0),(0,1,0)]\n")},
        {"unsupported-curves", "wrap \"loop\" of curves is unknown; it falls back to nonperiodic",
         curves("float[] widths = [1]\nuniform token wrap = \"loop\"\n")},
        {"unsupported-curves", "basis hermite are not supported, the prim is skipped",
         "def BasisCurves \"P\" {\nuniform token basis = \"hermite\"\n}\n", false},
        {"empty-curves", "curveVertexCounts is not authored; the BasisCurves is skipped",
         "def BasisCurves \"P\" {\n" + balls + "}\n", false},
        {"empty-curves", "points is not authored; the BasisCurves is skipped",
         "def BasisCurves \"P\" {\nint[] curveVertexCounts = [4]\n}\n", false},
        {"bad-curves", "1 of 2 curves are skipped",
         "def BasisCurves \"P\" {\nuniform token type = \"linear\"\nint[] curveVertexCounts = "
         "[2, 2]\nfloat[] widths = [1]\n" +
             balls + "}\n"},
        {"bad-topology", "1 points belong to no curve and are ignored",
         "def BasisCurves \"P\" {\nuniform token type = \"linear\"\nint[] curveVertexCounts = "
         "[2]\nfloat[] widths = [1]\npoint3f[] points = [(0,0,0), (1,0,0), (2,0,0)]\n}\n"},
        // Points
        {"bad-widths", "5 widths or indices, expected 2 (vertex); widths fall back to 1",
         points(balls + "float[] widths = [1,1,1,1,1]\n")},
        {"bad-widths", "2 of 2 widths are negative or not finite; widths fall back to 1",
         points(balls + "float[] widths = [-1, nan]\n")},
        {"bad-points", "1 of 2 points are not finite and are skipped",
         points("point3f[] points = [(0,0,0), (nan,0,0)]\n")},
        {"bad-points", "2 of 2 points are not finite and are skipped: the prim is skipped",
         points("point3f[] points = [(nan,0,0), (nan,0,0)]\n"), false},
        // Meshes
        {"bad-normals", "they are ignored, the mesh falls back to the normals of its faces",
         quad("P", "normal3f[] normals = [(0,0,1),(0,0,1)]\n")},
        {"bad-normals",
         "1 of 4 normals are not finite; the mesh falls back to the normals of its faces there",
         quad("P", "normal3f[] normals = [(0,0,1),(0,nan,1),(0,0,1),(0,0,1)]\n")},
        {"bad-normals", "they are ignored, the mesh falls back to the normals of its surface",
         smooth_quad("normal3f[] normals = [(0,0,1),(0,0,1)]\n")},
        {"bad-normals", "they are ignored, the mesh falls back to the normals of its faces",
         quad("P", "float[] normals = [1, 2, 3, 4]\n")},
        {"bad-subdivision", "all creases are ignored",
         smooth_quad("int[] creaseIndices = [0, 1]\nint[] creaseLengths = [5]\nfloat[] "
                     "creaseSharpnesses = [1]\n")},
        {"bad-subdivision", "all corners are ignored", smooth_quad("int[] cornerIndices = [0]\n")},
        {"bad-topology", "hole index 7 is not a face of 1; it is ignored",
         quad("P", "int[] holeIndices = [7]\n")},
        {"empty-mesh", "points is not authored; the Mesh is skipped",
         "def Mesh \"P\" {\nint[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0,1,2]\n}\n",
         false},
        // Instancers
        {"bad-instancer",
         "scales has 3 elements, expected 2; it is ignored, and instances are not scaled",
         instancer("float3[] scales = [(1,1,1),(1,1,1),(1,1,1)]\n")},
        {"bad-instancer",
         "orientations has 1 elements, expected 2; it is ignored, and instances are not turned",
         instancer("quath[] orientations = [(1,0,0,0)]\n")},
        {"bad-instancer", "1 of 2 orientationsf are not finite; these instances are not turned",
         instancer("quatf[] orientationsf = [(nan,0,0,0),(1,0,0,0)]\n")},
        {"bad-instancer", "scales is not numeric; it is ignored, and instances are not scaled",
         instancer("string[] scales = [\"a\", \"b\"]\n")},
        {"bad-instancer", "it is ignored, and instances are identified by index",
         instancer("int64[] ids = [1, 2, 3]\n")},
        {"bad-instancer",
         "positions has 2 elements, expected 3; it is ignored, and instances are at the origin",
         "def PointInstancer \"P\" {\n" + without(two, "    int[] protoIndices") +
             "int[] protoIndices = [0, 0, 0]\n}\n"},
        {"bad-instancer", "positions is not authored; all instances are at the origin",
         "def PointInstancer \"P\" {\n" + without(two, "    point3f[] positions") + "}\n"},
        {"bad-instancer", "protoIndices is not authored; the PointInstancer is skipped",
         "def PointInstancer \"P\" {\n" + without(two, "    int[] protoIndices") + "}\n", false},
        {"bad-instancer", "these instances are skipped",
         "def PointInstancer \"P\" {\n" + without(two, "    int[] protoIndices") +
             "int[] protoIndices = [0, 7]\n}\n"},
        {"bad-instancer", "does not exist; its instances are skipped",
         "def PointInstancer \"P\" {\n" + without(two, "    rel prototypes") +
             "rel prototypes = </Nowhere>\n}\n",
         false},
        {"bad-primvar", "it is ignored; instances use the primvars of their prototypes",
         instancer("color3f[] primvars:displayColor = [(1,0,0),(1,0,0),(1,0,0)] (interpolation = "
                   "\"vertex\")\n")},
        // Others
        {"bad-gprim-size", "the prim is skipped", "def Sphere \"P\" {\ndouble radius = -1\n}\n",
         false},
        {"bad-transform", "the prim and its children are skipped",
         "def Cube \"P\" {\nfloat3 xformOp:scale = (1, 0, 0)\nuniform token[] xformOpOrder = "
         "[\"xformOp:scale\"]\n}\n",
         false},
        {"unsupported-geometry", "the prim is skipped", "def NurbsPatch \"P\" {}\n", false},
        {"usd-binding-target", "the prim gets no material",
         "def Cube \"P\" (prepend apiSchemas = [\"MaterialBindingAPI\"]) {\nrel material:binding = "
         "</Nothing>\n}\n"},
    };
}

}  // namespace

TEST(LostParts, AreNamedWithWhatBecomesOfThem) {
    for (const Case& c : cases()) {
        SCOPED_TRACE(c.prims);
        Translated t;
        translate_text(camera() + c.prims, t);
        EXPECT_NE(t.messages(c.code).find(c.consequence), std::string::npos)
            << c.code << ": " << c.consequence << "\nsaid:\n"
            << t.messages(c.code);
        EXPECT_NE(t.messages(c.code).find("/P"), std::string::npos);
        EXPECT_EQ(!t.scene.shapes.empty() || !t.scene.instances.empty(), c.is_rendered);
        // One reason, and a consequence, each
        EXPECT_EQ(("\n" + t.messages(c.code)).find("\n;"), std::string::npos) << t.messages(c.code);
    }
}

/// What the positions of an instancer lack is said once.
TEST(LostParts, PositionsOfAnotherCountAreNamedOnce) {
    Translated t;
    translate_text(camera() + "def PointInstancer \"P\" {\n" +
                       without(two, "    int[] protoIndices") +
                       "int[] protoIndices = [0, 0, 0]\n}\n",
                   t);
    EXPECT_EQ(t.count("bad-instancer"), 1u) << t.messages("bad-instancer");
}

/// The strand of a B-spline whose 7 widths are called varying is as wide as they say.
TEST(LostParts, WidthsOfAnotherCountAreTakenByTheInterpolationThatTheyFit) {
    Translated t;
    translate_text(
        camera() + curves("float[] widths = [1,2,3,4,5,6,7] (interpolation = \"varying\")\n"), t);
    ASSERT_EQ(t.scene.shapes.size(), 1u);
    const auto& strand_read = std::get<scene::Curves>(t.scene.shapes[0].geometry);
    EXPECT_EQ(strand_read.width_interpolation, scene::Interpolation::Vertex);
    EXPECT_EQ(strand_read.widths, (std::vector<float>{1, 2, 3, 4, 5, 6, 7}));
}

/// So are normals, as the documentation of curves has it: the strand stays a ribbon.
TEST(LostParts, NormalsOfAnotherCountAreTakenByTheInterpolationThatTheyFit) {
    Translated t;
    translate_text(camera() + curves("float[] widths = [1]\nnormal3f[] normals = [(1,0,0),(1,0,0),"
                                     "(1,0,0),(0,0,1),(1,0,0),(1,0,0),(1,0,0)] (interpolation = "
                                     "\"varying\")\n"),
                   t);
    ASSERT_EQ(t.scene.shapes.size(), 1u);
    const auto& ribbon = std::get<scene::Curves>(t.scene.shapes[0].geometry);
    EXPECT_EQ(ribbon.normal_interpolation, scene::Interpolation::Vertex);
    ASSERT_EQ(ribbon.normals.size(), 7u);
    EXPECT_NEAR(ribbon.normals[3].z, 1.0f, 1e-6f);
    EXPECT_EQ(t.count("bad-normals"), 1u) << t.messages("bad-normals");
}

}  // namespace velatura::translate
