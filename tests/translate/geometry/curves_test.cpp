// SPDX-License-Identifier: Apache-2.0
#include "test_assets.h"
#include "translate/support.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

namespace velatura::translate::geometry {

namespace {

using Interpolation = scene::Interpolation;

const scene::Curves& curves_of(const Translated& t, size_t i = 0) {
    return std::get<scene::Curves>(t.scene.shapes.at(i).geometry);
}

const scene::Points& points_of(const Translated& t, size_t i = 0) {
    return std::get<scene::Points>(t.scene.shapes.at(i).geometry);
}

void translate_curves(const std::string& lines,
                      Translated& out,
                      const std::string& transform = "") {
    translate_text(camera() + "def BasisCurves \"C\" {\n" + lines + transform + "}\n", out);
    ASSERT_EQ(out.error, "") << out.error_message;
}

const char* const two_curves = R"(
    int[] curveVertexCounts = [4, 7]
    point3f[] points = [(0,0,0),(1,0,0),(2,0,0),(3,0,0),
        (0,1,0),(1,1,0),(2,1,0),(3,1,0),(4,1,0),(5,1,0),(6,1,0)]
)";

}  // namespace

TEST(BasisCurves, AreReadAsTheyAre) {
    Translated t;
    translate_curves(std::string(two_curves) + R"(
        float[] widths = [1, 2, 3, 4, 5] (interpolation = "varying")
        normal3f[] normals = [(0,0,1),(0,1,0)] (interpolation = "uniform")
        color3f[] primvars:displayColor = [(1,0,0),(0,1,0)] (interpolation = "uniform")
        bool doubleSided = true
    )",
                     t);
    const scene::Curves& curves = curves_of(t);
    EXPECT_EQ(curves.basis, scene::Curves::Basis::Bezier);
    EXPECT_EQ(curves.wrap, scene::Curves::Wrap::Nonperiodic);
    EXPECT_EQ(curves.vertex_counts, (std::vector<uint32_t>{4, 7}));
    EXPECT_EQ(curves.points[10], Vec3(6, 1, 0));
    EXPECT_EQ(curves.widths, (std::vector<float>{1, 2, 3, 4, 5}));
    EXPECT_EQ(curves.width_interpolation, Interpolation::Varying);
    EXPECT_EQ(curves.normals[1], Vec3(0, 1, 0));
    EXPECT_EQ(curves.normal_interpolation, Interpolation::Uniform);
    ASSERT_EQ(curves.primvars.size(), 1u);
    EXPECT_EQ(curves.primvars[0].values.size(), 6u);
    EXPECT_EQ(curves.shape_from_curves, Mat4d());
    EXPECT_TRUE(t.scene.shapes[0].double_sided);
    for (const char* code :
         {"bad-curves", "bad-widths", "bad-normals", "bad-topology", "missing-widths"})
        EXPECT_EQ(t.count(code), 0u) << code;
}

TEST(BasisCurves, HaveTheirBasesAndWraps) {
    const std::pair<const char*, scene::Curves::Basis> kinds[] = {
        {"uniform token type = \"linear\"", scene::Curves::Basis::Linear},
        {"uniform token basis = \"bezier\"", scene::Curves::Basis::Bezier},
        {"uniform token basis = \"bspline\"", scene::Curves::Basis::Bspline},
        {"uniform token basis = \"catmullRom\"", scene::Curves::Basis::CatmullRom}};
    for (const auto& [text, basis] : kinds) {
        Translated t;
        translate_curves(std::string(two_curves) + "float[] widths = [1]\n" + text + "\n", t);
        EXPECT_EQ(curves_of(t).basis, basis);
        EXPECT_EQ(curves_of(t).width_interpolation, Interpolation::Constant);
    }
    Translated pinned, unknown;
    translate_curves(std::string(two_curves) +
                         "float[] widths = [1]\nuniform token basis = \"bspline\"\nuniform token "
                         "wrap = \"pinned\"\n",
                     pinned);
    EXPECT_EQ(curves_of(pinned).wrap, scene::Curves::Wrap::Pinned);
    translate_curves(std::string(two_curves) + "uniform token basis = \"hermite\"\n", unknown);
    EXPECT_TRUE(unknown.scene.shapes.empty());
    EXPECT_EQ(unknown.count("unsupported-curves"), 1u);
}

