// SPDX-License-Identifier: Apache-2.0
#include "hard_case.h"
#include "translate/support.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::translate::geometry {

namespace {

/// A small world under a transform of the whole, camera included.
std::string world(const std::string& ops, const std::string& order) {
    return "def Xform \"W\" {\n" + ops + "\nuniform token[] xformOpOrder = [" + order + "]\n" + R"(
def Camera "Cam" {
    double3 xformOp:translate = (3.25, -2.5, 8.125)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "Place" {
    double3 xformOp:translate = (0.5, 1.25, -7.0625)
    float3 xformOp:rotateXYZ = (10, 20, 30)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
)" + quad("Q") +
           R"(
    def Sphere "S" { double radius = 0.75; }
    def RectLight "L" { bool inputs:normalize = 0; }
}
def PointInstancer "P" {
    rel prototypes = </W/P/Proto>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(1, 2, 3), (4, 5, 6)]
    def Cube "Proto" {}
}
})";
}

/// Two scenes agree bit for bit up to the scale 2^k.
void expect_same(const scene::Scene& a, const scene::Scene& b, int k) {
    const float s = std::ldexp(1.0f, k);
    ASSERT_EQ(a.shapes.size(), b.shapes.size());
    ASSERT_EQ(a.instances.size(), b.instances.size());
    ASSERT_EQ(a.lights.size(), b.lights.size());
    const auto expect_matrix = [&](const Mat4d& m, const Mat4d& n) {
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 3; ++j) EXPECT_EQ(std::ldexp(m[i][j], k), n[i][j]);
    };
    for (size_t i = 0; i < a.shapes.size(); ++i) {
        if (const auto* mesh = std::get_if<scene::Mesh>(&a.shapes[i].geometry)) {
            const auto& other = std::get<scene::Mesh>(b.shapes[i].geometry);
            for (size_t p = 0; p < mesh->points.size(); ++p)
                EXPECT_EQ(mesh->points[p] * s, other.points[p]);
        } else {
            expect_matrix(std::get<scene::Gprim>(a.shapes[i].geometry).shape_from_gprim,
                          std::get<scene::Gprim>(b.shapes[i].geometry).shape_from_gprim);
        }
    }
    for (size_t i = 0; i < a.instances.size(); ++i)
        expect_matrix(Mat4d(a.instances[i].render_from_prototype),
                      Mat4d(b.instances[i].render_from_prototype));
    for (size_t i = 0; i < a.lights.size(); ++i)
        expect_matrix(a.lights[i].render_from_light, b.lights[i].render_from_light);
    EXPECT_EQ(a.camera.window_right, b.camera.window_right);
}

}  // namespace

TEST(FarOrigin, TranslatedWorldGivesTheSameBits) {
    Translated near, far;
    translate_text(world("double3 xformOp:translate = (0, 0, 0)", "\"xformOp:translate\""), near);
    translate_text(world("double3 xformOp:translate = (1073741824, -1073741824, 1073741824)",
                         "\"xformOp:translate\""),
                   far);
    ASSERT_EQ(near.error_message, "");
    ASSERT_EQ(near.scene.shapes.size(), 2u);
    ASSERT_EQ(near.scene.instances.size(), 2u);
    expect_same(near.scene, far.scene, 0);
}

TEST(FarOrigin, ScaledWorldGivesTheSameBitsUpToTheScale) {
    Translated one;
    translate_text(world("double3 xformOp:scale = (1, 1, 1)", "\"xformOp:scale\""), one);
    for (const int k : {-20, 20}) {
        Translated scaled;
        const std::string s = std::to_string(std::ldexp(1.0, k));
        const std::string exact = k == -20 ? "9.5367431640625e-07" : s;
        translate_text(
            world("double3 xformOp:scale = (" + exact + ", " + exact + ", " + exact + ")",
                  "\"xformOp:scale\""),
            scaled);
        expect_same(one.scene, scaled.scene, k);
    }
}

TEST(H08Mirrored, LeftHandedAndMirrorsFlipTogether) {
    Translated t;
    translate_text(
        camera() + quad("A") + quad("B", "uniform token orientation = \"leftHanded\"") +
            quad("C",
                 "double3 xformOp:scale = (-1, 1, 1)\nuniform token[] xformOpOrder = "
                 "[\"xformOp:scale\"]") +
            quad(
                "D",
                "uniform token orientation = \"leftHanded\"\ndouble3 xformOp:scale = (-1, 1, 1)\n"
                "uniform token[] xformOpOrder = [\"xformOp:scale\"]\nuniform bool doubleSided = 1"),
        t);
    ASSERT_EQ(t.scene.shapes.size(), 4u);
    EXPECT_FALSE(t.scene.shapes[0].flip_normals);
    EXPECT_TRUE(t.scene.shapes[1].flip_normals);
    EXPECT_TRUE(t.scene.shapes[2].flip_normals);
    EXPECT_FALSE(t.scene.shapes[3].flip_normals);
    EXPECT_TRUE(t.scene.shapes[3].double_sided);
    EXPECT_FALSE(t.scene.shapes[0].double_sided);
}