TEST(BasisCurves, LoseWhatIsWrongOfThem) {
    // A good one last, whose numbers must stay its own
    const std::string good = "(0,9,0),(1,9,0),(2,9,0),(3,9,0)";
    const std::string line = "(0,0,0),(1,0,0),(2,0,0),(3,0,0),";

    const struct {
        std::string counts, points, widths;
        size_t warnings;
    } cases[] = {
        {"[3, 4]", "[(0,0,0),(1,0,0),(2,0,0)," + good + "]", "[1,1,1,2,2,2,2]", 1},
        {"[0, 4]", "[" + good + "]", "[2,2,2,2]", 1},
        {"[-4, 4]", "[" + good + "]", "[2,2,2,2]", 1},
        {"[4, 4]", "[(0,0,0),(inf,0,0),(1,0,0),(2,0,0)," + good + "]", "[1,1,1,1,2,2,2,2]", 1},
        {"[4, 4]", "[(1,1,1),(1,1,1),(1,1,1),(1,1,1)," + good + "]", "[1,1,1,1,2,2,2,2]", 1},
        {"[4, 70]", "[" + good + "]", "[2,2,2,2]", 1},
    };

    for (const auto& c : cases) {
        Translated t;
        translate_curves("int[] curveVertexCounts = " + c.counts +
                             "\npoint3f[] points = " + c.points + "\nfloat[] widths = " + c.widths +
                             " (interpolation = \"vertex\")\ncolor3f[] primvars:displayColor = "
                             "[(1,0,0),(0,0,1)] (interpolation = \"uniform\")\n",
                         t);
        EXPECT_EQ(t.count("bad-curves"), c.warnings) << c.counts << c.points;
        ASSERT_EQ(t.scene.shapes.size(), 1u) << c.counts << c.points;
        const scene::Curves& curves = curves_of(t);
        EXPECT_EQ(curves.vertex_counts, (std::vector<uint32_t>{4}));
        EXPECT_EQ(curves.points.size(), 4u);
        EXPECT_EQ(curves.widths, (std::vector<float>{2, 2, 2, 2}));
        const bool is_first_good = c.counts == "[4, 70]";
        EXPECT_EQ(curves.points[0], Vec3(0, 9, 0));
        EXPECT_EQ(curves.primvars[0].values,
                  is_first_good ? (std::vector<float>{1, 0, 0}) : (std::vector<float>{0, 0, 1}));
    }
    // Widths and normals that fit nothing
    Translated widths, normals, none, more;
    translate_curves(
        std::string(two_curves) + "float[] widths = [1, 2, 3] (interpolation = \"vertex\")\n",
        widths);
    EXPECT_EQ(curves_of(widths).widths, std::vector<float>{1});
    EXPECT_EQ(widths.count("bad-widths"), 1u);
    EXPECT_EQ(widths.count("missing-widths"), 0u);
    translate_curves(std::string(two_curves) +
                         "float[] widths = [1]\nnormal3f[] normals = [(0,0,1),(0,0,1),(0,1,0)]\n",
                     normals);
    EXPECT_TRUE(curves_of(normals).normals.empty());
    EXPECT_EQ(normals.count("bad-normals"), 1u);
    translate_curves(two_curves, none);
    EXPECT_EQ(curves_of(none).widths, std::vector<float>{1});
    EXPECT_EQ(none.count("missing-widths"), 1u);
    translate_curves("int[] curveVertexCounts = [4]\npoint3f[] points = [" + line + good +
                         "]\nfloat[] widths = [1]\n",
                     more);
    EXPECT_EQ(more.count("bad-topology"), 1u);
    EXPECT_EQ(curves_of(more).points.size(), 4u);
}

TEST(BasisCurves, StandWhereTransformsPutThem) {
    Translated even, uneven, flat;
    const std::string lines = std::string(two_curves) + "float[] widths = [0.5]\n";
    translate_curves(lines, even,
                     "float3 xformOp:scale = (2,2,-2)\ndouble3 xformOp:translate = "
                     "(1,0,0)\nuniform token[] xformOpOrder = "
                     "[\"xformOp:translate\",\"xformOp:scale\"]\n");
    EXPECT_EQ(curves_of(even).points[1], Vec3(3, 0, 0));
    EXPECT_EQ(curves_of(even).widths[0], 1.0f);
    EXPECT_EQ(curves_of(even).shape_from_curves, Mat4d());
    EXPECT_FALSE(even.scene.shapes[0].flip_normals);
    translate_curves(lines, uneven,
                     "float3 xformOp:scale = (2,1,1)\ndouble3 xformOp:translate = "
                     "(1e9,0,0)\nuniform token[] xformOpOrder = "
                     "[\"xformOp:translate\",\"xformOp:scale\"]\n");
    const scene::Curves& curves = curves_of(uneven);
    EXPECT_EQ(curves.widths[0], 0.5f);
    const Vec3d end = transform_point(Vec3d(curves.points[10]), curves.shape_from_curves);
    EXPECT_EQ(end, Vec3d(1e9 + 12, 1, 0));
    translate_curves(
        lines, flat,
        "float3 xformOp:scale = (2,1,0)\nuniform token[] xformOpOrder = [\"xformOp:scale\"]\n");
    EXPECT_TRUE(flat.scene.shapes.empty());
    EXPECT_EQ(flat.count("bad-transform"), 1u);
}