TEST(H08Mirrored, NormalsOfASquashedMirrorStayOutside) {
    Translated t;
    translate_text(
        camera() +
            quad("A",
                 "normal3f[] normals = [(0,0,1)] (interpolation = \"constant\")\n"
                 "double3 xformOp:scale = (-4, 1, 1)\nfloat3 xformOp:rotateXYZ = (0, 0, 45)\n"
                 "uniform token[] xformOpOrder = [\"xformOp:scale\", \"xformOp:rotateXYZ\"]"),
        t);
    ASSERT_EQ(t.mesh(0).normals.size(), 1u);
    EXPECT_EQ(t.mesh(0).normals[0], Vec3(0, 0, 1));
    EXPECT_EQ(t.mesh(0).normal_interpolation, scene::Interpolation::Constant);
}

TEST(Mesh, PrimvarNormalsWinOverNormals) {
    Translated t;
    translate_text(
        camera() + quad("A",
                        "normal3f[] normals = [(0,0,1),(0,0,1),(0,0,1),(0,0,1)]\n"
                        "normal3f[] primvars:normals = [(0,1,0)] (interpolation = \"uniform\")"),
        t);
    ASSERT_EQ(t.mesh(0).normals.size(), 1u);
    EXPECT_EQ(t.mesh(0).normals[0], Vec3(0, 1, 0));
    EXPECT_EQ(t.mesh(0).normal_interpolation, scene::Interpolation::Uniform);
}

TEST(H10Garbage, BrokenFacesAreDroppedWithTheirPrimvars) {
    Translated t;
    translate_text(camera() + R"(
def Mesh "M" {
    point3f[] points = [(0,0,0),(1,0,0),(1,1,0),(0,1,0),(nan,0,0)]
    int[] faceVertexCounts = [3, 2, 3, 3, 3, 3]
    int[] faceVertexIndices = [0,1,2, 0,1, 0,1,9, 0,1,4, 0,2,3, 1,2,3]
    int[] holeIndices = [5]
    uniform token subdivisionScheme = "none"
    color3f[] primvars:displayColor = [(1,0,0),(2,0,0),(3,0,0),
        (4,0,0),(5,0,0),(6,0,0)] (interpolation = "uniform")
    float2[] primvars:st = [(0,0),(1,0)] (interpolation = "faceVarying")
    int[] primvars:st:indices = [0,0,0, 0,0, 0,0,0, 0,0,0, 1,0,1, 0,0,0]
}
)",
                   t);
    ASSERT_EQ(t.scene.shapes.size(), 1u);
    const scene::Mesh& mesh = t.mesh(0);
    EXPECT_EQ(mesh.face_vertex_counts, (std::vector<uint32_t>{3, 3}));
    EXPECT_EQ(mesh.face_vertex_indices, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3}));
    hardcase::expect_within({"broken faces of four that stay or whose numbers stay",
                             std::abs(2.0 - double(mesh.face_vertex_counts.size())), 0, 0,
                             "the mesh without them"});
    EXPECT_EQ(t.count("bad-topology"), 3u);
    ASSERT_EQ(mesh.primvars.size(), 2u);
    EXPECT_EQ(mesh.primvars[0].values, (std::vector<float>{1, 0, 0, 5, 0, 0}));
    EXPECT_EQ(mesh.primvars[1].indices, (std::vector<uint32_t>{0, 0, 0, 1, 0, 1}));
}

TEST(Mesh, CountsThatOverrunTheIndicesAreReported) {
    Translated t;
    translate_text(camera() + R"(
def Mesh "M" {
    point3f[] points = [(0,0,0),(1,0,0),(1,1,0),(0,1,0)]
    int[] faceVertexCounts = [3, 4]
    int[] faceVertexIndices = [0,1,2, 0,1]
    uniform token subdivisionScheme = "none"
}
)",
                   t);
    ASSERT_EQ(t.scene.shapes.size(), 1u);
    EXPECT_EQ(t.mesh(0).face_vertex_counts.size(), 1u);
    EXPECT_GE(t.count("bad-topology"), 1u);
}

/// Two quads side by side.
static std::string two_quads(const std::string& extra) {
    return R"(def Mesh "M" {
    point3f[] points = [(0,0,0),(1,0,0),(1,1,0),(0,1,0),(2,0,0),(2,1,0)]
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0,1,2,3, 1,4,5,2]
)" + extra +
           "\n}\n";
}

TEST(Mesh, SubdivisionIsTheFallback) {
    Translated t;
    translate_text(camera() + two_quads(""), t);
    EXPECT_EQ(t.diagnostics.warning_count(), t.count("no-lights"));
    EXPECT_EQ(t.mesh(0).subdivision, scene::SubdivisionScheme::CatmullClark);
    const scene::SubdivisionRules& rules = t.mesh(0).rules;
    EXPECT_EQ(rules.boundary, scene::BoundaryInterpolation::EdgeAndCorner);
    EXPECT_EQ(rules.face_varying, scene::FaceVaryingInterpolation::CornersPlus1);
    EXPECT_EQ(rules.triangles, scene::TriangleRule::CatmullClark);
    // The polygons that may stand for the surface are smooth: all normals of a flat pair are its
    // own
    ASSERT_EQ(t.mesh(0).normals.size(), 6u);
    for (const Vec3& n : t.mesh(0).normals) EXPECT_EQ(n, Vec3(0, 0, 1));
}

TEST(Mesh, SubdivisionRulesAreRead) {
    Translated t;
    translate_text(camera() + two_quads(R"(
    uniform token subdivisionScheme = "loop"
    token interpolateBoundary = "edgeOnly"
    token faceVaryingLinearInterpolation = "boundaries"
    token triangleSubdivisionRule = "smooth"
    int[] creaseIndices = [1, 2, 3, 4, 5]
    int[] creaseLengths = [3, 2]
    float[] creaseSharpnesses = [2, 4.5]
    int[] cornerIndices = [0, 3]
    float[] cornerSharpnesses = [10, 1]
    int[] holeIndices = [1])"),
                   t);
    EXPECT_EQ(t.mesh(0).subdivision, scene::SubdivisionScheme::Loop);
    const scene::SubdivisionRules& rules = t.mesh(0).rules;
    EXPECT_EQ(rules.boundary, scene::BoundaryInterpolation::EdgeOnly);
    EXPECT_EQ(rules.face_varying, scene::FaceVaryingInterpolation::Boundaries);
    EXPECT_EQ(rules.triangles, scene::TriangleRule::Smooth);
    using Pairs = std::vector<std::array<uint32_t, 2>>;
    EXPECT_EQ(rules.creases, (Pairs{{1, 2}, {2, 3}, {4, 5}}));
    EXPECT_EQ(rules.crease_sharpnesses, (std::vector<float>{2, 2, 4.5f}));
    EXPECT_EQ(rules.corners, (std::vector<uint32_t>{0, 3}));
    EXPECT_EQ(rules.corner_sharpnesses, (std::vector<float>{10, 1}));
    // Holes shape the surface: the face is kept
    EXPECT_EQ(rules.holes, std::vector<uint32_t>{1});
    EXPECT_EQ(t.mesh(0).face_vertex_counts.size(), 2u);
    EXPECT_EQ(t.count("bad-subdivision"), 0u);
}

TEST(Mesh, SubdivisionRulesThatNameNothingCostThemselvesOnly) {
    Translated t;
    translate_text(camera() + two_quads(R"(
    token interpolateBoundary = "sideways"
    int[] creaseIndices = [1, 2, 0, 5, 77, -1]
    int[] creaseLengths = [2, 2, 2]
    float[] creaseSharpnesses = [3, nan, 5]
    int[] cornerIndices = [0, 99]
    float[] cornerSharpnesses = [3, 3]
    int[] holeIndices = [5])"),
                   t);
    const scene::SubdivisionRules& rules = t.mesh(0).rules;
    EXPECT_EQ(rules.boundary, scene::BoundaryInterpolation::EdgeAndCorner);
    EXPECT_EQ(rules.creases.size(), 1u);
    EXPECT_EQ(rules.corners, std::vector<uint32_t>{0});
    EXPECT_TRUE(rules.holes.empty());
    EXPECT_EQ(t.count("bad-subdivision"), 3u);
    EXPECT_EQ(t.count("bad-topology"), 1u);
}