TEST(BasisCurves, SayWhatIsNotRenderedOfThem) {
    Translated t;
    TranslateOptions options;
    options.time = 0.0;
    translate_text(camera("double shutter:open = 0\ndouble shutter:close = 0.5\n") + R"(
def BasisCurves "Moving" (prepend apiSchemas = ["LightAPI"]) {
    int[] curveVertexCounts = [4]
    point3f[] points.timeSamples = {0: [(0,0,0),(1,0,0),(2,0,0),(3,0,0)],
        1: [(0,1,0),(1,1,0),(2,1,0),(3,1,0)]}
    float[] widths = [1]
    vector3f[] velocities = [(0,0,0),(0,0,0),(0,0,0),(0,0,0)]
    uniform bool primvars:screenSpaceWidths = true
}
def NurbsCurves "N" {}
def HermiteCurves "H" {}
def NurbsPatch "P" {}
)",
                   t, options);
    EXPECT_EQ(t.count("unsupported-motion-blur"), 1u);
    EXPECT_EQ(t.count("unused-velocities"), 1u);
    EXPECT_EQ(t.count("unsupported-light"), 1u);
    EXPECT_EQ(t.count("unsupported-widths"), 1u);
    EXPECT_EQ(t.count("unsupported-geometry"), 3u);
    EXPECT_EQ(curves_of(t).points[0], Vec3(0));
    EXPECT_EQ(t.scene.shapes[0].light, scene::none);
}

TEST(Points, AreReadAsTheyAre) {
    Translated t;
    translate_text(camera() + R"(
def Points "P" {
    point3f[] points = [(0,0,0),(1,0,0),(2,0,0),(3,0,0)]
    float[] widths = [1, -1, nan, 2]
    color3f[] primvars:displayColor = [(1,0,0),(0,1,0),(0,0,1),(1,1,1)] (interpolation = "vertex")
}
def Points "Plain" {
    point3f[] points = [(0,0,0),(1,0,0)]
}
def Points "None" {
    point3f[] points = []
}
)",
                   t);
    ASSERT_EQ(t.scene.shapes.size(), 2u);
    // Bad ones keep their place among the primvars, without a width
    EXPECT_EQ(points_of(t).widths, (std::vector<float>{1, 0, 0, 2}));
    EXPECT_EQ(points_of(t).points[3], Vec3(3, 0, 0));
    EXPECT_EQ(points_of(t).primvars[0].values.size(), 12u);
    EXPECT_EQ(t.count("bad-widths"), 1u);
    EXPECT_EQ(points_of(t, 1).widths, (std::vector<float>{1, 1}));
}

TEST(BasisCurves, OfPublicFilesAreRead) {
    const auto folder = test_assets() / "openusd/imaging";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no public test files";
    const auto read = [&](const char* path, double time, Translated& out) {
        std::ifstream in(folder / path);
        std::stringstream text;
        text << in.rdbuf();
        TranslateOptions options;
        options.time = time;
        translate_text(text.str(), out, options);
    };
    // Of its curves those of 8, 9 and 5 vertices are none
    Translated bunny, fewer, empty;
    read("testUsdImagingGLBasisCurvesVaryingTopology/bunnyCurves.usda", 1, bunny);
    EXPECT_EQ(curves_of(bunny).vertex_counts, (std::vector<uint32_t>{13, 10, 7}));
    EXPECT_EQ(bunny.count("bad-curves"), 1u);
    read("testUsdImagingGLBasisCurvesVaryingTopology/bunnyCurves.usda", 3, fewer);
    EXPECT_EQ(curves_of(fewer).vertex_counts, (std::vector<uint32_t>{13}));
    read("testUsdImagingGLBasisCurvesVaryingTopology/bunnyCurves.usda", 4, empty);
    EXPECT_TRUE(empty.scene.shapes.empty());
    Translated points;
    read("testUsdImagingGLPrimvarProcessing/points_widths.usda", 3, points);
    EXPECT_EQ(points_of(points).widths, (std::vector<float>{0.3f, 2.0f, 1.0f, 0.4f}));
}

}  // namespace velatura::translate::geometry