TEST(Mesh, CreasesOfWrongCountsAreLeftOut) {
    for (const char* counts : {"[2, 3]", "[9]", "[-2]", "[1, 1]", "[]"}) {
        Translated t;
        translate_text(camera() + two_quads(std::string("int[] creaseIndices = [1, 2]\n"
                                                        "float[] creaseSharpnesses = [1]\n"
                                                        "int[] cornerIndices = [1]\n"
                                                        "int[] creaseLengths = ") +
                                            counts),
                       t);
        EXPECT_TRUE(t.mesh(0).rules.creases.empty()) << counts;
        EXPECT_TRUE(t.mesh(0).rules.corners.empty());
        EXPECT_EQ(t.count("bad-subdivision"), 2u) << counts;
    }
}

TEST(Mesh, HolesGoByTheFacesThatAreLeft) {
    Translated t;
    translate_text(camera() + R"(def Mesh "M" {
    point3f[] points = [(0,0,0),(1,0,0),(1,1,0),(0,1,0),(2,0,0),(2,1,0)]
    int[] faceVertexCounts = [2, 4, 4]
    int[] faceVertexIndices = [0,1, 0,1,2,3, 1,4,5,2]
    int[] holeIndices = [2, 0]
}
)",
                   t);
    EXPECT_EQ(t.mesh(0).face_vertex_counts.size(), 2u);
    EXPECT_EQ(t.mesh(0).rules.holes, std::vector<uint32_t>{1});
}

TEST(H09SingularMatrices, FlatSheetsLiveAndLinesDie) {
    const auto scaled = [](const std::string& name, const std::string& scale) {
        return quad(name, "double3 xformOp:scale = " + scale +
                              "\nuniform token[] xformOpOrder = [\"xformOp:scale\"]");
    };
    Translated t;
    translate_text(camera() + scaled("Sheet", "(1, 1, 0)") + scaled("Line", "(1, 0, 0)") +
                       scaled("Point", "(0, 0, 0)") + scaled("Nan", "(nan, 1, 1)"),
                   t);
    ASSERT_EQ(t.scene.shapes.size(), 1u);
    hardcase::expect_within({"prims with a line, a point or NaN for a matrix that are not named",
                             std::abs(3.0 - double(t.count("bad-transform"))), 0, 0,
                             "one message each"});
}

TEST(Gprims, AxesTurnTheSpine) {
    Translated t;
    translate_text(camera() +
                       "def Cylinder \"A\" { uniform token axis = \"X\"; double height = 6; }\n"
                       "def Cone \"B\" { uniform token axis = \"Y\"; }\n"
                       "def Plane \"PX\" { uniform token axis = \"X\"; double width = 4; double "
                       "length = 2; }\n"
                       "def Plane \"PY\" { uniform token axis = \"Y\"; double width = 4; double "
                       "length = 2; }\n"
                       "def Capsule \"Q\" {}\n",
                   t);
    ASSERT_EQ(t.scene.shapes.size(), 5u);
    const auto turn = [&](size_t i, const Vec3d& v) {
        return transform_direction(v, t.gprim(i).shape_from_gprim);
    };
    EXPECT_EQ(turn(0, {0, 0, 1}), Vec3d(1, 0, 0));
    EXPECT_EQ(t.gprim(0).height, 6.0);
    EXPECT_EQ(turn(1, {0, 0, 1}), Vec3d(0, 1, 0));
    // Width along z for axis X, along x for axis Y; the normal along the axis
    EXPECT_EQ(std::abs(turn(2, {1, 0, 0}).z), 1.0);
    EXPECT_EQ(turn(2, {0, 0, 1}), Vec3d(1, 0, 0));
    EXPECT_EQ(std::abs(turn(3, {1, 0, 0}).x), 1.0);
    EXPECT_EQ(turn(3, {0, 0, 1}), Vec3d(0, 1, 0));
    EXPECT_TRUE(t.scene.shapes[2].double_sided);
    EXPECT_EQ(t.gprim(4).radius, 0.5);
    EXPECT_EQ(t.gprim(4).height, 1.0);
    for (size_t i = 0; i < 4; ++i) EXPECT_EQ(determinant3(t.gprim(i).shape_from_gprim), 1.0);
}

TEST(Visibility, InvisiblePrunesAndUnsupportedIsNamed) {
    Translated t;
    translate_text(camera() + "def Xform \"W\" {\n token visibility = \"invisible\"\n" +
                       quad("Q", "token visibility = \"inherited\"") + "}\n" + R"(
def NurbsCurves "B" {}
def TetMesh "P" {}
def NurbsPatch "N" {}
)",
                   t);
    EXPECT_TRUE(t.scene.shapes.empty());
    EXPECT_EQ(t.count("unsupported-geometry"), 3u);
}

}  // namespace velatura::translate::geometry
